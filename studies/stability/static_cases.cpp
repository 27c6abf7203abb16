/// Static equilibrium over the whole range of materials and large strains, judged with the stability map: where the
/// homogeneous lattice is stable there must be an answer without inverted cells; beyond, an answer or an error.

#include "studies/stability/stability_map.hpp"
#include "studies/stability/static_body.hpp"

#include <fmt/format.h>

namespace hybmss::stability {
namespace {

constexpr double kStrains[] = {0.05, 0.2, 0.5};
constexpr double kCrushResistance = 20;

/// Cubes, and for tension a bar, whose middle is free of its ends.
Lattice body_for(PlateMotion motion) {
    return motion == PlateMotion::tension ? Lattice::box(3, 9, 3, kCellSize) : Lattice::box(5, 5, 5, kCellSize);
}

/// Whether the homogeneous lattice that stands for the body is stable, free to move sideways or not. Shear and torsion
/// stretch by up to 1 +- strain / 2 along the diagonals. The corners at clamped plates are strained more: by a quarter,
/// say.
bool is_stable(const Material& material, PlateMotion motion, double strain) {
    const auto stable_at = [&](Stretching stretching, double stretch) {
        const auto wave = weakest_wave_at(material, stretching, stretch);
        return wave && wave->relative_stiffness > kNeutral;
    };
    const double more = 1.25 * strain;
    const double stretch = motion == PlateMotion::compression ? 1 - more
                           : motion == PlateMotion::tension   ? 1 + more
                                                              : 1 - more / 2;
    return stable_at(Stretching::bar, stretch) && stable_at(Stretching::confined, stretch);
}

/// From a symmetric start a solve keeps the symmetry, and may so end in an equilibrium that the energy can fall from.
/// Every node moved by up to a hundredth of a cell edge, it must find its way down.
std::string disturb(const StaticSolve& symmetric, const Lattice& lattice, const Material& material,
                    const Loading& loading) {
    Vectors u = symmetric.displacements;
    const Vectors change = random_vectors(u.size(), 0.01 * kCellSize, 51);
    for (std::size_t n = 0; n < u.size(); ++n) {
        u[n] += change[n];
    }
    const StaticSolve below = solve(lattice, material, loading, std::move(u));
    if (!below.converged()) {
        return "disturbed, it ends with " + below.result.message;
    }
    require(below.result.potential <= symmetric.result.potential * (1 + 1e-12), "disturbed, it gains energy");
    return fmt::format("disturbed, it {} (min J {:.2f}, energy lower by {:.1e} of itself)",
                       below.check.falling_directions == 0 ? "wrinkles to a stable one" : "finds another unstable one",
                       below.result.min_cell_volume_ratio, 1 - below.result.potential / symmetric.result.potential);
}

Outcome solve_plates(const Material& material, PlateMotion motion, double strain) {
    const Lattice lattice = body_for(motion);
    const Loading loading = plates(lattice, motion, strain);
    const StaticSolve end =
        solve(lattice, material, loading, Vectors(rest_positions_of(lattice).size(), Vector3d::Zero()));
    if (!end.converged()) {
        require(material.volume_energy == VolumeEnergy::quadratic || !is_stable(material, motion, strain),
                "an error, where the map says stable: " + end.result.message);
        Outcome outcome = unsolved(end, lattice);
        if (end.result.status == EquilibriumStatus::unbounded) {
            outcome.how += fmt::format("; the last equilibrium has {:.0e} of the least curvature at rest",
                                       least_curvature(lattice, material, loading, end.displacements));
        }
        return outcome;
    }
    // No such loading turns a solid inside out, however far it goes.
    require(end.result.min_cell_volume_ratio > 0,
            fmt::format("cells are inverted: volume ratio {:.3g}", end.result.min_cell_volume_ratio));
    if (end.check.falling_directions == 0) {
        return solved(end, fmt::format("a stable equilibrium; {} load steps, {} Newton iterations",
                                       end.result.load_steps, end.result.newton_iterations));
    }
    require(!is_stable(material, motion, strain), "an unstable equilibrium, where the map says stable");
    return solved(end, fmt::format("the symmetric equilibrium, unstable as the map says; {}",
                                   disturb(end, lattice, material, loading)));
}

} // namespace

void append_static_cases(std::vector<HardCase>& cases, SpringForm springs) {
    for (const double nu : kPoissonRatios) {
        for (const double ratio : kFaceDiagonalRatios) {
            for (const PlateMotion motion : kPlateMotions) {
                for (const double strain : kStrains) {
                    for (const double crush : {0.0, kCrushResistance}) {
                        Material material = case_material(springs, nu, ratio);
                        material.crush.stiffness = crush;
                        const bool quick = ratio == 1 && strain < 0.3 && (nu == -0.5 || nu == 0.25 || nu == 0.49);
                        // The energy is bounded below then, whatever is pressed flat.
                        const bool bounded = nu >= 0.25 && crush > 0;
                        cases.push_back(
                            {fmt::format("static: {} by {:g} %, nu = {:g}, A = {:g}{}", name(motion), 100 * strain, nu,
                                         ratio, crush > 0 ? fmt::format(", crush resistance {:g}", crush) : ""),
                             bounded ? "equilibrium" : "equilibrium; an error only beyond the stability map",
                             bounded ? Wanted::answer : Wanted::answer_or_error, quick,
                             [=] { return solve_plates(material, motion, strain); }});
                    }
                }
            }
        }
    }
    for (const double nu : {0.0, -0.5}) {
        const Material material = case_material(springs, nu, 1, VolumeEnergy::quadratic);
        cases.push_back({fmt::format("static: tension by 20 %, nu = {:g}, A = 1, quadratic energy", nu),
                         "an error that names the cause: the energy falls without end", Wanted::error, true, [=] {
                             const Outcome outcome = solve_plates(material, PlateMotion::tension, 0.2);
                             require(outcome.how.find("falls without end") != std::string::npos,
                                     "the cause is not named: " + outcome.how);
                             return outcome;
                         }});
    }
}

} // namespace hybmss::stability
