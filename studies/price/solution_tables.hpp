#pragma once

/// \file
/// The price of a percent in a solution, as tables.

#include "studies/paper/table.hpp"
#include "studies/price/points.hpp"

#include <functional>
#include <string>
#include <vector>

namespace hybmss::price {

struct Solutions {
    std::vector<Reference> references;
    std::vector<std::vector<Point>> points; ///< by reference
};
Solutions measure_solutions(const Extent& extent, const std::function<void(const std::string&)>& progress);

/// The references; all points with observed and expected orders; what 10, 1 and 0.1 % cost each form of springs and
/// each element; CalculiX and settling at the static solve's errors.
std::vector<paper::Table> solution_tables(const Solutions& solutions);

} // namespace hybmss::price
