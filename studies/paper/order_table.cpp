#include "studies/paper/manufactured.hpp"
#include "studies/paper/tables.hpp"

#include <fmt/format.h>

namespace hybmss::paper {

Table order_table(TableContext& context) {
    Table table{
        "order",
        "Order of convergence",
        {"A unit cube that holds three plane waves of displacement, prescribed on its boundary and kept up inside "
         "by the body force of linear elasticity. The error against the waves themselves, relative: L2 of the "
         "displacement, H1 of its gradient in the cells' centres. Expected order: 2."},
        {{"poisson_ratio", "nu"},
         {"face_diagonal_ratio", "A"},
         {"cells", "cells"},
         {"l2", "L2 error", -3},
         {"l2_order", "order", 3},
         {"h1", "H1 error", -3},
         {"h1_order", "order", 3}},
        {},
        {}};
    const std::vector<int> cells = context.quick ? std::vector<int>{4, 8, 16} : std::vector<int>{4, 8, 16, 32};
    for (const double nu : {0.0, 0.25, 0.45}) {
        for (const double A : {0.0, 1.0}) {
            context.progress(fmt::format("order, nu={:g}, A={:g}", nu, A));
            const auto steps = manufactured_convergence({.poisson_ratio = nu, .face_diagonal_ratio = A}, cells);
            for (std::size_t s = 0; s < steps.size(); ++s) {
                const auto order = [&](double ConvergenceStep::*error) {
                    return s == 0 ? Cell()
                                  : Cell(observed_order(steps[s - 1].*error, steps[s - 1].cells, steps[s].*error,
                                                        steps[s].cells));
                };
                table.rows.push_back({fmt::format("{:g}", nu), fmt::format("{:g}", A), fmt::format("{}^3", cells[s]),
                                      steps[s].displacement, order(&ConvergenceStep::displacement), steps[s].gradient,
                                      order(&ConvergenceStep::gradient)});
            }
        }
    }
    return table;
}

} // namespace hybmss::paper
