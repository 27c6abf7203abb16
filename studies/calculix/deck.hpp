#pragma once

/// \file
/// A problem in CalculiX's input format.

#include "studies/calculix/problem.hpp"

#include <ostream>

namespace hybmss::calculix {

/// Nodes and elements are numbered from 1. One step, *STATIC with its default increments; displacements of all nodes
/// and forces on the supported ones are printed at its end.
void write_deck(const Problem& problem, std::ostream& out);

} // namespace hybmss::calculix
