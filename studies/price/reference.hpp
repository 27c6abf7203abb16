#pragma once

/// \file
/// What a solution converges to, from fine meshes.

#include "studies/price/problem.hpp"

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace hybmss::price {

/// A value from four meshes, each twice as fine as the last, by Richardson's extrapolation:
///   p = log2((q1 - q2) / (q2 - q3)),   q = q3 + (q3 - q2) / (2^p - 1).
struct Extrapolation {
    double value = 0, order = 0;
    double uncertainty = 0; ///< relative: what the three coarser meshes and the three finer ones differ by
};
/// `expected_order` is taken where the values do not tell one between 1/2 and 4.
Extrapolation extrapolate(const std::vector<double>& values, double expected_order);

/// The static solutions of HybMSS in double on finest/8 ... finest cells across, and their limit.
struct Reference {
    paper::Kind kind = paper::Kind::compression;
    int finest = 0;                    ///< cells across
    std::map<int, Outcome> solutions;  ///< by cells across
    std::vector<Extrapolation> values; ///< one a quantity of the problem
    GridField field;                   ///< on the finest grid
    double field_uncertainty = 0;      ///< L2, relative: as for values
    double expected_order = 0;         ///< of values and L2
};
/// `finest` is 8 or more and a power of two. Throws std::runtime_error where a solve fails.
Reference make_reference(paper::Kind kind, int finest, const std::function<void(const std::string&)>& progress);

} // namespace hybmss::price
