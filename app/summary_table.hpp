#pragma once

/// \file
/// What came of a run, for a person.

#include "hybmss/simulation/simulation.hpp"

#include <string>

namespace hybmss {

std::string summary_table(const Simulation& simulation, const Summary& summary);

} // namespace hybmss
