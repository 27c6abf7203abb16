#include "app/command_line.hpp"
#include "app/commands.hpp"
#include "app/json_file.hpp"
#include "bench/effects/cutting_benchmark.hpp"
#include "bench/effects/effects_benchmark.hpp"
#include "bench/effects/embedding_benchmark.hpp"
#include "bench/limits/limits_benchmark.hpp"
#include "bench/scaling/batch_benchmark.hpp"
#include "bench/scaling/memory_table.hpp"
#include "bench/scaling/scaling_benchmark.hpp"
#include "bench/solvers/hessian_benchmark.hpp"
#include "bench/step/digit_benchmark.hpp"
#include "bench/step/ratio_benchmark.hpp"
#include "bench/step/step_benchmark.hpp"

#include <CLI/CLI.hpp>

#include <iostream>
#include <memory>

namespace {

using namespace hybmss;

struct BenchArguments {
    std::string json, filter, instruction_set = "automatic", layout, accuracy = "accurate";
    std::vector<int> threads = {1, 2};
    double seconds = 0.5;
    bool quick = false, limits = false, scaling = false, large = false, memory = false, batch = false, hessian = false;
    bool cutting = false, digits = false, effects = false, ratios = false, embedding = false;
};

/// What is measured, and the words above its table.
struct Selection {
    std::vector<bench::Row> rows;
    std::string introduction;
};

std::vector<std::string> layouts(const BenchArguments& arguments, std::vector<std::string> otherwise) {
    if (arguments.layout.empty()) {
        return otherwise;
    }
    if (arguments.layout == "all") {
        return bench::row_layouts();
    }
    bench::check_layout(arguments.layout);
    return {arguments.layout};
}

Selection select(const BenchArguments& arguments) {
    bench::RowChoices choices;
    choices.instruction_sets =
        arguments.instruction_set == "all"
            ? available_instruction_sets()
            : std::vector<InstructionSet>{resolve(parse_instruction_set(arguments.instruction_set))};
    choices.threads = arguments.threads;
    choices.accuracy = parse_accuracy(arguments.accuracy);
    if (arguments.limits) {
        return {bench::limits_benchmark(choices, arguments.seconds), bench::kLimitsIntroduction};
    }
    if (arguments.scaling) {
        choices.layouts = layouts(arguments, {"lattice"});
        return {bench::scaling_benchmark(choices, arguments.large, arguments.seconds), bench::kScalingIntroduction};
    }
    if (arguments.batch) {
        choices.layouts = layouts(arguments, {"lattice"});
        return {bench::batch_benchmark(choices, arguments.seconds), bench::kBatchIntroduction};
    }
    if (arguments.memory) {
        choices.layouts = layouts(arguments, bench::row_layouts());
        return {bench::memory_table(choices), bench::kMemoryIntroduction};
    }
    if (arguments.cutting) {
        choices.layouts = layouts(arguments, {"flat-rows", "active-rows"});
        return {bench::cutting_benchmark(choices), bench::kCuttingIntroduction};
    }
    if (arguments.ratios) {
        return {bench::ratio_benchmark(choices, arguments.seconds), bench::kRatioIntroduction};
    }
    if (arguments.digits) {
        return {bench::digit_benchmark(choices.instruction_sets, arguments.seconds), bench::kDigitIntroduction};
    }
    if (arguments.embedding) {
        return {bench::embedding_benchmark(arguments.seconds), bench::kEmbeddingIntroduction};
    }
    if (arguments.effects) {
        return {bench::effects_benchmark(choices, arguments.seconds), bench::kEffectsIntroduction};
    }
    choices.layouts = layouts(arguments, {"lattice", "network"});
    if (arguments.hessian) {
        return {bench::hessian_benchmark(bench::step_rows(choices, arguments.quick), arguments.seconds),
                bench::kHessianIntroduction};
    }
    return {bench::step_benchmark(bench::step_rows(choices, arguments.quick), arguments.seconds),
            bench::kStepIntroduction};
}

void run_bench(const BenchArguments& arguments) {
    Selection selection = select(arguments);
    bench::filter_rows(selection.rows, arguments.filter);
    const auto json = open_json_file(arguments.json);
    const bool good =
        bench::run_rows(selection.rows, selection.introduction, std::cout, json ? &json->stream() : nullptr);
    if (json) {
        json->commit();
    }
    if (!good) {
        throw CLI::RuntimeError(1);
    }
}

} // namespace

void add_bench_command(CLI::App& app) {
    const auto arguments = std::make_shared<BenchArguments>();
    CLI::App* command = app.add_subcommand("bench", "measure the explicit step against the scalar yardstick");
    command->add_option("--json", arguments->json, "also write Google Benchmark's JSON to this file")->check(a_path());
    command->add_flag("--quick", arguments->quick, "two meshes and two models only");
    auto* instead = command->add_option_group("instead of the matrix", "at most one of:");
    instead->require_option(0, 1);
    auto* limits = instead->add_flag("--limits", arguments->limits,
                                     "what the machine can do, and how much of it the lattice step takes");
    instead->add_flag("--scaling", arguments->scaling, "cubes of 10^3 to 128^3 cells");
    instead->add_flag("--memory", arguments->memory, "bytes per node and cell; times nothing");
    instead->add_flag("--batch", arguments->batch, "64 small bodies stepped side by side");
    instead->add_flag("--ratios", arguments->ratios,
                      "models, numberings and fillings, each against another body in the same rounds");
    instead->add_flag("--hessian", arguments->hessian, "second derivatives times a vector, against the step");
    instead->add_flag("--effects", arguments->effects, "what each effect of a scene adds to the step");
    instead->add_flag("--cutting", arguments->cutting, "cells removed from moving bodies");
    instead->add_flag("--embedding", arguments->embedding,
                      "calls in C, and over interleaved memory, against native ones");
    instead->add_flag("--digits", arguments->digits,
                      "springs by displacements and positions, by estimated and exact roots: error and time");
    command->add_flag("--large", arguments->large, "with --scaling: 256^3 cells too");
    command->add_option("--filter", arguments->filter, "only rows whose name matches this regular expression");
    command
        ->add_option("--isa", arguments->instruction_set, "sse2, avx2, avx512, neon, automatic, or all of this machine")
        ->capture_default_str();
    command
        ->add_option("--layout", arguments->layout,
                     "a layout's name; lattice or network: the plan's choice for a body so given; or all")
        ->excludes(limits);
    command->add_option("--accuracy", arguments->accuracy, "fast, accurate or exact")
        ->check(CLI::IsMember({"fast", "accurate", "exact"}))
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
