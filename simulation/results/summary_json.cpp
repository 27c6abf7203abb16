#include "simulation/results/results.hpp"

#include "hybmss/version.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

using Json = nlohmann::ordered_json;

void require_finite(const Json& value) {
    if (value.is_number_float() && !std::isfinite(value.get<double>())) {
        throw NotFinite("summary.json would hold a value that is not finite: not written");
    }
    if (value.is_structured()) {
        for (const auto& item : value) {
            require_finite(item);
        }
    }
}

Json balance_json(const EnergyBalance& b, bool free_obstacles) {
    Json json = {
        {"work", {{"supports", b.supports}, {"loads", b.loads}, {"gravity", b.gravity}, {"obstacles", b.obstacles}}},
        {"change", {{"kinetic", b.kinetic}, {"elastic", b.elastic}, {"effects", b.effects}}},
        {"dissipated", {{"mass_damping", b.mass_damping}, {"effects", b.effects_dissipated}}},
        {"imbalance", b.imbalance()},
        {"relative_imbalance", b.relative_imbalance()}};
    if (free_obstacles) {
        json["change"]["free_obstacles"] = b.free_obstacles;
    }
    return json;
}

Json accuracy_json(const AccuracyReport& a) {
    Json json = {{"wanted", a.wanted},       {"error_estimate", a.error_estimate},
                 {"reached", a.reached()},   {"quantity", a.quantity},
                 {"order", a.order},         {"free_mesh", a.free_mesh},
                 {"tolerance", a.tolerance}, {"precision", name(a.precision)},
                 {"kernel", name(a.kernel)}};
    json["meshes"] = Json::array();
    for (const AccuracyMesh& mesh : a.meshes) {
        json["meshes"].push_back({{"cells", mesh.cells}, {"cell_size", mesh.cell_size}, {"seconds", mesh.seconds}});
        if (std::isfinite(mesh.error_estimate)) {
            json["meshes"].back()["error_estimate"] = mesh.error_estimate;
        }
    }
    json["offers"] = Json::array();
    for (const AccuracyOffer& offer : a.offers) {
        json["offers"].push_back({{"accuracy", offer.accuracy},
                                  {"precision", name(offer.precision)},
                                  {"kernel", name(offer.kernel)},
                                  {"tolerance", offer.tolerance},
                                  {"cells", offer.cells},
                                  {"cell_size", offer.cell_size},
                                  {"bytes", offer.bytes},
                                  {"seconds", offer.seconds},
                                  {"fits", offer.fits}});
    }
    return json;
}

/// What every run has, in order, at the end of its summary.
template <class AnySummary>
void add_course(Json& json, const AnySummary& summary) {
    json["residual"] = summary.settlement.residual;
    json["kinetic_ratio"] = summary.settlement.kinetic_ratio;
    json["time"] = summary.time;
    json["time_step"] = summary.time_step;
    json["critical_time_step"] = summary.critical_time_step;
    json["wall_seconds"] = summary.wall_seconds;
}

std::string finished(Json& json) {
    json["version"] = kVersion;
    require_finite(json);
    return json.dump(2) + "\n";
}

} // namespace

Json plan_json(const PlanDescription& plan) {
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

std::string summary_json(const Summary& summary) {
    Json json;
    json["converged"] = summary.converged;
    json["failure"] = summary.failure;
    json["relative_volume_change"] = summary.volume.relative_volume_change;
    json["min_cell_volume_ratio"] = summary.volume.min_cell_volume_ratio;
    json["max_cell_volume_ratio"] = summary.volume.max_cell_volume_ratio;
    json["energy"] = {{"springs", summary.energies.springs},
                      {"volume", summary.energies.volume},
                      {"kinetic", summary.energies.kinetic},
                      {"external", summary.energies.external},
                      {"removed", summary.energies.removed}};
    for (const EffectEnergy& effect : summary.energies.effects) {
        json["effects"][effect.name] = {{"stored", effect.stored}, {"dissipated", effect.dissipated}};
    }
    if (summary.balance) {
        json["energy_balance"] = balance_json(
            *summary.balance, std::any_of(summary.obstacles.begin(), summary.obstacles.end(),
                                          [](const NamedObstacleReading& o) { return o.pose.has_value(); }));
    }
    if (summary.stress) {
        json["stress"] = {{"max_von_mises", summary.stress->max_von_mises},
                          {"where", summary.stress->where},
                          {"mean", summary.stress->mean_cauchy}};
    }
    if (summary.fit) {
        json["fit"] = {{"misfit", summary.fit->misfit},
                       {"anisotropy", summary.fit->anisotropy},
                       {"modulus_error", summary.fit->modulus_error},
                       {"without_spring", summary.fit->without}};
    }
    if (!summary.modes.empty()) {
        const bool buckling = summary.method == SolverMethod::buckling;
        json[buckling ? "buckling" : "modes"] = Json::array();
        for (std::size_t m = 0; m < summary.modes.size(); ++m) {
            json[buckling ? "buckling" : "modes"].push_back(
                {{buckling ? "factor" : "frequency", summary.modes[m].value},
                 {"residual", summary.modes[m].residual},
                 {"shape", mode_name(m)}});
        }
        if (!buckling) {
            json["rigid_motions"] = summary.rigid_motions;
        }
    }
    if (summary.accuracy) {
        json["accuracy"] = accuracy_json(*summary.accuracy);
    }
    for (const auto& [name, reading, stiffness, pose] : summary.obstacles) {
        json["obstacles"][name] = {{"force", reading.force},
                                   {"torque", reading.torque},
                                   {"impulse", reading.impulse},
                                   {"angular_impulse", reading.angular_impulse},
                                   {"energy", reading.energy},
                                   {"dissipated", reading.dissipated},
                                   {"nodes", reading.nodes},
                                   {"depth", reading.depth},
                                   {"greatest_depth", reading.greatest_depth},
                                   {"stiffness", stiffness}};
        if (pose) {
            json["obstacles"][name].update({{"position", pose->position},
                                            {"rotation", pose->rotation},
                                            {"velocity", pose->velocity},
                                            {"angular_velocity", pose->angular_velocity}});
        }
    }
    json["probes"] = Json::object();
    for (const ProbeReading& probe : summary.probes) {
        json["probes"][probe.name] = {{"force", probe.force},
                                      {"torque", probe.torque},
                                      {"mean_displacement", probe.mean_displacement},
                                      {"max_displacement", probe.max_displacement},
                                      {"reaction_nodes", probe.reaction_nodes},
                                      {"shared_reaction_nodes", probe.shared_reaction_nodes}};
    }
    for (const SupportReading& support : summary.supports) {
        json["supports"].push_back({{"kind", support.kind},
                                    {"where", support.where},
                                    {"force", support.force},
                                    {"torque", support.torque},
                                    {"nodes", support.nodes}});
    }
    json["removed_cells"] = summary.removed_cells;
    if (summary.parted_faces > 0) {
        json["parted_faces"] = summary.parted_faces;
        json["parting_energy"] = summary.parting_energy;
    }
    json["warnings"] = summary.warnings;
    json["steps"] = summary.steps;
    json["iterations"] = summary.work.newton_iterations;
    json["cg_iterations"] = summary.work.cg_iterations;
    json["preconditioner"] = summary.work.preconditioner;
    add_course(json, summary);
    json["plan"] = plan_json(summary.plan);
    return finished(json);
}

std::string summary_json(const WorldSummary& summary) {
    Json json;
    json["converged"] = summary.converged;
    json["failure"] = summary.failure;
    json["contacts"] = Json::array();
    for (const auto& [first, second, reading] : summary.contacts) {
        json["contacts"].push_back({{"between", {first, second}},
                                    {"force", reading.force},
                                    {"impulse", reading.impulse},
                                    {"nodes", reading.nodes},
                                    {"depth", reading.depth},
                                    {"greatest_depth", reading.greatest_depth}});
    }
    json["attachments"] = Json::array();
    for (const AttachmentReading& tied : summary.attachments) {
        json["attachments"].push_back(
            {{"from", tied.from}, {"to", tied.to}, {"ties", tied.ties}, {"force", tied.force}});
    }
    json["steps"] = summary.steps;
    add_course(json, summary);
    return finished(json);
}

} // namespace hybmss
