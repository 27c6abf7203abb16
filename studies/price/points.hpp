#pragma once

/// \file
/// Work and precision: what each way to a solution takes, and how far from the limit it ends.

#include "studies/price/reference.hpp"

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace hybmss::price {

/// A way to a solution.
struct Way {
    std::optional<calculix::ElementType> elements; ///< CalculiX; none: a lattice, as follows
    Method method = Method::static_solve;
    paper::Model model = paper::Model::hybmss;
    Precision precision = Precision::float64;

    bool operator==(const Way&) const = default;
};
/// "static" or "CalculiX C3D20".
std::string name(const Way& way);

struct Point {
    Way way;
    paper::Kind kind = paper::Kind::compression;
    int across = 0;
    std::string failure;
    double seconds = 0; ///< least of the rounds
    long steps = 0;
    std::vector<double> values; ///< one a quantity of the problem
    /// Relative, one a quantity of the problem, then L2 and H1; not a number where there is none.
    std::vector<double> errors;
};
/// "force", ..., "L2", "H1": what the errors of a problem's points are of.
std::vector<std::string> error_names(paper::Kind kind);

/// Which meshes and ways.
struct Extent {
    int reference =
        64; ///< cells across of the reference's finest mesh, a power of two, at least 16; a beam's half as many
    int finest = 32;  ///< likewise of the points, at most the reference's
    bool all = false; ///< every way on every mesh
    bool calculix = true;
};

/// All ways on all meshes of one problem, from coarse to fine. On each mesh the ways take turns, in three rounds where
/// they are quick.
std::vector<Point> measure_points(const Reference& reference, const Extent& extent,
                                  const std::function<void(const std::string&)>& progress);

struct Cost {
    double across = std::numeric_limits<double>::quiet_NaN(); ///< cells along the shortest edge
    double seconds = std::numeric_limits<double>::quiet_NaN();
};
/// What an error takes a way, by straight lines between its points in the logarithms, coarse to fine; its first point's
/// where that is better already, not numbers where its last is not good enough.
Cost cost_at(const std::vector<Point>& points, const Way& way, std::size_t error_index, double error);

} // namespace hybmss::price
