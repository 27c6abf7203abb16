#include "hybmss/simulation/solve_to_accuracy.hpp"

#include "layouts/messages.hpp"
#include "simulation/accuracy/mesh_convergence.hpp"
#include "simulation/run/memory.hpp"
#include "simulation/scene/other_cells.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

namespace hybmss {
namespace {

constexpr std::int64_t kCoarsest = 4;                      ///< cells across of the first mesh
constexpr double kGreatestGrowth = 4, kLeastGrowth = 1.25; ///< of the cells across, from mesh to mesh
/// Part of the wish that the mesh is chosen for; estimates err.
constexpr double kMeshShare = 0.7;
constexpr double kFloatIsEnough = 1e-3;
constexpr int kMostMeshes = 8;
/// Up to so many cells a mesh is solved to tell what the wish takes: less than a second.
constexpr double kCheap = 3e4;

/// What a node may be left unbalanced by: far less than the wish, for many of them add up, and forces of a hundredth of
/// the problem's are to be told too; in float not less than rounding allows.
double tolerance_for(double accuracy, Precision precision) {
    const bool single = precision == Precision::float32;
    return std::clamp(kLeastShare * accuracy, single ? 1e-4 : 1e-10, single ? 1e-3 : 1e-5);
}

/// The fastest level whose errors are small against what a node may be left unbalanced by.
Accuracy kernel_for(double tolerance, Precision precision) {
    return force_error_bound(Accuracy::fast, precision) <= 0.1 * tolerance ? Accuracy::fast : Accuracy::accurate;
}

void check(const Scene& scene) {
    require_cubes(scene, "solver.accuracy");
    if (!scene.solver.accuracy || scene.solver.method != SolverMethod::static_equilibrium) {
        throw scene_error(scene, "solver.accuracy", "it must be given, with method = \"static\"");
    }
    const std::function<bool(const Region&)> names_node = [&](const Region& where) {
        const auto* difference = std::get_if<RegionWithout>(&where);
        return std::holds_alternative<NodeRegion>(where) ||
               (difference && (std::any_of(difference->of.begin(), difference->of.end(), names_node) ||
                               std::any_of(difference->without.begin(), difference->without.end(), names_node)));
    };
    const auto refuse_node = [&](const Region& where, const std::string& path) {
        if (names_node(where)) {
            throw scene_error(scene, path,
                              "with solver.accuracy, which solves on several meshes, no single node can be named");
        }
    };
    const auto refuse_nodes = [&](const auto& items, const std::string& table) {
        for (std::size_t i = 0; i < items.size(); ++i) {
            refuse_node(items[i].where, table + "[" + std::to_string(i) + "].where");
        }
    };
    refuse_nodes(scene.fixes, "fix");
    refuse_nodes(scene.moves, "move");
    refuse_nodes(scene.loads, "load");
    refuse_nodes(scene.pressures, "pressure");
    refuse_nodes(scene.probes, "probe");
}

/// The wish at work: meshes solved so far, coarse to fine.
class MeshRefinement {
public:
    MeshRefinement(const Scene& scene, const AccuracyOptions& options)
        : scene_(scene), options_(options), family_(scene),
          // A rough guess until three meshes show the order.
          assumed_order_(2 * clamped_edge_exponent(scene.material.poisson_ratio)) {
        report_.wanted = *scene.solver.accuracy;
        report_.free_mesh = family_.is_free();
        report_.precision = precision(report_.wanted);
        choose_solver();
    }

    const MeshFamily& family() const { return family_; }
    const AccuracyReport& report() const { return report_; }
    Simulation& simulation() { return *simulation_; }
    Summary& summary() { return summary_; }
    const ErrorEstimate& estimate() const { return estimate_; }

    /// Solves on a finer mesh than the last. Returns false where there is no equilibrium.
    bool solve(std::int64_t multiple) {
        if (!run(multiple) && report_.precision == Precision::float32 && options_.choose_precision) {
            // Rounding may be what kept it from its tolerance.
            report_.precision = Precision::float64;
            choose_solver();
            run(multiple);
        }
        if (!summary_.failure.empty()) {
            return false;
        }
        solved_.push_back({static_cast<double>(multiple), result_figures(*simulation_, summary_)});
        multiples_.push_back(multiple);
        if (solved_.size() > 1) {
            estimate_ = estimate_error(solved_, assumed_order_, kMeshShare * report_.wanted, report_.tolerance);
            report_.error_estimate = estimate_.error + report_.tolerance;
            report_.quantity = estimate_.name;
            report_.order = estimate_.order;
            report_.meshes.back().error_estimate = report_.error_estimate;
        }
        return true;
    }

    /// Of the mesh before the last: what the two differ by and what the last still lacks.
    void estimate_coarser() {
        std::string name;
        const double change = greatest_difference(solved_[solved_.size() - 2].figures, solved_.back().figures, &name);
        report_.error_estimate += change;
        report_.quantity = name;
    }

    /// The multiple that would do for an accuracy, by the estimate.
    double multiple_for(double accuracy) const {
        const double last = solved_.back().cells;
        if (!(estimate_.error > 0)) {
            return last;
        }
        // estimate_.cells is for the wish; errors of other wishes scale with the order of the worst quantity.
        return std::max(1.0,
                        std::ceil(estimate_.cells * std::pow(report_.wanted / accuracy, 1 / estimate_.order) - 1e-9));
    }

    AccuracyOffer offer(double accuracy) const {
        AccuracyOffer offer;
        offer.accuracy = accuracy;
        offer.precision = precision(accuracy);
        offer.tolerance = tolerance(accuracy, offer.precision);
        offer.kernel = kernel(offer.tolerance, offer.precision);
        const double multiple = std::min(multiple_for(accuracy), 1e8);
        const auto whole = static_cast<std::int64_t>(multiple);
        offer.cells = family_.cells(whole);
        offer.cell_size = family_.cell_size(whole);
        const auto [nodes, bytes] = room_of(offer.cells, offer.precision);
        offer.bytes = bytes;
        offer.fits = nodes <= Lattice::kMostNodes && bytes <= available_bytes();
        // A digit in double takes about as long as two in float.
        offer.seconds = expected_seconds(multiple) * (offer.precision == report_.precision    ? 1
                                                      : offer.precision == Precision::float64 ? 2
                                                                                              : 0.5);
        return offer;
    }

    void make_offers() {
        for (const double factor : {10.0, 1.0, 0.1, 0.01}) {
            if (const double accuracy = factor * report_.wanted; accuracy <= 0.1) {
                report_.offers.push_back(offer(accuracy));
            }
        }
    }

    /// Throws where the mesh for the wish does not fit.
    void require_room(std::int64_t multiple) const {
        const std::array<std::int64_t, 3> cells = family_.cells(multiple);
        const auto [nodes, bytes] = room_of(cells, report_.precision);
        const double available = available_bytes();
        if (bytes > available || nodes > Lattice::kMostNodes) {
            // estimate_.error is that of the last mesh; the finest that fits has some 1/3 power of the room more.
            const double room = std::cbrt(std::min(available / bytes, Lattice::kMostNodes / nodes)) *
                                static_cast<double>(multiple) / static_cast<double>(multiples_.back());
            throw scene_error(scene_, "solver.accuracy",
                              printed("it needs about %lld x %lld x %lld cells for the %s (%.3g GB; %.3g GB are "
                                      "free); about %.2g or more can be had here",
                                      static_cast<long long>(cells[0]), static_cast<long long>(cells[1]),
                                      static_cast<long long>(cells[2]), estimate_.finest.c_str(), bytes / 1e9,
                                      available / 1e9, estimate_.error / std::pow(room, estimate_.order) / kMeshShare));
        }
    }

    Scene scene_on(std::int64_t multiple) const {
        Scene scene = scene_;
        scene.body = family_.body(multiple);
        scene.solver.tolerance = report_.tolerance;
        return scene;
    }

    void keep_first() {
        first_simulation_ = std::move(simulation_);
        first_summary_ = summary_;
    }
    bool has_first() const { return first_simulation_ != nullptr; }
    void take_first() {
        simulation_ = std::move(first_simulation_);
        summary_ = first_summary_;
    }

private:
    Precision precision(double accuracy) const {
        return !options_.choose_precision   ? options_.simulation.precision
               : accuracy >= kFloatIsEnough ? Precision::float32
                                            : Precision::float64;
    }
    double tolerance(double accuracy, Precision type) const {
        return scene_.solver.tolerance.value_or(tolerance_for(accuracy, type));
    }

    /// Nodes and bytes that a mesh takes.
    std::pair<double, double> room_of(const std::array<std::int64_t, 3>& cells, Precision type) const {
        SceneBody body = scene_.body;
        body.labels.clear();
        body.cells = cells;
        SimulationOptions options = options_.simulation;
        options.precision = type;
        double nodes = 1;
        for (const std::int64_t n : cells) {
            nodes *= static_cast<double>(n) + 1;
        }
        return {nodes, estimated_bytes(body, options)};
    }
    /// `exact`, which is asked for its bits, stays.
    Accuracy kernel(double tolerance, Precision type) const {
        return options_.simulation.plan.accuracy == Accuracy::exact ? Accuracy::exact : kernel_for(tolerance, type);
    }
    /// What follows from the wish and the type.
    void choose_solver() {
        report_.tolerance = tolerance(report_.wanted, report_.precision);
        report_.kernel = kernel(report_.tolerance, report_.precision);
    }

    /// By the last mesh. Iterations grow slowly with the mesh, or not at all.
    double expected_seconds(double multiple) const {
        constexpr double kGrowth = 3.3;
        return report_.meshes.back().seconds * std::pow(multiple / static_cast<double>(multiples_.back()), kGrowth);
    }

    bool run(std::int64_t multiple) {
        AccuracyMesh mesh{family_.cells(multiple), family_.cell_size(multiple)};
        if (!report_.meshes.empty()) {
            mesh.seconds = expected_seconds(static_cast<double>(multiple));
        }
        if (options_.before_solve) {
            options_.before_solve(mesh);
        }
        SimulationOptions options = options_.simulation;
        options.precision = report_.precision;
        options.plan.accuracy = report_.kernel;
        simulation_ = std::make_unique<Simulation>(scene_on(multiple), options);
        RunCallbacks callbacks;
        if (options_.progress) {
            callbacks.progress = [&](const Progress& progress) { options_.progress(mesh, progress); };
        }
        summary_ = simulation_->run(callbacks);
        mesh.seconds = summary_.wall_seconds;
        if (summary_.failure.empty()) {
            report_.meshes.push_back(mesh);
        }
        return summary_.failure.empty();
    }

    const Scene& scene_;
    const AccuracyOptions& options_;
    MeshFamily family_;
    double assumed_order_;
    AccuracyReport report_;
    std::vector<MeshFigures> solved_;
    std::vector<std::int64_t> multiples_;
    ErrorEstimate estimate_;
    std::unique_ptr<Simulation> simulation_, first_simulation_;
    Summary summary_, first_summary_;
};

AccurateSolution finished(MeshRefinement& refinement) {
    Summary summary = refinement.summary();
    if (summary.failure.empty()) {
        refinement.make_offers();
    }
    const AccuracyReport& report = refinement.report();
    summary.accuracy = report;
    if (summary.failure.empty() && !report.reached()) {
        const std::string text = printed("the estimated error, %.2g (%s), is above the accuracy wanted, %.2g",
                                         report.error_estimate, report.quantity.c_str(), report.wanted);
        if (report.free_mesh) {
            summary.failure = text;
            summary.converged = false;
        } else {
            summary.warnings.push_back(text + ": the mesh is too coarse for it");
        }
    }
    return {std::move(refinement.simulation()), std::move(summary)};
}

/// Meshes of a free one, coarse to fine, until the error is as wished; none of more than `most_cells`. Returns the
/// multiple of the last, or, where that is not it, of the one that should do. Failures stand in the summary.
std::int64_t solve_free(MeshRefinement& refinement, double most_cells = HUGE_VAL) {
    const MeshFamily& family = refinement.family();
    const AccuracyReport& report = refinement.report();
    std::int64_t last = family.multiple_of(kCoarsest);
    if (!refinement.solve(last) || !refinement.solve(2 * last)) {
        return last;
    }
    last *= 2;
    const auto sure = [&](int meshes) {
        // Two meshes show no order: theirs is assumed, and the estimate errs by more.
        return meshes > 2 ? report.reached() : report.error_estimate <= kMeshShare * report.wanted;
    };
    for (int meshes = 2; meshes < kMostMeshes && !sure(meshes); ++meshes) {
        const double wanted = refinement.multiple_for(report.wanted), now = static_cast<double>(last);
        // What is far too much is better known now than after an hour.
        const auto whole = static_cast<std::int64_t>(std::min(wanted, 1e7));
        refinement.require_room(whole);
        const auto next = static_cast<std::int64_t>(
            std::clamp(wanted, std::ceil(kLeastGrowth * now), std::floor(kGreatestGrowth * now)));
        refinement.require_room(next);
        const auto [nx, ny, nz] = family.cells(next);
        if (static_cast<double>(nx) * static_cast<double>(ny) * static_cast<double>(nz) > most_cells) {
            return std::max(whole, next);
        }
        if (!refinement.solve(next)) {
            break;
        }
        last = next;
    }
    return last;
}

/// On the scene's own mesh, with the error told by half as many cells, or, where they cannot be halved, by twice as
/// many: the first solution is then the one that was asked for, and kept. False where there is no equilibrium.
bool solve_given(MeshRefinement& refinement) {
    const std::int64_t own = refinement.family().own_multiple();
    if (own > 1) {
        return refinement.solve((own + 1) / 2) && refinement.solve(own);
    }
    if (!refinement.solve(own)) {
        return false;
    }
    refinement.keep_first();
    if (!refinement.solve(2 * own)) {
        return false;
    }
    refinement.estimate_coarser();
    return true;
}

} // namespace

AccurateSolution solve_to_accuracy(const Scene& scene, const AccuracyOptions& options) {
    check(scene);
    MeshRefinement refinement(scene, options);
    if (refinement.family().is_free()) {
        solve_free(refinement);
        return finished(refinement);
    }
    solve_given(refinement);
    const std::string failure = refinement.summary().failure;
    AccurateSolution solution = finished(refinement);
    if (!refinement.has_first()) {
        return solution;
    }
    refinement.take_first();
    Summary summary = refinement.summary();
    summary.accuracy = solution.summary.accuracy;
    summary.warnings = solution.summary.warnings;
    if (!failure.empty()) {
        summary.warnings.push_back("no error can be told: on a finer mesh there is " + failure);
        summary.accuracy.reset();
    }
    return {std::move(refinement.simulation()), std::move(summary)};
}

AccuracyReport accuracy_offers(const Scene& scene, const AccuracyOptions& options, Scene* chosen) {
    check(scene);
    MeshRefinement refinement(scene, options);
    const bool free = refinement.family().is_free();
    std::int64_t multiple = refinement.family().own_multiple();
    if (free) {
        multiple = solve_free(refinement, kCheap);
    } else {
        solve_given(refinement);
    }
    if (const std::string& failure = refinement.summary().failure; !failure.empty()) {
        throw std::runtime_error(failure);
    }
    refinement.make_offers();
    if (chosen != nullptr) {
        *chosen = refinement.scene_on(multiple);
    }
    return refinement.report();
}

} // namespace hybmss
