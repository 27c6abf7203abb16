#pragma once

/// \file
/// Which effects a scene calls for, which it does not, and why.

#include "hybmss/simulation.hpp"

#include <string>
#include <vector>

namespace hybmss {

struct Effect {
    std::string name, reason;
};

struct EffectList {
    std::vector<Effect> in, out;
};

EffectList effects_of(const Simulation& simulation);

} // namespace hybmss
