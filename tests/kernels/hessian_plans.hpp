#pragma once

/// \file
/// Products and diagonals of plans in double, for tests.

#include "hybmss/force_plan.hpp"
#include "plan/bodies/layout_table.hpp"
#include "tests/random_bodies.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace hybmss::testing {

template <class T>
inline constexpr double kEpsilon = static_cast<double>(std::numeric_limits<T>::epsilon());

/// x y z a node.
template <class T>
std::vector<T> interleaved(std::span<const Vector3d> vectors) {
    std::vector<T> values;
    for (const Vector3d& v : vectors) {
        for (int c = 0; c < 3; ++c) {
            values.push_back(static_cast<T>(v[c]));
        }
    }
    return values;
}

template <class T>
std::vector<Vector3d> vectors(const std::vector<T>& values) {
    std::vector<Vector3d> result;
    for (std::size_t i = 0; i < values.size(); i += 3) {
        result.emplace_back(static_cast<double>(values[i]), static_cast<double>(values[i + 1]),
                            static_cast<double>(values[i + 2]));
    }
    return result;
}

/// The vectors as T holds them.
template <class T>
std::vector<Vector3d> as_held(std::span<const Vector3d> given) {
    return vectors(interleaved<T>(given));
}

template <class T>
std::vector<Vector3d> product(const ForcePlan<T>& plan, std::span<const Vector3d> u, std::span<const Vector3d> p) {
    const std::vector<T> at = interleaved<T>(u), along = interleaved<T>(p);
    std::vector<T> out(at.size(), T(0));
    plan.add_hessian_product(VectorField<const T>::aos(at.data(), u.size()),
                             VectorField<const T>::aos(along.data(), p.size()),
                             VectorField<T>::aos(out.data(), u.size()));
    return vectors(out);
}

/// One symmetric matrix a node.
template <class T>
std::vector<Matrix3d> diagonal(const ForcePlan<T>& plan, std::span<const Vector3d> u) {
    const std::vector<T> at = interleaved<T>(u);
    std::vector<T> out(6 * u.size());
    plan.hessian_diagonal(VectorField<const T>::aos(at.data(), u.size()), out);
    std::vector<Matrix3d> blocks;
    for (std::size_t i = 0; i < out.size(); i += 6) {
        const auto e = [&](std::size_t entry) { return static_cast<double>(out[i + entry]); };
        Matrix3d block;
        block << e(0), e(3), e(4), e(3), e(1), e(5), e(4), e(5), e(2);
        blocks.push_back(block);
    }
    return blocks;
}

/// Calls check(plan, label) for every layout that the material can have, instruction set and accuracy of a lattice.
template <class T, class Check>
void for_every_plan(const Lattice& lattice, const Material& material, const Check& check) {
    const std::vector<std::string> networks = network_layouts();
    for (const std::string& layout : distinct_lattice_layouts()) {
        if (!can_be_network(lattice, material) &&
            std::find(networks.begin(), networks.end(), layout) != networks.end()) {
            continue;
        }
        for (InstructionSet set : available_instruction_sets()) {
            for (Accuracy accuracy : {Accuracy::accurate, Accuracy::exact}) {
                PlanOptions options;
                options.layout = layout;
                options.instruction_set = set;
                options.accuracy = accuracy;
                const ForcePlan<T> plan(lattice, material, options);
                std::string label = layout;
                label.append(" ").append(name(set)).append(" ").append(name(accuracy));
                check(plan, label);
            }
        }
    }
}

inline double largest(const std::vector<double>& values) {
    double most = 0;
    for (double v : values) {
        most = v > most ? v : most;
    }
    return most;
}

/// The largest component of a - b; NaN where any is.
inline double largest_difference(std::span<const Vector3d> a, std::span<const Vector3d> b) {
    double most = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        const double d = (a[n] - b[n]).cwiseAbs().maxCoeff();
        most = d <= most ? most : d;
    }
    return most;
}

} // namespace hybmss::testing
