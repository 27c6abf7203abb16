#pragma once

/// \file
/// The spring forces of a box in every form that one might compute them in: what each costs, and how many digits it
/// keeps. Measured by digit_benchmark.cpp; the library's own kernels have the displacement form alone.

#include "hybmss/instruction_set.hpp"

#include <array>
#include <cstddef>

namespace hybmss::bench {

/// What a node's state is.
enum class StateForm {
    displacement, ///< u = x - X: 1 - l/|d| from s = (2 r.du + du.du) / l^2, without cancellation
    position      ///< x: 1 - l/|d| as it stands
};
inline constexpr int kStateForms = 2;
inline constexpr const char* kStateFormNames[kStateForms] = {"displacement", "position"};

/// How 1 / sqrt is found.
enum class Root {
    approximate, ///< the processor's estimate; of displacements, Accuracy::fast
    refined,     ///< the estimate made as good as the type; of displacements, Accuracy::accurate
    exact        ///< rounded square root and division
};
inline constexpr int kRoots = 3;
inline constexpr const char* kRootNames[kRoots] = {"approximate", "refined", "exact"};

/// The thirteen directions of springs from a node, in cell edges.
inline constexpr int kSpringDirections = 13;
inline constexpr int kDirections[kSpringDirections][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 0},  {1, -1, 0},
                                                          {1, 0, 1},  {1, 0, -1}, {0, 1, 1},  {0, 1, -1}, {1, 1, 1},
                                                          {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};

/// Nodes of a box with a border of nodes without springs around it, x fastest. Lengths in cell edges. Every array has
/// two rows and a plane more than it has nodes on either side, so that whole vectors and all neighbours can be read.
template <class T>
struct SpringGrid {
    std::ptrdiff_t row, plane;                           ///< steps along y and z
    std::ptrdiff_t nodes;                                ///< those from 0 to here get a force, rounded up to a vector
    const T* state[3];                                   ///< displacements or positions
    std::array<const T*, kSpringDirections> stiffness{}; ///< of the spring from a node in that direction; or 0
    T* force[3];
};

/// Sets the force on every node to the sum over its 26 springs: each is evaluated at both ends, nothing is scattered.
template <class T>
using SpringSweep = void (*)(const SpringGrid<T>& grid);

/// The sweeps of one instruction set; null where it has no estimate of the root, and where the library's level is the
/// next better one.
struct SpringForms {
    SpringSweep<float> float_sweeps[kStateForms][kRoots];
    SpringSweep<double> double_sweeps[kStateForms][kRoots];
};

/// The sweeps of an available instruction set (not `automatic`).
const SpringForms& spring_forms(InstructionSet set);

} // namespace hybmss::bench
