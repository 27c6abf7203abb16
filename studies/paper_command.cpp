#include "app/command_line.hpp"
#include "app/progress_line.hpp"
#include "studies/calculix/program.hpp"
#include "studies/commands.hpp"
#include "studies/paper/tables.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>

namespace {

using namespace hybmss;

struct PaperArguments {
    std::vector<std::string> names;
    std::string json, markdown, store;
    bool quick = false, calculix = false, force = false;
};

std::vector<std::string> table_names() {
    std::vector<std::string> names;
    for (const paper::TableEntry& entry : paper::tables()) {
        names.push_back(entry.name);
    }
    return names;
}

void run_paper(const PaperArguments& arguments) {
    if (!arguments.store.empty() && !arguments.calculix) {
        throw std::invalid_argument("--store: there is nothing new to keep without --calculix");
    }
    if (arguments.calculix && !calculix::is_installed()) {
        throw std::invalid_argument(std::string("--calculix: ") + calculix::kNotInstalled +
                                    "; without --calculix its kept results are shown");
    }
    const auto json = open_output("--json", arguments.json, {"{\"version\":", {}, arguments.force});
    const auto markdown =
        open_output("--markdown", arguments.markdown, {"Printedby`hybmss-studypaper", {}, arguments.force});
    const auto store = open_output("--store", arguments.store, {"{\"command\":\"hybmss", {}, arguments.force});
    paper::FiniteElements finite_elements(arguments.calculix ? paper::FiniteElements::Source::program
                                                             : paper::FiniteElements::Source::stored);
    ProgressLine line(stderr);
    finite_elements.before_run = [&line](const std::string& what) { line.show("CalculiX: " + what); };
    paper::TableContext context{finite_elements, arguments.quick,
                                [&line](const std::string& what) { line.show(what); }};
    std::vector<paper::Table> tables;
    for (const paper::TableEntry& entry : paper::tables()) {
        if (arguments.names.empty() || std::ranges::count(arguments.names, entry.name) > 0) {
            tables.push_back(entry.make(context));
            line.clear();
            paper::print_text(tables.back(), std::cout);
            std::cout << std::flush;
        }
    }
    const std::string source = finite_elements.description();
    std::cout << "finite elements: " << source << '\n';
    if (json) {
        paper::write_json(tables, source, json->stream());
        json->commit();
    }
    if (markdown) {
        paper::write_page(tables, source, markdown->stream());
        markdown->commit();
    }
    if (store) {
        finite_elements.write(store->stream());
        store->commit();
    }
}

} // namespace

void add_paper_command(CLI::App& app) {
    const auto arguments = std::make_shared<PaperArguments>();
    CLI::App* command =
        app.add_subcommand("paper", "the experiments of Golec et al. 2020 beside the print and CalculiX");
    command->add_option("TABLE", arguments->names, "which tables; all unless named")
        ->check(CLI::IsMember(table_names()));
    command->add_flag("--quick", arguments->quick, "without the largest meshes");
    command->add_flag("--calculix", arguments->calculix, "run CalculiX (ccx) anew instead of showing its kept results");
    command->add_option("--store", arguments->store, "with --calculix: keep its results in this file")->check(a_path());
    command->add_option("--json", arguments->json, "also write the tables to this file")->check(a_path());
    command->add_option("--markdown", arguments->markdown, "also write them as a page of Markdown to this file")
        ->check(a_path());
    add_force_option(*command, arguments->force);
    command->callback([arguments] { run_paper(*arguments); });
}
