#include "app/commands.hpp"
#include "app/json_file.hpp"
#include "bench/row_reporter.hpp"
#include "bench/step_benchmark.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <iostream>
#include <memory>
#include <regex>
#include <stdexcept>

namespace {

using namespace hybmss;

struct BenchArguments {
    std::string json, filter, instruction_set = "automatic";
    std::vector<int> threads = {1, 2};
    double seconds = 0.5;
    bool quick = false;
};

std::vector<bench::BenchRow> selected_rows(const BenchArguments& arguments) {
    const std::vector<InstructionSet> sets =
        arguments.instruction_set == "all"
            ? available_instruction_sets()
            : std::vector<InstructionSet>{resolve(parse_instruction_set(arguments.instruction_set))};
    std::vector<bench::BenchRow> rows = bench::step_rows(sets, arguments.threads, arguments.quick);
    try {
        const std::regex filter(arguments.filter);
        std::erase_if(rows, [&](const bench::BenchRow& row) { return !std::regex_search(bench::name(row), filter); });
    } catch (const std::regex_error& error) {
        throw std::invalid_argument("--filter " + arguments.filter + ": not a regular expression: " + error.what());
    }
    if (rows.empty()) {
        throw std::invalid_argument("--filter " + arguments.filter +
                                    ": no row matches (they are named like "
                                    "step/10x10x10/HybMSS/lattice/avx2/float/threads:1)");
    }
    return rows;
}

void run_bench(const BenchArguments& arguments) {
    const std::vector<bench::BenchRow> rows = selected_rows(arguments);
    const auto json = open_json_file(arguments.json);
    for (const bench::BenchRow& row : rows) {
        bench::register_step(row, arguments.seconds);
    }
    bench::RowReporter reporter(rows, std::cout, json ? &json->stream() : nullptr);
    std::string program = "hybmss bench";
    char* argv[] = {program.data()};
    int argc = 1;
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks(&reporter, ".*");
    benchmark::Shutdown();
    if (json) {
        json->commit();
    }
    if (reporter.failed()) {
        throw CLI::RuntimeError(1);
    }
}

} // namespace

void add_bench_command(CLI::App& app) {
    const auto arguments = std::make_shared<BenchArguments>();
    CLI::App* command = app.add_subcommand("bench", "measure the explicit step against the scalar yardstick");
    command->add_option("--json", arguments->json, "also write Google Benchmark's JSON to this file");
    command->add_flag("--quick", arguments->quick, "two meshes and two models only");
    command->add_option("--filter", arguments->filter, "only rows whose name matches this regular expression");
    command
        ->add_option("--isa", arguments->instruction_set, "sse2, avx2, avx512, neon, automatic, or all of this machine")
        ->capture_default_str();
    command->add_option("--threads", arguments->threads, "thread counts, e.g. 1,2")
        ->delimiter(',')
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    command->add_option("--min-time", arguments->seconds, "seconds a row")
        ->check(CLI::Range(0.01, 3600.0))
        ->capture_default_str();
    command->callback([arguments] { run_bench(*arguments); });
}
