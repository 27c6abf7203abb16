/// What float must not lose: small strains, places far from the origin, large rotations.

#include "studies/stability/body_motion.hpp"
#include "studies/stability/hard_case.hpp"

#include "hybmss/force_plan.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hybmss::stability {
namespace {

Lattice cube() {
    return Lattice::box(4, 4, 4, kCellSize);
}

/// What is left of the vectors when they are stored as T.
template <class T>
Vectors stored(Vectors vectors) {
    for (Vector3d& v : vectors) {
        v = v.cast<T>().template cast<double>();
    }
    return vectors;
}

double greatest_difference(const Vectors& a, const Vectors& b) {
    double greatest = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        const double distance = (a[n] - b[n]).norm();
        greatest = std::isnan(distance) || distance > greatest ? distance : greatest;
    }
    return greatest;
}

/// Forces of float at a strain of 1e-7, against the reference at the very same displacements. In position form nothing
/// would be left: a strain of 1e-7 is one rounding of a float position.
Outcome small_strain(const Material& material) {
    BodyMotion<float> motion(cube(), material);
    Vectors u = random_vectors(motion.node_count(), 1e-7 * kCellSize, 31);
    for (std::size_t n = 0; n < u.size(); ++n) {
        u[n] += 1e-7 * Vector3d(1, -0.3, 0.2).cwiseProduct(motion.rest()[n]);
    }
    u = stored<float>(u);
    motion.set_displacements(u);
    const reference::Body body = reference::assemble(cube(), material);
    const Vectors expected = reference::forces(body, u);
    const double error = greatest_difference(motion.forces(), expected) / greatest_length(expected);
    const double energy = reference::energy(body, u).total();
    const double energy_error = std::abs(motion.elastic_energy() - energy) / energy;
    require(error < 2e-6, fmt::format("forces are off by {:.1e}", error));
    require(energy_error < 2e-6, fmt::format("the energy is off by {:.1e}", energy_error));
    Outcome outcome = right(fmt::format("forces right to {:.1e}, energy to {:.1e}", error, energy_error));
    outcome.min_cell_volume_ratio = motion.volume_change().min_cell_volume_ratio;
    return outcome;
}

/// A vibration of that size in float follows the one in double.
Outcome small_vibration(SpringForm springs) {
    BodyMotion<float> motion(cube(), case_material(springs, 0.4));
    BodyMotion<double> precise(cube(), case_material(springs, 0.4));
    const Vectors u = stored<float>(random_vectors(motion.node_count(), 1e-7 * kCellSize, 32));
    motion.set_displacements(u);
    precise.set_displacements(u);
    StepParameters parameters;
    parameters.time_step = 0.5 * motion.critical_time_step();
    constexpr long kSteps = 10'000;
    motion.step(parameters, kSteps);
    precise.step(parameters, kSteps);
    const double error = greatest_difference(motion.displacements(), precise.displacements()) / greatest_length(u);
    require(error < 1e-2, fmt::format("off by {:.1e} of the amplitude", error));
    Outcome outcome = right(fmt::format("off by {:.1e} of the amplitude from double", error));
    outcome.iterations = kSteps;
    return outcome;
}

/// The same body with its rest positions shifted: displacements stay small numbers, so float loses nothing.
Outcome far_from_origin(SpringForm springs) {
    const Network near = Network::from_lattice(cube(), case_material(springs, 0.4));
    Network far = near;
    for (auto& x : far.rest_positions) {
        x[0] += 1e6;
        x[1] -= 1e6;
        x[2] += 1e6;
    }
    BodyMotion<float> here(near, kCellSize), there(far, kCellSize);
    const Vectors u = random_vectors(here.node_count(), 0.05 * kCellSize, 33);
    here.set_displacements(u);
    there.set_displacements(u);
    const double error = greatest_difference(here.forces(), there.forces()) / greatest_length(here.forces());
    StepParameters parameters;
    parameters.time_step = 0.5 * here.critical_time_step();
    constexpr long kSteps = 1000;
    here.step(parameters, kSteps);
    there.step(parameters, kSteps);
    const double drifted = greatest_difference(here.displacements(), there.displacements()) / greatest_length(u);
    // The cells' rest edges come from the shifted positions: 1e6 rounded to 1e-10 m, 2e-10 of an edge, below float.
    require(error < 1e-6, fmt::format("forces differ by {:.1e}", error));
    require(drifted < 1e-3, fmt::format("motions differ by {:.1e}", drifted));
    Outcome outcome = right(
        fmt::format("forces as at the origin to {:.0e}, after {} steps the motion to {:.0e}", error, kSteps, drifted));
    outcome.iterations = kSteps;
    return outcome;
}

/// A body that was carried away instead: u holds the whole way, and its neighbours' difference the strain.
Outcome carried_away(SpringForm springs) {
    BodyMotion<double> motion(cube(), case_material(springs, 0.4));
    const Vectors strain = random_vectors(motion.node_count(), 0.05 * kCellSize, 34);
    motion.set_displacements(strain);
    const Vectors expected = motion.forces();
    Vectors carried = strain;
    for (Vector3d& u : carried) {
        u += Vector3d(1e6, -1e6, 1e6);
    }
    motion.set_displacements(carried);
    const double error = greatest_difference(motion.forces(), expected) / greatest_length(expected);
    // Rounding of 1e6 m in double, 1e-10 m, against displacements of 0.025 m.
    require(error < 1e-7, fmt::format("forces differ by {:.1e}", error));
    return right(
        fmt::format("forces as at rest's place to {:.0e}: what double keeps of 0.05 cells beside 1e6 m", error));
}

/// Turned by 180 degrees: no force; strained and turned: the turned forces.
template <class T>
Outcome turned(SpringForm springs) {
    const Material material = case_material(springs, 0.4);
    BodyMotion<T> motion(cube(), material);
    const Vector3d axis(1, 2, -2);
    motion.set_displacements(rotation(motion.rest(), axis, std::numbers::pi));
    // Displacements of twice the body's size are rounded: 2 x 2.8 m x epsilon against springs of 0.5 m and more.
    const double epsilon = sizeof(T) == sizeof(float) ? 6e-8 : 1.1e-16;
    const double force_scale = material.young_modulus * kCellSize * kCellSize, tolerance = 100 * epsilon;
    const double residual = greatest_length(motion.forces()) / force_scale;
    require(residual < tolerance, fmt::format("forces of {:.1e} E h^2 in a turned body", residual));

    const Vectors strain = random_vectors(motion.node_count(), 0.05 * kCellSize, 35);
    motion.set_displacements(strain);
    Vectors expected = motion.forces(), positions = motion.rest();
    const Vectors turned_forces = rotation(expected, axis, std::numbers::pi);
    for (std::size_t n = 0; n < positions.size(); ++n) {
        expected[n] += turned_forces[n];
        positions[n] += strain[n];
    }
    Vectors u = rotation(positions, axis, std::numbers::pi);
    for (std::size_t n = 0; n < u.size(); ++n) {
        u[n] += strain[n];
    }
    motion.set_displacements(u);
    const double error = greatest_difference(motion.forces(), expected) / force_scale;
    require(error < tolerance, fmt::format("a strained, turned body's forces are off by {:.1e} E h^2", error));
    Outcome outcome = right(fmt::format("no force; strained, its forces turn with it to {:.0e} E h^2", error));
    outcome.residual = residual;
    outcome.min_cell_volume_ratio = motion.volume_change().min_cell_volume_ratio;
    return outcome;
}

} // namespace

void append_precision_cases(std::vector<HardCase>& cases, SpringForm springs) {
    for (const double nu : {0.0, 0.25, 0.4, 0.4999}) {
        cases.push_back({fmt::format("precision: strain 1e-7 in float, nu = {:g}", nu),
                         "forces and energy right to 2e-6", Wanted::answer, true,
                         [=] { return small_strain(case_material(springs, nu)); }});
    }
    cases.push_back({"precision: vibration of strain 1e-7 in float", "follows double to a hundredth of the amplitude",
                     Wanted::answer, true, [=] { return small_vibration(springs); }});
    cases.push_back({"precision: rest positions 1e6 m from the origin, float", "forces as at the origin",
                     Wanted::answer, true, [=] { return far_from_origin(springs); }});
    cases.push_back({"precision: displaced by 1e6 m, double", "forces as at the origin to 1e-7", Wanted::answer, true,
                     [=] { return carried_away(springs); }});
    cases.push_back({"precision: turned by 180 degrees, double", "no force, no energy", Wanted::answer, true,
                     [=] { return turned<double>(springs); }});
    cases.push_back({"precision: turned by 180 degrees, float", "no force, no energy", Wanted::answer, true,
                     [=] { return turned<float>(springs); }});
}

} // namespace hybmss::stability
