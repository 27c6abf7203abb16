#include "app/explain_json.hpp"

#include "simulation/results/plan_json.hpp"

namespace hybmss {
namespace {

using Json = nlohmann::ordered_json;

template <class Value>
Json or_null(const std::optional<Value>& value) {
    return value ? Json(*value) : Json();
}

Json effects_json(const Simulation& simulation, std::span<const EffectCost> costs) {
    const std::string kernel = simulation.describe().kernel;
    Json effects = Json::array();
    for (const EffectCost& cost : costs) {
        Json effect = {{"name", cost.rule->name}, {"in", cost.in}, {"why", cost.rule->reason(simulation)}};
        if (cost.in) {
            effect["kernel"] = cost.rule->kernel.empty() ? kernel : std::string(cost.rule->kernel);
            effect["bytes"] = or_null(cost.bytes);
            effect["ns_per_cell_step"] = or_null(cost.nanoseconds);
        }
        effects.push_back(effect);
    }
    return effects;
}

Json candidates_json(const PlanDescription& plan) {
    Json candidates = Json::array();
    for (const CandidateFigure& figure : plan.candidates) {
        candidates.push_back(
            {{"name", figure.name}, {"ns_per_cell_step", figure.ns_per_cell_step}, {"finalist", figure.finalist}});
    }
    return candidates;
}

} // namespace

void write_explanation(const Simulation& simulation, std::span<const EffectCost> costs, std::ostream& out) {
    const PlanDescription plan = simulation.describe();
    Json json;
    json["effects"] = effects_json(simulation, costs);
    json["body"] = {{"cells", simulation.lattice().cell_count()},
                    {"grid", simulation.lattice().cells()},
                    {"nodes", simulation.node_count()},
                    {"springs", plan.springs}};
    json["plan"] = plan_json(plan);
    json["plan"]["effort"] = name(plan.effort);
    json["plan"]["why"] = plan.reason;
    json["plan"]["candidates"] = candidates_json(plan);
    json["critical_time_step"] = simulation.critical_time_step();
    json["time_step"] = simulation.time_step();
    out << json.dump(2) << '\n';
}

} // namespace hybmss
