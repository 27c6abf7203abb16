#pragma once

#include "app/effect_costs.hpp"

#include <ostream>
#include <span>

namespace hybmss {

/// What `hybmss explain` tells of a scene, for programs: the effects with their bytes and ns, the body, the plan and
/// its candidates, the time steps. Numbers in SI units and ns.
void write_explanation(const Simulation& simulation, std::span<const EffectCost> costs, std::ostream& out);

} // namespace hybmss
