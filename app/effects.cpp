#include "app/effects.hpp"

#include <fmt/format.h>

namespace hybmss {
namespace {

void add_springs(EffectList& effects, const Scene& scene, const Lattice& lattice) {
    const double ratio = scene.material.face_diagonal_ratio;
    const SpringCounts springs = lattice.merged_springs(ratio > 0);
    effects.in.push_back({"edge springs", fmt::format("{}: every cell has them", springs.edges)});
    effects.in.push_back({"cube diagonals", fmt::format("{}: every cell has them", springs.cube_diagonals)});
    if (ratio > 0) {
        effects.in.push_back(
            {"face diagonals", fmt::format("{}: face_diagonal_ratio = {} > 0", springs.face_diagonals, ratio)});
    } else {
        effects.out.push_back({"face diagonals", "face_diagonal_ratio = 0 (HybMSS-FD)"});
    }
}

void add_volume_force(EffectList& effects, const Material& material) {
    const double kappa = volume_modulus(material), nu = material.poisson_ratio;
    if (kappa == 0) {
        effects.out.push_back({"volume force", "kappa = 0 at poisson_ratio = 0.25: the springs alone are right there"});
        return;
    }
    if (material.volume_energy == VolumeEnergy::none) {
        effects.out.push_back({"volume force", "volume_energy = \"none\" (HybMSS-CF)"});
        return;
    }
    const bool quadratic = resolved_volume_energy(material) == VolumeEnergy::quadratic;
    const char* why = material.volume_energy != VolumeEnergy::automatic ? "as asked"
                      : quadratic                                       ? "automatic: poisson_ratio >= 0.25"
                                                                        : "automatic: poisson_ratio < 0.25";
    effects.in.push_back({"volume force", fmt::format("{} energy ({}); poisson_ratio = {} makes kappa = {:.6g} Pa",
                                                      quadratic ? "quadratic" : "mean stretch", why, nu, kappa)});
}

} // namespace

EffectList effects_of(const Simulation& simulation) {
    const Scene& scene = simulation.scene();
    EffectList effects;
    const auto add = [&](bool in, const char* effect, std::string reason, const char* absence) {
        (in ? effects.in : effects.out).push_back({effect, in ? std::move(reason) : absence});
    };
    add_springs(effects, scene, simulation.lattice());
    add_volume_force(effects, scene.material);
    const auto& g = scene.gravity.acceleration;
    add(g[0] != 0 || g[1] != 0 || g[2] != 0, "gravity", fmt::format("({}, {}, {}) m/s^2", g[0], g[1], g[2]),
        "no [gravity], or zero");
    const bool is_static = scene.solver.method == SolverMethod::static_equilibrium;
    add(scene.damping.mass > 0 && !is_static, "mass damping", fmt::format("{} 1/s", scene.damping.mass),
        is_static ? "static: nothing moves" : "no damping.mass, or zero");
    add(!is_static, "inertia", std::string(name(scene.solver.method)), "static: nothing moves");
    add(!scene.loads.empty(), "loads", fmt::format("{} [[load]]", scene.loads.size()), "no [[load]]");
    add(!scene.cuts.empty(), "cutting", fmt::format("{} [[cut]]", scene.cuts.size()), "no [[cut]]");
    std::size_t rough = 0;
    for (const SceneObstacle& obstacle : scene.obstacles) {
        rough += obstacle.friction > 0;
    }
    add(!scene.obstacles.empty(), "contact",
        fmt::format("{} surface nodes with {} [[obstacle]], {} with friction",
                    surface_nodes(simulation.lattice()).size(), scene.obstacles.size(), rough),
        "no [[obstacle]]");
    add(!scene.fixes.empty(), "fixed nodes",
        fmt::format("{} nodes, by {} [[fix]]", simulation.fixed_node_count(), scene.fixes.size()), "no [[fix]]");
    double over = 0;
    for (const Move& move : scene.moves) {
        over = move.over > over ? move.over : over;
    }
    add(!scene.moves.empty(), "prescribed motion",
        fmt::format("{} nodes, by {} [[move]]{}", simulation.moved_node_count(), scene.moves.size(),
                    is_static ? "" : fmt::format(", over {} s", over)),
        "no [[move]]");
    return effects;
}

} // namespace hybmss
