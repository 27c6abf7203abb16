#include "app/command_line.hpp"
#include "app/progress_line.hpp"
#include "studies/commands.hpp"
#include "studies/stability/hard_case.hpp"
#include "studies/stability/integrator_order.hpp"
#include "studies/stability/stability_map.hpp"

#include "hybmss/version.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <vector>

namespace {

using namespace hybmss;

struct StabilityArguments {
    std::string json, filter, springs = "nodes";
    bool map = false, integrators = false, quick = false, force = false;
};

void run_map(AtomicFile* json) {
    ProgressLine line(stderr);
    const auto progress = [&](const char* what) {
        return [&line, what](double share) { line.show(fmt::format("{}: {:.0f} %", what, 100 * share)); };
    };
    const auto rows = stability::stability_map(progress("stability map"));
    line.clear();
    stability::print_map(rows, std::cout);
    if (json) {
        const auto sheets = stability::stability_sheets(progress("values of the picture"));
        line.clear();
        const nlohmann::ordered_json report = {
            {"version", kVersion}, {"ranges", stability::map_json(rows)}, {"sheets", stability::sheets_json(sheets)}};
        json->stream() << report.dump(1) << '\n';
        json->commit();
    }
}

void run_integrators(AtomicFile* json) {
    const auto studies = stability::study_integrators();
    stability::print_integrators(studies, std::cout);
    if (json) {
        const nlohmann::ordered_json report = {{"version", kVersion},
                                               {"integrators", stability::integrators_json(studies)}};
        json->stream() << report.dump(1) << '\n';
        json->commit();
    }
}

std::vector<stability::HardCase> chosen_cases(const StabilityArguments& arguments) {
    std::vector<stability::HardCase> chosen;
    const SpringForm springs = arguments.springs == "means" ? SpringForm::means : SpringForm::nodes;
    for (stability::HardCase& hard_case : stability::hard_cases(springs)) {
        if ((!arguments.quick || hard_case.quick) && hard_case.name.find(arguments.filter) != std::string::npos) {
            chosen.push_back(std::move(hard_case));
        }
    }
    if (chosen.empty()) {
        throw std::invalid_argument("--filter " + arguments.filter + ": no case has this in its name");
    }
    return chosen;
}

void run_cases(const StabilityArguments& arguments, AtomicFile* json) {
    const std::vector<stability::HardCase> cases = chosen_cases(arguments);
    ProgressLine line(stderr);
    std::vector<stability::CaseRow> rows;
    for (const stability::HardCase& hard_case : cases) {
        line.show(fmt::format("{} of {}: {}", rows.size() + 1, cases.size(), hard_case.name));
        const auto start = std::chrono::steady_clock::now();
        const stability::Outcome outcome = stability::run_case(hard_case);
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        rows.push_back({hard_case, outcome, taken.count()});
    }
    line.clear();
    stability::print_cases(rows, std::cout);
    if (json) {
        nlohmann::ordered_json report = {{"version", kVersion}, {"springs", arguments.springs}};
        report.update(stability::cases_json(rows));
        json->stream() << report.dump(1) << '\n';
        json->commit();
    }
    if (stability::count(rows).wrong > 0) {
        throw CLI::RuntimeError(1);
    }
}

void run_stability(const StabilityArguments& arguments) {
    const auto json = open_output("--json", arguments.json, {"{\"version\":", {}, arguments.force});
    if (arguments.map) {
        run_map(json.get());
    } else if (arguments.integrators) {
        run_integrators(json.get());
    } else {
        run_cases(arguments, json.get());
    }
}

} // namespace

void add_stability_command(CLI::App& app) {
    const auto arguments = std::make_shared<StabilityArguments>();
    CLI::App* command =
        app.add_subcommand("stability", "run the hard cases, or map where the lattice itself is stable");
    command->add_option("--json", arguments->json, "also write the rows to this file")->check(a_path());
    command->add_flag("--map", arguments->map, "where the homogeneous lattice is stable, over nu, A and stretch");
    command->add_flag("--integrators", arguments->integrators, "error against step size of each time integrator");
    command->add_option("--filter", arguments->filter, "only cases with this text in their names");
    command->add_option("--springs", arguments->springs, "of the cases' bodies: nodes or means")
        ->check(CLI::IsMember({"nodes", "means"}))
        ->capture_default_str();
    command->add_flag("--quick", arguments->quick, "only the cases that the tests run too");
    add_force_option(*command, arguments->force);
    command->callback([arguments] { run_stability(*arguments); });
}
