#pragma once

/// \file
/// The tip of a heavy clamped beam of square section, by the theories of rods.

#include "studies/paper/experiment.hpp"

namespace hybmss::paper {

/// The deflections of the free end, m.
struct BeamTheory {
    double bending = 0; ///< rho g A L^4 / (8 E I), Euler and Bernoulli: (6.1) at x = L
    double shear = 0;   ///< what Timoshenko adds, rho g L^2 / (2 k G), k = 10 (1 + nu) / (12 + 11 nu)
};
BeamTheory beam_theory(const Experiment& beam);

} // namespace hybmss::paper
