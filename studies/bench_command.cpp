#include "app/bench_arguments.hpp"
#include "studies/commands.hpp"
#include "studies/solvers/solver_benchmark.hpp"

#include <CLI/CLI.hpp>

#include <memory>

namespace {

using namespace hybmss;

constexpr Benchmark kBenchmarks[] = {
    {"limits", "what the machine can do, and how much of it the lattice step takes", bench::limits_benchmark},
    {"digits", "springs by displacements and positions, by estimated and exact roots: error and time",
     bench::digit_benchmark},
    {"scaling", "cubes of 10^3 to 128^3 cells; with --large 256^3 too", bench::scaling_benchmark},
    {"batch", "64 small bodies stepped side by side", bench::batch_benchmark},
    {"memory", "bytes per node and cell; times nothing", bench::memory_table},
    {"ratios", "models, numberings and fillings, each against another body in the same rounds", bench::ratio_benchmark},
    {"hessian", "second derivatives times a vector, against the step", bench::hessian_benchmark},
    {"solvers", "equilibria by mesh, Poisson's ratio and preconditioner, beside CalculiX; with --large 64^3 cells too",
     bench::solver_benchmark},
    {"cutting", "cells removed from moving bodies", bench::cutting_benchmark},
    {"embedding", "calls in C, and over interleaved memory, against native ones", bench::embedding_benchmark}};

} // namespace

void add_bench_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("bench", "measure what the program's own benchmark leaves out");
    command->require_subcommand(1);
    for (const Benchmark& benchmark : kBenchmarks) {
        const auto arguments = std::make_shared<BenchArguments>();
        CLI::App* one = command->add_subcommand(benchmark.name, benchmark.about);
        arguments->add_to(*one);
        one->add_flag("--large", arguments->large, "the largest bodies too, where a benchmark has some");
        one->callback([arguments, &benchmark] { run_benchmark(benchmark, *arguments); });
    }
}
