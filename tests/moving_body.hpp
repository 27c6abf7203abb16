#pragma once

/// \file
/// Bodies with a random state, and the bits of what became of it.

#include "hybmss/explicit_dynamics.hpp"
#include "plan/tuning/digest.hpp"

#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace hybmss::testing {

/// Random displacements with components in +- strain * h, interleaved.
template <class T>
std::vector<T> random_field(std::size_t nodes, double bound, unsigned seed) {
    // Drawn from the engine's own bits: the standard's distributions differ between libraries.
    std::mt19937 engine(seed);
    std::vector<T> field(3 * nodes);
    for (T& value : field) {
        value = static_cast<T>(bound * (static_cast<double>(engine()) / 2147483648.0 - 1));
    }
    return field;
}

/// A digest of the bytes: one number for a whole state, or for several one after the other.
template <class T>
std::uint64_t bits_of(const std::vector<T>& values, Digest digest = {}) {
    digest.add(std::span<const T>(values));
    return digest.value();
}

/// The bits of displacements, velocities and forces after the steps.
template <class T>
std::uint64_t bits_after(ExplicitDynamics<T>& body, double cell_size, const StepParameters& parameters, long steps) {
    const std::size_t n = body.node_count();
    const std::vector<T> start = random_field<T>(n, 0.05 * cell_size, 7);
    body.set_displacements(VectorField<const T>::aos(start.data(), n));
    body.step(parameters, steps);
    std::vector<T> out(3 * n);
    body.get_displacements(VectorField<T>::aos(out.data(), n));
    std::uint64_t hash = bits_of(out);
    body.get_velocities(VectorField<T>::aos(out.data(), n));
    hash = bits_of(out, Digest(hash));
    body.get_forces(VectorField<T>::aos(out.data(), n));
    return bits_of(out, Digest(hash));
}

} // namespace hybmss::testing
