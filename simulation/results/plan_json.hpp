#pragma once

#include "hybmss/plan_options.hpp"

#include <nlohmann/json.hpp>

namespace hybmss {

/// What was chosen, as summary.json and `hybmss explain --json` hold it.
nlohmann::ordered_json plan_json(const PlanDescription& plan);

} // namespace hybmss
