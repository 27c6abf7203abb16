#pragma once

/// \file
/// What Golec et al. 2020 print, in section 6.

#include "studies/paper/experiment.hpp"

#include <optional>

namespace hybmss::paper {

/// One line of figures: e in percent (Tables 2 and 3), N (Table 4), N m (Table 5), or the mean distance between HybMSS
/// and FEM in the middle layer in m (text beside Fig. 8 and Fig. 10).
struct PrintedFigures {
    std::optional<double> hybmss_fd, hybmss, finite_elements;
    std::optional<double> of(Model model) const;
};

/// Tables 2 to 5, by kind, nu and "5 %" or "20 %" as printed: a torsion's 1 and 45 degrees.
PrintedFigures printed_figures(const Experiment& experiment);

/// Mean distance from FEM in the middle layer at 20 %, m. Shear or torsion at nu = 0, 0.25 or 0.499.
std::optional<double> printed_distance(const Experiment& experiment);

} // namespace hybmss::paper
