#pragma once

/// \file
/// What Golec et al. 2020 print in section 6, where our figures differ from it, and why.

#include "studies/paper/experiment.hpp"
#include "studies/paper/figures.hpp"

#include <optional>
#include <set>
#include <string>
#include <vector>

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

/// Why a row differs from the print; each is explained once below a table.
enum class Reason {
    unbounded,      ///< no equilibrium
    wrinkles,       ///< HybMSS-FD: several equilibria
    other_energy,   ///< nu < 1/4: the mean-stretch energy
    incompressible, ///< nu near 1/2: e is a small rest
    motion,         ///< the print's figure is taken from a motion
    law             ///< finite elements: another law at large strain
};

struct Difference {
    std::vector<Reason> reasons; ///< none: both agree
    bool compared = false;       ///< there is something printed
    std::string text() const;    ///< "agrees", "a, c", or "not printed"
};

/// Compares in the unit of the print (percent, N, N m); two figures agree within 2 % or, of e, within a hundredth of a
/// percent, the print's last digit.
Difference difference(const Experiment& experiment, Model model, std::optional<double> printed, const Figures& ours);
/// Adds Reason::law where the printed FEM and CalculiX differ.
void compare_finite_elements(const Experiment& experiment, std::optional<double> printed, const Figures& calculix,
                             Difference& difference);

/// "a: ...", a line for each of `reasons`.
std::vector<std::string> explanations(const std::set<Reason>& reasons);

/// What the print holds: e in percent of a compression or tension, the response of all others.
double printed_quantity(const Experiment& experiment, const Figures& figures);

} // namespace hybmss::paper
