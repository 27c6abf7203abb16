/// Uneven and meagre bodies: contrasts of stiffness and mass, single cells, rods, parts that hang together by an edge
/// or a corner, no cells at all.

#include "studies/stability/body_motion.hpp"
#include "studies/stability/hard_case.hpp"

#include "hybmss/force_plan.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hybmss::stability {
namespace {

constexpr long kSamples = 200;
constexpr double kDrift =
    5e-3; // of the energy, while it spreads to faster waves, which semi-implicit Euler weighs otherwise

/// Vibration from random displacements by up to `bound`, undamped: energy and momenta must stay.
template <class T>
Outcome vibrate(BodyMotion<T>& motion, double bound, long steps, double tolerance) {
    motion.set_displacements(random_vectors(motion.node_count(), bound, 21));
    StepParameters parameters;
    parameters.time_step = 0.1 * motion.critical_time_step(); // the energy swings by the square of omega dt
    EnergyRecord record;
    const double start = motion.energy();
    for (long sample = 0; sample < kSamples; ++sample) {
        motion.step(parameters, steps / kSamples);
        record.add(motion.energy());
    }
    Vector3d momentum = Vector3d::Zero();
    double momentum_scale = 0;
    const Vectors v = motion.velocities();
    for (std::size_t n = 0; n < v.size(); ++n) {
        momentum += motion.masses()[n] * v[n];
        momentum_scale += motion.masses()[n] * v[n].norm();
    }
    const double drift = std::abs(record.drift()) / start, swing = record.swing() / start;
    require(drift < tolerance, fmt::format("the energy drifted by {:.1e} of itself", drift));
    require(swing < 0.5, fmt::format("the energy swung by {:.1e} of itself", swing));
    const double lost = momentum.norm() / momentum_scale;
    require(lost < (sizeof(T) == sizeof(float) ? 1e-2 : 1e-10), fmt::format("momentum {:.1e} out of nothing", lost));
    Outcome outcome = right(
        fmt::format("stable over {} steps; the energy swings by {:.1e}, momentum stays to {:.0e}", steps, swing, lost));
    outcome.energy_drift = drift;
    outcome.min_cell_volume_ratio = motion.volume_change().min_cell_volume_ratio;
    outcome.iterations = steps;
    return outcome;
}

/// Damped from random displacements by up to `bound`, small enough that no cell inverts: back to no energy at all.
Outcome relax(const Lattice& lattice, const Material& material, double bound) {
    // Without face diagonals some ways to move cost energy of the fourth order only: they settle like 1/time.
    const bool is_slow = material.face_diagonal_ratio == 0;
    const double rest = is_slow ? 1e-9 : 1e-18;
    BodyMotion<double> motion(lattice, material);
    motion.set_displacements(random_vectors(motion.node_count(), bound, 22));
    StepParameters parameters;
    parameters.time_step = 0.5 * motion.critical_time_step();
    parameters.mass_damping = 3;
    const double start = motion.elastic_energy();
    long steps = 0;
    while (std::abs(motion.energy()) > rest * start && steps < 400'000) {
        motion.step(parameters, 100);
        steps += 100;
        if (!(motion.elastic_energy() > -0.1 * start)) {
            require(is_slow && material.poisson_ratio < 0.25, "the energy falls below that of rest");
            Outcome outcome =
                error(fmt::format("diverged by step {}: the energy has fallen below that of rest", steps));
            outcome.iterations = steps;
            return outcome;
        }
    }
    const VolumeChange volume = motion.volume_change();
    require(motion.energy() <= rest * start,
            fmt::format("energy {:.1e} of the start's is left", motion.energy() / start));
    require(std::abs(volume.min_cell_volume_ratio - 1) < (is_slow ? 1e-3 : 1e-6), "a cell is not as large as at rest");
    Outcome outcome = right("back at rest, up to motions that strain nothing");
    outcome.min_cell_volume_ratio = volume.min_cell_volume_ratio;
    outcome.residual = greatest_length(motion.forces()) / (material.young_modulus * kCellSize * kCellSize);
    outcome.iterations = steps;
    return outcome;
}

Lattice cells_where(std::array<int, 3> n, bool (*filled)(int, int, int)) {
    Lattice lattice = Lattice::box(n[0], n[1], n[2], kCellSize);
    for (int k = 0; k < n[2]; ++k) {
        for (int j = 0; j < n[1]; ++j) {
            for (int i = 0; i < n[0]; ++i) {
                lattice.set_cell_scale(i, j, k, filled(i, j, k) ? 1.0f : 0.0f);
            }
        }
    }
    return lattice;
}

template <class T>
Outcome stiffness_contrast(SpringForm springs) {
    Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    for (int k = 0; k < 4; ++k) {
        for (int j = 0; j < 2; ++j) {
            for (int i = 0; i < 4; ++i) {
                lattice.set_cell_scale(i, j, k, 1e-6f);
            }
        }
    }
    BodyMotion<T> motion(lattice, case_material(springs, 0.4));
    return vibrate(motion, 0.05 * kCellSize, 40'000, kDrift);
}

template <class T>
Outcome mass_contrast(SpringForm springs) {
    Network network = Network::from_lattice(Lattice::box(4, 4, 4, kCellSize), case_material(springs, 0.4));
    for (std::size_t n = 0; n < network.masses.size(); n += 2) {
        network.masses[n] *= 1e6;
    }
    BodyMotion<T> motion(network, kCellSize);
    return vibrate(motion, 0.05 * kCellSize, 40'000, kDrift);
}

/// A body cut away to nothing: a plan of no nodes, whose forces and steps are nothing.
template <class T>
Outcome empty_lattice(SpringForm springs, bool as_network) {
    const Lattice empty = Lattice::from_cells(2, 2, 2, kCellSize, std::vector<float>(8, 0.0f));
    const Material material = case_material(springs, 0.4);
    const Network network = Network::from_lattice(empty, material);
    const ForcePlan<T> plan = as_network ? ForcePlan<T>(network) : ForcePlan<T>(empty, material);
    plan.add_forces({}, {});
    auto dynamics = as_network ? ExplicitDynamics<T>(network) : ExplicitDynamics<T>(empty, material);
    dynamics.step({1e-3, {0, -10, 0}, 1}, 100);
    require(plan.node_count() == 0 && dynamics.node_count() == 0, "it has nodes");
    require(plan.energy({}).total() == 0 && dynamics.potential_energy().total() == 0 && dynamics.kinetic_energy() == 0,
            "it has an energy");
    require(plan.critical_time_step() > 0, "its critical time step is not above zero");
    return right("no nodes, no energy, no forces; steps do nothing");
}

} // namespace

void append_shape_cases(std::vector<HardCase>& cases, SpringForm springs) {
    const std::string stays = "vibrates, energy and momentum stay";
    cases.push_back({"shape: stiffness contrast 1e6, double", stays, Wanted::answer, true,
                     [=] { return stiffness_contrast<double>(springs); }});
    cases.push_back({"shape: stiffness contrast 1e6, float", stays, Wanted::answer, true,
                     [=] { return stiffness_contrast<float>(springs); }});
    cases.push_back({"shape: mass contrast 1e6, double", stays, Wanted::answer, false,
                     [=] { return mass_contrast<double>(springs); }});
    cases.push_back({"shape: mass contrast 1e6, float", stays, Wanted::answer, false,
                     [=] { return mass_contrast<float>(springs); }});
    for (const double nu : {-0.5, 0.25, 0.49}) {
        for (const double ratio : {0.0, 1.0}) {
            // A cell without face diagonals can fold without straining a spring, and kappa < 0 rewards the volume lost:
            // not far from rest the energy is below that of rest.
            const Material material = case_material(springs, nu, ratio);
            const bool can_fold = ratio == 0 && nu < 0.25;
            cases.push_back({fmt::format("shape: single cell, nu = {:g}, A = {:g}", nu, ratio),
                             can_fold ? "settles at rest, or is found to diverge" : "settles at rest",
                             can_fold ? Wanted::answer_or_error : Wanted::answer, true,
                             [=] { return relax(Lattice::box(1, 1, 1, kCellSize), material, 0.1 * kCellSize); }});
        }
    }
    for (const double nu : {0.0, 0.4}) {
        cases.push_back(
            {fmt::format("shape: free rod of 1x1x50 cells, nu = {:g}", nu), stays, Wanted::answer, true, [=] {
                 BodyMotion<double> motion(Lattice::box(1, 1, 50, kCellSize), case_material(springs, nu));
                 return vibrate(motion, 0.05 * kCellSize, 20'000, kDrift);
             }});
    }
    struct Joint {
        const char* name;
        std::array<int, 3> cells;
        bool (*filled)(int, int, int);
    };
    for (const Joint& joint :
         {Joint{"two cells that share an edge", {2, 2, 1}, [](int i, int j, int) { return i == j; }},
          Joint{"two cells that share a corner", {2, 2, 2}, [](int i, int j, int k) { return i == j && j == k; }},
          Joint{"a checkerboard of 4x4x4", {4, 4, 4}, [](int i, int j, int k) { return (i + j + k) % 2 == 0; }},
          Joint{"two parts apart", {3, 1, 1}, [](int i, int, int) { return i != 1; }}}) {
        cases.push_back({fmt::format("shape: {}", joint.name), "settles unstrained; joints may have turned",
                         Wanted::answer, true, [=] {
                             return relax(cells_where(joint.cells, joint.filled), case_material(springs, 0.4),
                                          0.1 * kCellSize);
                         }});
    }
    for (const bool as_network : {false, true}) {
        const char* const as = as_network ? "network" : "lattice";
        cases.push_back({fmt::format("shape: empty {}, double", as), "is nothing, and does nothing", Wanted::answer,
                         true, [=] { return empty_lattice<double>(springs, as_network); }});
        cases.push_back({fmt::format("shape: empty {}, float", as), "is nothing, and does nothing", Wanted::answer,
                         true, [=] { return empty_lattice<float>(springs, as_network); }});
    }
}

} // namespace hybmss::stability
