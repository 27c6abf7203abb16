#include "app/bench_arguments.hpp"

#include "app/command_line.hpp"

#include <iostream>

namespace hybmss {
namespace {

bench::RowChoices choices_of(const BenchArguments& arguments) {
    bench::RowChoices choices;
    choices.instruction_sets =
        arguments.instruction_set == "all"
            ? available_instruction_sets()
            : std::vector<InstructionSet>{resolve(parse_instruction_set(arguments.instruction_set))};
    if (arguments.layout == "all") {
        choices.layouts = bench::row_layouts();
    } else if (!arguments.layout.empty()) {
        bench::check_layout(arguments.layout);
        choices.layouts = {arguments.layout};
    }
    choices.threads = arguments.threads;
    choices.accuracy = parse_accuracy(arguments.accuracy);
    choices.seconds = arguments.seconds;
    choices.quick = arguments.quick;
    choices.large = arguments.large;
    return choices;
}

} // namespace

void BenchArguments::add_to(CLI::App& command) {
    command.add_option("--json", json, "also write Google Benchmark's JSON to this file")->check(a_path());
    add_force_option(command, force);
    command.add_flag("--quick", quick, "the rows that tell most: two cubes of the full model, one thread");
    command.add_option("--filter", filter, "only rows whose name matches this regular expression");
    command.add_option("--isa", instruction_set, "sse2, avx2, avx512, neon, automatic, or all of this machine")
        ->capture_default_str();
    command.add_option("--layout", layout,
                       "a layout's name; lattice or network: the plan's choice for a body so given; or all");
    command.add_option("--accuracy", accuracy, "fast, accurate or exact")
        ->check(CLI::IsMember({"fast", "accurate", "exact"}))
        ->capture_default_str();
    command.add_option("--threads", threads, "thread counts, e.g. 1,2; default: those, with --quick 1")
        ->delimiter(',')
        ->check(whole_number(1, 1024));
    command.add_option("--min-time", seconds, "seconds a row")->check(number(0.01, 3600))->capture_default_str();
}

void run_benchmark(const Benchmark& benchmark, const BenchArguments& arguments) {
    bench::Table table = benchmark.make(choices_of(arguments));
    bench::filter_rows(table.rows, arguments.filter);
    const auto json = open_output("--json", arguments.json, {"{\"context\":", {}, arguments.force});
    const bool good = bench::run_rows(table, std::cout, json ? &json->stream() : nullptr);
    if (json) {
        json->commit();
    }
    if (!good) {
        throw CLI::RuntimeError(1);
    }
}

} // namespace hybmss
