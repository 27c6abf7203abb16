// Studies that print tables of figures and nothing else: textbook, law, angular, cells, volumes, tissue.

#include "app/command_line.hpp"
#include "app/progress_line.hpp"
#include "hybmss/version.hpp"
#include "studies/commands.hpp"
#include "studies/textbook/problem.hpp"
#include "studies/tissue/tissue_fit.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace {

using namespace hybmss;

struct TableArguments {
    std::string json, markdown;
    bool quick = false, force = false;

    void add_to(CLI::App& command) {
        command.add_option("--json", json, "also write the tables to this file")->check(a_path());
        command.add_option("--markdown", markdown, "also write them as Markdown to this file")->check(a_path());
        add_force_option(command, force);
    }
};

/// `make()`: the tables, once it is known that they can be written.
template <class Make>
void write_tables(const std::string& study, const TableArguments& arguments, const Make& make) {
    std::string beginning = "Printedby`hybmss-study" + study;
    const auto json = open_output("--json", arguments.json, {"{\"version\":", {}, arguments.force});
    const auto markdown = open_output("--markdown", arguments.markdown, {beginning, {}, arguments.force});
    const std::vector<paper::Table> tables = make();
    nlohmann::ordered_json in_json = nlohmann::ordered_json::array();
    if (markdown) {
        markdown->stream() << fmt::format("Printed by `hybmss-study {0} --markdown docs/report/{0}.md`.\n\n", study);
    }
    for (const paper::Table& table : tables) {
        paper::print_text(table, std::cout);
        in_json.push_back(paper::to_json(table));
        if (markdown) {
            paper::print_markdown(table, markdown->stream());
        }
    }
    if (markdown) {
        markdown->commit();
    }
    if (json) {
        json->stream() << nlohmann::ordered_json{{"version", kVersion}, {"tables", in_json}}.dump(1) << '\n';
        json->commit();
    }
}

std::vector<paper::Table> textbook_tables(bool quick) {
    ProgressLine line(stderr);
    std::vector<paper::Table> tables = {
        textbook::problem_table(quick, [&](const std::string& what) { line.show(what); })};
    line.show("a clamped cantilever");
    tables.push_back(textbook::clamped_cantilever_table(quick));
    line.clear();
    tables.push_back(textbook::twist_table());
    tables.push_back(textbook::anisotropy_table());
    return tables;
}

} // namespace

void add_textbook_command(CLI::App& app) {
    const auto arguments = std::make_shared<TableArguments>();
    CLI::App* command = app.add_subcommand("textbook", "problems with known answers: ours, errors and their order");
    command->add_flag("--quick", arguments->quick, "the two coarsest meshes of each");
    arguments->add_to(*command);
    command->callback(
        [arguments] { write_tables("textbook", *arguments, [&] { return textbook_tables(arguments->quick); }); });
}

void add_law_command(CLI::App& app) {
    const auto arguments = std::make_shared<TableArguments>();
    CLI::App* command = app.add_subcommand("law", "the lattice as a material: large strain, waves, convexity");
    arguments->add_to(*command);
    command->callback([arguments] { write_tables("law", *arguments, textbook::law_tables); });
}

void add_angular_command(CLI::App& app) {
    const auto arguments = std::make_shared<TableArguments>();
    CLI::App* command = app.add_subcommand("angular", "angular springs in place of the volume force: accuracy, time");
    arguments->add_to(*command);
    command->callback([arguments] { write_tables("angular", *arguments, textbook::angular_tables); });
}

void add_cells_command(CLI::App& app) {
    const auto arguments = std::make_shared<TableArguments>();
    CLI::App* command = app.add_subcommand("cells", "a round bar by cells of other shapes beside cubes");
    arguments->add_to(*command);
    command->callback(
        [arguments] { write_tables("cells", *arguments, [] { return std::vector{textbook::cylinder_table()}; }); });
}

void add_volumes_command(CLI::App& app) {
    const auto arguments = std::make_shared<TableArguments>();
    CLI::App* command = app.add_subcommand("volumes", "the paper's pressed cube cell by cell");
    arguments->add_to(*command);
    command->callback([arguments] {
        write_tables("volumes", *arguments, [] { return std::vector{textbook::cell_volumes_table()}; });
    });
}

void add_tissue_command(CLI::App& app) {
    const auto arguments = std::make_shared<TableArguments>();
    CLI::App* command = app.add_subcommand("tissue", "published data of tissues, and the springs that are nearest");
    arguments->add_to(*command);
    command->callback([arguments] {
        write_tables("tissue", *arguments, [] {
            return std::vector<paper::Table>{tissue::fit_table(), tissue::point_table()};
        });
    });
}
