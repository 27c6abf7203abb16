#pragma once

/// \file
/// Whether a wish for an accuracy is kept: varied scenes, each beside its own limit.

#include "hybmss/simulation/solve_to_accuracy.hpp"
#include "simulation/accuracy/mesh_convergence.hpp"
#include "studies/paper/table.hpp"

#include <functional>
#include <string>
#include <vector>

namespace hybmss::price {

struct WishCase {
    std::string name;
    Scene scene;          ///< static, its mesh free
    int reference_across; ///< cells along the shortest edge of the reference's finest mesh in tests; a multiple of 4
};
/// Compression, shear, torsion, tension, bending, loads; nu from 0 to 0.45; with and without face diagonals; small
/// strain and large.
std::vector<WishCase> wish_cases();

/// The figures of a case in the limit, by Richardson's extrapolation from static solves in double on `across`/4,
/// `across`/2 and `across` cells along the shortest edge.
std::vector<ResultFigure> limit_figures(const Scene& scene, int across);

struct WishResult {
    std::string name;
    double wanted = 0, estimate = 0, error = 0; ///< relative; error: the true one, against the limit
    std::array<std::int64_t, 3> cells = {0, 0, 0};
    Precision precision = Precision::float64;
    double seconds = 0; ///< of all meshes
    std::string failure;
};
WishResult solve_wish(const WishCase& wish, double accuracy, const std::vector<ResultFigure>& limit);

paper::Table wish_table(const std::vector<WishResult>& results);

} // namespace hybmss::price
