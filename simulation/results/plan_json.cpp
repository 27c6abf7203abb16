#include "simulation/results/plan_json.hpp"

namespace hybmss {

nlohmann::ordered_json plan_json(const PlanDescription& plan) {
    return {{"instruction_set", name(plan.instruction_set)},
            {"layout", plan.layout},
            {"kernel", plan.kernel},
            {"precision", plan.precision},
            {"threads", plan.threads},
            {"nodes", plan.nodes},
            {"springs", plan.springs},
            {"cells", plan.cells},
            {"bytes", plan.bytes},
            {"tiles", plan.tiles}};
}

} // namespace hybmss
