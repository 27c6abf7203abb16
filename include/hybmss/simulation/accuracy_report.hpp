#pragma once

/// \file
/// What came of the wish for an accuracy: the meshes tried, the error estimated, and what more would cost.

#include "hybmss/accuracy.hpp"
#include "hybmss/precision.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace hybmss {

/// A mesh that was solved on.
struct AccuracyMesh {
    std::array<std::int64_t, 3> cells = {0, 0, 0};
    double cell_size = 0; ///< m
    double seconds = 0;   ///< before it is solved, estimated from the mesh before; 0 for the first
    /// Relative; not a number on the first mesh, which has none to compare with.
    double error_estimate = std::numeric_limits<double>::quiet_NaN();
};

/// How an accuracy would be had, and at what price.
struct AccuracyOffer {
    double accuracy = 0;
    Precision precision = Precision::float64;
    Accuracy kernel = Accuracy::accurate;
    double tolerance = 0; ///< of the residual
    std::array<std::int64_t, 3> cells = {0, 0, 0};
    double cell_size = 0;          ///< m
    double bytes = 0, seconds = 0; ///< estimated
    bool fits = true;              ///< into the memory there is now, and what a lattice can number
};

/// Errors are the greatest of: that of the elastic energy, relative; of the volume change, over itself or, where that
/// is larger, the greatest displacement over the body's shortest edge; and of each probe that of the force, over itself
/// but at least 1 % of the problem's, of the torque, over itself but at least the force or 1 % of the problem's times
/// the shortest edge, and of the mean displacement, over itself but at least 1 % of the body's greatest displacement.
/// The problem's force is the largest of the probes' forces, of their torques over the shortest edge, and of what would
/// do the elastic energy's work along the greatest displacement. What differs from mesh to mesh by no more than the
/// tolerance's part of the problem's does not count.
struct AccuracyReport {
    double wanted = 0;         ///< relative
    double error_estimate = 0; ///< of the results; by the last two meshes, and the order that three show
    std::string quantity;      ///< which it is: "probe plate: force"; "" where none counts
    double order = 0;          ///< the order assumed for that
    bool free_mesh = false;    ///< the mesh was chosen
    double tolerance = 0;      ///< of the residual
    Precision precision = Precision::float64;
    Accuracy kernel = Accuracy::accurate; ///< the fastest level whose force errors are a tenth of the tolerance at most
    std::vector<AccuracyMesh> meshes;     ///< in the order they were solved
    std::vector<AccuracyOffer> offers; ///< the wish, ten times less, ten and a hundred times more: sorted, worst first
    bool reached() const { return error_estimate <= wanted; }
};

} // namespace hybmss
