#include "app/command_line.hpp"
#include "app/progress_line.hpp"
#include "hybmss/version.hpp"
#include "studies/commands.hpp"
#include "studies/textbook/problem.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <iostream>
#include <memory>
#include <vector>

namespace {

using namespace hybmss;

struct TextbookArguments {
    std::string json, markdown;
    bool quick = false, force = false;
};

void run_textbook(const TextbookArguments& arguments) {
    const auto json = open_output("--json", arguments.json, {"{\"version\":", {}, arguments.force});
    const auto markdown =
        open_output("--markdown", arguments.markdown, {"Printedby`hybmss-studytextbook", {}, arguments.force});
    ProgressLine line(stderr);
    std::vector<paper::Table> tables = {
        textbook::problem_table(arguments.quick, [&](const std::string& what) { line.show(what); })};
    line.show("a clamped cantilever");
    tables.push_back(textbook::clamped_cantilever_table(arguments.quick));
    line.clear();
    tables.push_back(textbook::twist_table());
    tables.push_back(textbook::anisotropy_table());
    nlohmann::ordered_json in_json = nlohmann::ordered_json::array();
    if (markdown) {
        markdown->stream() << "Printed by `hybmss-study textbook --markdown docs/report/textbook.md`.\n\n";
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

} // namespace

void add_textbook_command(CLI::App& app) {
    const auto arguments = std::make_shared<TextbookArguments>();
    CLI::App* command = app.add_subcommand("textbook", "problems with known answers: ours, errors and their order");
    command->add_flag("--quick", arguments->quick, "the two coarsest meshes of each");
    command->add_option("--json", arguments->json, "also write the tables to this file")->check(a_path());
    command->add_option("--markdown", arguments->markdown, "also write them as Markdown to this file")->check(a_path());
    add_force_option(*command, arguments->force);
    command->callback([arguments] { run_textbook(*arguments); });
}
