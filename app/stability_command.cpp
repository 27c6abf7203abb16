#include "app/commands.hpp"
#include "app/json_file.hpp"
#include "app/progress_line.hpp"
#include "app/stability/map_report.hpp"

#include "hybmss/version.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <iostream>
#include <memory>

namespace {

using namespace hybmss;

struct StabilityArguments {
    std::string json;
    bool map = false;
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

void run_stability(const StabilityArguments& arguments) {
    const auto json = open_json_file(arguments.json);
    if (arguments.map) {
        run_map(json.get());
    }
}

} // namespace

void add_stability_command(CLI::App& app) {
    const auto arguments = std::make_shared<StabilityArguments>();
    CLI::App* command = app.add_subcommand("stability", "where the lattice itself is stable");
    command->add_option("--json", arguments->json, "also write the rows to this file");
    command->add_flag("--map", arguments->map, "the stability map of the homogeneous lattice")->required();
    command->callback([arguments] { run_stability(*arguments); });
}
