#include "studies/price/price_tables.hpp"

#include "simulation/accuracy/mesh_convergence.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hybmss::price {
namespace {

using Vector3 = std::array<double, 3>;

/// Between clamped plates, or clamped at one end.
struct Shape {
    Vector3 size;
    int along; ///< axis from the fixed face to the other
};
constexpr Shape kCube = {{5, 5, 5}, 1}, kBar = {{0.4, 0.4, 1.2}, 2}, kBlock = {{1, 0.5, 1.5}, 0};

Scene base(const Shape& shape, double poisson_ratio, double face_diagonal_ratio = 1) {
    Scene scene;
    scene.body.size = shape.size;
    scene.body.cell_size = 0;
    scene.material = {.young_modulus = 1e4, .poisson_ratio = poisson_ratio};
    scene.material.face_diagonal_ratio = face_diagonal_ratio;
    scene.solver.method = SolverMethod::static_equilibrium;
    scene.fixes = {{.where = FaceRegion{shape.along, false}}};
    scene.probes = {{"end", FaceRegion{shape.along, true}}};
    return scene;
}

Scene moved(const Shape& shape, double nu, const Vector3& by, double A = 1) {
    Scene scene = base(shape, nu, A);
    scene.moves = {{.where = FaceRegion{shape.along, true}, .motion = by}};
    return scene;
}

Scene turned(const Shape& shape, double nu, double degrees) {
    Scene scene = base(shape, nu);
    scene.moves = {{.where = FaceRegion{shape.along, true}, .motion = Rotation{shape.along, degrees}}};
    return scene;
}

Scene loaded(const Shape& shape, double nu, const Vector3& force) {
    Scene scene = base(shape, nu);
    scene.loads = {{FaceRegion{shape.along, true}, force}};
    return scene;
}

Scene hanging(const Shape& shape, double nu, const Vector3& acceleration) {
    Scene scene = base(shape, nu);
    scene.gravity.acceleration = acceleration;
    return scene;
}

} // namespace

std::vector<WishCase> wish_cases() {
    return {
        {"compression 5 %, nu = 0.25", moved(kCube, 0.25, {0, -0.25, 0}), 24},
        {"compression 1 %, nu = 0.45", moved(kCube, 0.45, {0, -0.05, 0}), 24},
        {"compression 10 %, nu = 0", moved(kCube, 0, {0, -0.5, 0}), 24},
        {"compression 1 %, nu = 0.3, A = 0", moved(kCube, 0.3, {0, -0.05, 0}, 0), 24},
        {"shear 5 %, nu = 0.3", moved(kCube, 0.3, {0.25, 0, 0}), 24},
        {"torsion 20 degrees, nu = 0.3", turned(kCube, 0.3, 20), 24},
        {"tension 20 % of a bar, nu = 0.4", moved(kBar, 0.4, {0, 0, 0.24}), 16},
        {"torsion 90 degrees of a bar, nu = 0.2", turned(kBar, 0.2, 90), 16},
        {"bar bent by its end, nu = 0.3", moved(kBar, 0.3, {0, -0.1, 0}), 16},
        {"bar bent by a load, nu = 0.35", loaded(kBar, 0.35, {0, -0.4, 0}), 16},
        {"block pulled by a load, nu = 0.1", loaded(kBlock, 0.1, {400, 0, 0}), 16},
        {"block hanging by its weight, nu = 0.4", hanging(kBlock, 0.4, {0.5, 0, 0}), 16},
    };
}

std::vector<ResultFigure> limit_figures(const Scene& scene, int across) {
    const MeshFamily family(scene);
    const double assumed = 2 * clamped_edge_exponent(scene.material.poisson_ratio);
    std::vector<std::vector<ResultFigure>> figures;
    for (const int part : {4, 2, 1}) {
        Scene on_mesh = scene;
        on_mesh.body = family.body(family.multiple_of(across) / part);
        on_mesh.solver.accuracy.reset();
        Simulation simulation(on_mesh);
        const Summary summary = simulation.run();
        if (!summary.failure.empty()) {
            throw std::runtime_error(summary.failure);
        }
        figures.push_back(result_figures(simulation, summary));
    }
    std::vector<ResultFigure> limit = figures[2];
    for (std::size_t f = 0; f < limit.size(); ++f) {
        double before = 0, last = 0;
        for (std::size_t i = 0; i < limit[f].values.size(); ++i) {
            before += std::pow(figures[1][f].values[i] - figures[0][f].values[i], 2);
            last += std::pow(figures[2][f].values[i] - figures[1][f].values[i], 2);
        }
        const double observed = 0.5 * std::log2(before / last),
                     order = observed > 0.7 && observed < 2.5 ? observed : assumed;
        for (std::size_t i = 0; i < limit[f].values.size(); ++i) {
            limit[f].values[i] += (figures[2][f].values[i] - figures[1][f].values[i]) / (std::exp2(order) - 1);
        }
    }
    return limit;
}

WishResult solve_wish(const WishCase& wish, double accuracy, const std::vector<ResultFigure>& limit) {
    Scene scene = wish.scene;
    scene.solver.accuracy = accuracy;
    AccuracyOptions options;
    options.simulation.plan.threads = 1;
    WishResult result;
    result.name = wish.name;
    result.wanted = accuracy;
    try {
        const AccurateSolution solution = solve_to_accuracy(scene, options);
        result.failure = solution.summary.failure;
        if (solution.summary.accuracy && !solution.summary.accuracy->meshes.empty()) {
            const AccuracyReport& report = *solution.summary.accuracy;
            result.estimate = report.error_estimate;
            result.cells = report.meshes.back().cells;
            result.precision = report.precision;
            for (const AccuracyMesh& mesh : report.meshes) {
                result.seconds += mesh.seconds;
            }
        }
        result.error = greatest_difference(result_figures(solution.simulation, solution.summary), limit);
    } catch (const SceneError& error) {
        result.failure = error.what();
    }
    return result;
}

paper::Table wish_table(const std::vector<WishResult>& results) {
    paper::Table table{"accuracy",
                       "Whether `accuracy = X` is kept",
                       {"Scenes that leave their mesh free, each solved to the accuracy wanted; the true error is that "
                        "of the worst figure against the limit of fine meshes in double. Seconds of all meshes, one "
                        "thread."},
                       {{"scene", "scene"},
                        {"wanted", "wanted", -2},
                        {"cells", "cells"},
                        {"precision", "type"},
                        {"seconds", "s", -2},
                        {"estimate", "estimated error", -2},
                        {"error", "true error", -2},
                        {"kept", "kept"}},
                       {},
                       {}};
    int kept = 0;
    for (const WishResult& result : results) {
        const bool good = result.failure.empty() && result.error < result.wanted;
        kept += good;
        table.rows.push_back({result.name, result.wanted,
                              fmt::format("{} x {} x {}", result.cells[0], result.cells[1], result.cells[2]),
                              std::string(name(result.precision)), result.seconds, result.estimate, result.error,
                              good                     ? std::string("yes")
                              : result.failure.empty() ? std::string("no")
                                                       : "failed: " + result.failure});
    }
    table.remarks = {fmt::format("{} of {} kept.", kept, results.size())};
    return table;
}

} // namespace hybmss::price
