#include "app/command_line.hpp"
#include "app/progress_line.hpp"
#include "hybmss/version.hpp"
#include "studies/calculix/program.hpp"
#include "studies/commands.hpp"
#include "studies/price/price_tables.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <functional>
#include <iostream>
#include <memory>

namespace {

using namespace hybmss;

using Report = std::function<void(const std::string&)>;

struct PriceArguments {
    std::vector<std::string> names;
    std::string json, markdown;
    bool whole = false, quick = false, force = false;
};

std::vector<paper::Table> price_of_solutions(const PriceArguments& arguments, const Report& progress) {
    price::Extent extent;
    extent.reference = arguments.quick ? 32 : 64;
    extent.finest = arguments.whole ? 64 : arguments.quick ? 16 : 32;
    extent.all = arguments.whole;
    extent.calculix = calculix::is_installed();
    if (!extent.calculix) {
        std::cerr << "hybmss: " << calculix::kNotInstalled << "; its points are left out\n";
    }
    return price::solution_tables(price::measure_solutions(extent, progress));
}

std::vector<paper::Table> price_of_time_steps(const PriceArguments& arguments, const Report& progress) {
    return {price::time_step_table(price::measure_time_steps(arguments.quick ? 3 : arguments.whole ? 7 : 5, progress))};
}

/// 8^3 cells and finer for 2 %; 1 % and less take 30^3 and more of some scenes.
std::vector<paper::Table> price_of_wishes(const PriceArguments& arguments, const Report& progress) {
    const std::vector<double> wishes = arguments.quick   ? std::vector<double>{0.05}
                                       : arguments.whole ? std::vector<double>{0.05, 0.02, 0.01, 0.005}
                                                         : std::vector<double>{0.05, 0.02};
    std::vector<price::WishResult> results;
    for (const price::WishCase& wish : price::wish_cases()) {
        progress("the limit of " + wish.name);
        const auto limit = price::limit_figures(wish.scene, (arguments.quick ? 1 : 2) * wish.reference_across);
        for (const double accuracy : wishes) {
            progress(fmt::format("{}: accuracy = {:g}", wish.name, accuracy));
            results.push_back(price::solve_wish(wish, accuracy, limit));
        }
    }
    return {price::wish_table(results)};
}

struct Priced {
    const char* name;
    std::vector<paper::Table> (*tables)(const PriceArguments&, const Report&);
};
constexpr Priced kPriced[] = {
    {"solution", price_of_solutions}, {"time-steps", price_of_time_steps}, {"accuracy", price_of_wishes}};

std::vector<std::string> priced_names() {
    std::vector<std::string> names;
    for (const Priced& priced : kPriced) {
        names.emplace_back(priced.name);
    }
    return names;
}

void run_price(const PriceArguments& arguments) {
    const auto json = open_output("--json", arguments.json, {"{\"version\":", {}, arguments.force});
    const auto markdown =
        open_output("--markdown", arguments.markdown, {"Printedby`hybmss-studyprice", {}, arguments.force});
    ProgressLine line(stderr);
    std::vector<paper::Table> all;
    for (const Priced& priced : kPriced) {
        if (!arguments.names.empty() && std::ranges::count(arguments.names, priced.name) == 0) {
            continue;
        }
        for (paper::Table& table : priced.tables(arguments, [&](const std::string& what) { line.show(what); })) {
            line.clear();
            paper::print_text(table, std::cout);
            std::cout << std::flush;
            all.push_back(std::move(table));
        }
    }
    if (json) {
        nlohmann::ordered_json tables = nlohmann::ordered_json::array();
        for (const paper::Table& table : all) {
            tables.push_back(paper::to_json(table));
        }
        json->stream() << nlohmann::ordered_json{{"version", kVersion},
                                                 {"calculix", calculix::version()},
                                                 {"tables", tables}}
                              .dump(1)
                       << '\n';
        json->commit();
    }
    if (markdown) {
        markdown->stream() << "Printed by `hybmss-study price`.\n\n";
        for (const paper::Table& table : all) {
            paper::print_markdown(table, markdown->stream());
        }
        markdown->commit();
    }
}

} // namespace

void add_price_command(CLI::App& app) {
    const auto arguments = std::make_shared<PriceArguments>();
    CLI::App* command = app.add_subcommand("price", "what accuracy costs in time: errors beside seconds");
    command->add_option("WHAT", arguments->names, "what is priced; all unless named")
        ->check(CLI::IsMember(priced_names()));
    CLI::Option* quick = command->add_flag("--quick", arguments->quick, "small meshes only");
    command->add_flag("--whole", arguments->whole, "every way on every mesh, to 64 cells across: takes long")
        ->excludes(quick);
    command->add_option("--json", arguments->json, "also write the tables to this file")->check(a_path());
    command->add_option("--markdown", arguments->markdown, "also write them as Markdown to this file")->check(a_path());
    add_force_option(*command, arguments->force);
    command->callback([arguments] { run_price(*arguments); });
}
