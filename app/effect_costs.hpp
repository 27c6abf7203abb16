#pragma once

/// \file
/// What a scene's effects take, each by the scene without it.

#include "simulation/run/effect_list.hpp"

#include <optional>
#include <vector>

namespace hybmss {

struct EffectCost {
    const EffectRule* rule;
    bool in;
    std::optional<long long> bytes;    ///< that it adds to the dynamics; none for what no body can do without
    std::optional<double> nanoseconds; ///< that it adds to a cell's step; of explicit steps alone
};

/// Every effect of the list in its order. Those in the scene that it can do without are measured: explicit steps of the
/// scene and of the scene without them in turns, by the median of the differences. That takes about a tenth of a second
/// each, longer where a step does.
std::vector<EffectCost> effect_costs(const Simulation& simulation, const SimulationOptions& options);

} // namespace hybmss
