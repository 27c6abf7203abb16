#include "studies/paper/experiment.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hybmss::paper {
namespace {

constexpr double kCubeEdge = 5, kBarWidth = 0.4, kGravity = 10; // m, m, m/s^2
constexpr int kBarAspect = 6;

bool is_bar(Kind kind) {
    return kind == Kind::tension || kind == Kind::beam;
}

int cells_across(const Experiment& experiment) {
    return experiment.across > 0 ? experiment.across : is_bar(experiment.kind) ? 4 : 10;
}

Move plate_motion(const Experiment& experiment) {
    const double strain = experiment.amount / 100;
    Move move{.where = FaceRegion{1, true}, .motion = std::array<double, 3>{0, 0, 0}};
    switch (experiment.kind) {
    case Kind::compression:
        move.motion = std::array<double, 3>{0, -strain * kCubeEdge, 0};
        break;
    case Kind::shear:
        move.motion = std::array<double, 3>{strain * kCubeEdge, 0, 0};
        break;
    case Kind::torsion:
        move.motion = Rotation{.axis = 1, .degrees = experiment.amount};
        break;
    case Kind::tension:
        move.where = FaceRegion{2, true};
        move.motion = std::array<double, 3>{0, 0, strain * kBarAspect * kBarWidth};
        break;
    case Kind::beam:
        break;
    }
    return move;
}

} // namespace

std::string_view name(Kind kind) {
    constexpr std::string_view names[] = {"compression", "tension", "shear", "torsion", "beam"};
    return names[static_cast<std::size_t>(kind)];
}

std::string_view name(Model model) {
    constexpr std::string_view names[] = {"HybMSS-FD", "HybMSS-CF", "HybMSS", "HybMSS-M"};
    return names[static_cast<std::size_t>(model)];
}

Material with_model(Material material, Model model) {
    material.face_diagonal_ratio = model == Model::hybmss_fd || model == Model::hybmss_m ? 0 : 1;
    material.springs = model == Model::hybmss_m ? SpringForm::means : SpringForm::nodes;
    if (model == Model::hybmss_cf) {
        material.volume_energy = VolumeEnergy::none;
    }
    return material;
}

std::string amount_text(const Experiment& experiment) {
    switch (experiment.kind) {
    case Kind::beam:
        return "";
    case Kind::torsion:
        return fmt::format("{:g} degree{}", experiment.amount, experiment.amount == 1 ? "" : "s");
    default:
        return fmt::format("{:g} %", experiment.amount);
    }
}

std::string key(const Experiment& experiment) {
    const auto [nx, ny, nz] = mesh(experiment);
    const std::string amount = amount_text(experiment);
    return fmt::format("{}{}{} E={:g} nu={:g} {}x{}x{}", name(experiment.kind), amount.empty() ? "" : " ", amount,
                       experiment.young_modulus, experiment.poisson_ratio, nx, ny, nz);
}

std::array<int, 3> mesh(const Experiment& experiment) {
    const int n = cells_across(experiment);
    return {n, n, is_bar(experiment.kind) ? kBarAspect * n : n};
}

Scene scene(const Experiment& experiment) {
    const bool bar = is_bar(experiment.kind);
    const std::array<int, 3> cells = mesh(experiment);
    Scene scene;
    scene.body.cells = {cells[0], cells[1], cells[2]};
    scene.body.cell_size = (bar ? kBarWidth : kCubeEdge) / cells[0];
    scene.material.young_modulus = experiment.young_modulus;
    scene.material.poisson_ratio = experiment.poisson_ratio;
    scene.solver.method = SolverMethod::static_equilibrium;
    const std::size_t along = bar ? 2 : 1;
    scene.fixes = {{.where = FaceRegion{static_cast<int>(along), false}}};
    if (experiment.kind == Kind::beam) {
        scene.gravity.acceleration = {0, -kGravity, 0};
    } else {
        scene.moves = {plate_motion(experiment)};
    }
    scene.probes = {{"plate", FaceRegion{static_cast<int>(along), true}}};
    return scene;
}

std::size_t response_axis(Kind kind) {
    return kind == Kind::shear ? 0 : kind == Kind::tension ? 2 : 1;
}

std::vector<std::uint32_t> pictured_nodes(const Experiment& experiment) {
    const auto [nx, ny, nz] = mesh(experiment);
    const Kind kind = experiment.kind;
    std::vector<std::uint32_t> nodes;
    std::uint32_t number = 0;
    for (int k = 0; k <= nz; ++k) {
        for (int j = 0; j <= ny; ++j) {
            for (int i = 0; i <= nx; ++i, ++number) {
                const bool inside = kind == Kind::shear     ? 2 * k == nz && experiment.amount == 20
                                    : kind == Kind::torsion ? 2 * j == ny && experiment.amount == 45
                                                            : kind == Kind::beam && 2 * i == nx && 2 * j == ny;
                if (inside) {
                    nodes.push_back(number);
                }
            }
        }
    }
    return nodes;
}

std::vector<std::uint32_t> compared_cells(const Experiment& experiment) {
    std::vector<std::uint32_t> cells;
    if (experiment.kind != Kind::compression || experiment.amount > 5 || experiment.poisson_ratio != 0.25) {
        return cells;
    }
    const int n = mesh(experiment)[0];
    if (n != mesh({.kind = experiment.kind})[0]) {
        return cells;
    }
    for (int k = 1; 2 * k < n; ++k) {
        for (int j = 1; 2 * j < n; ++j) {
            for (int i = 1; 2 * i < n; ++i) {
                cells.push_back(static_cast<std::uint32_t>((k * n + j) * n + i));
            }
        }
    }
    return cells;
}

double shear_coefficient(double poisson_ratio) {
    return 10 * (1 + poisson_ratio) / (12 + 11 * poisson_ratio);
}

double timoshenko_eigenvalue(const Material& material, double width, double wave_number) {
    const double q = wave_number, r2 = width * width / 12, e = material.young_modulus,
                 g = shear_coefficient(material.poisson_ratio) * shear_modulus(material);
    const double a = material.density * r2 / g, b = 1 + q * q * r2 * (1 + e / g),
                 c = e * r2 / material.density * std::pow(q, 4);
    return 2 * c / (b + std::sqrt(b * b - 4 * a * c));
}

BeamTheory beam_theory(const Experiment& beam) {
    const Scene s = scene(beam);
    const double width = static_cast<double>(s.body.cells[0]) * s.body.cell_size;
    const double length = static_cast<double>(s.body.cells[2]) * s.body.cell_size;
    const double load = s.material.density * std::abs(s.gravity.acceleration[1]); // N/m^3
    // A / I = 12 / width^2
    return {load * 12 / (width * width) * std::pow(length, 4) / (8 * s.material.young_modulus),
            load * length * length / (2 * shear_coefficient(s.material.poisson_ratio) * shear_modulus(s.material))};
}

} // namespace hybmss::paper
