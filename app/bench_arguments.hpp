#pragma once

/// \file
/// The options of `hybmss bench` and `hybmss-study bench`.

#include "bench/benchmarks.hpp"

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hybmss {

struct BenchArguments {
    std::string json, filter, instruction_set = "automatic", layout, accuracy = "accurate";
    std::vector<int> threads;
    double seconds = 0.5;
    bool quick = false, large = false, force = false;

    void add_to(CLI::App& command);
};

/// A benchmark as it is asked for by name.
struct Benchmark {
    const char *name, *about;
    bench::Table (*make)(const bench::RowChoices&);
};

/// Makes the rows that the arguments ask for, measures them and prints them. Throws CLI::RuntimeError(1) where one
/// ended with an error.
void run_benchmark(const Benchmark& benchmark, const BenchArguments& arguments);

} // namespace hybmss
