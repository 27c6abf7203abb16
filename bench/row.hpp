#pragma once

/// \file
/// One row of a benchmark: its name, how it is measured and how it is printed.

#include "layouts/messages.hpp"

#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <vector>

namespace hybmss::bench {

struct Row {
    std::string name; ///< says all of what is measured, e.g. "step/10x10x10/HybMSS/lattice/avx2/float/threads:1"
    int threads = 1;
    std::string heading; ///< printed before the first of several rows that share it
    long rounds = 1;     ///< iterations of the state
    /// One round per iteration, in manual time; then sets the counters. May throw: the row then ends with an error.
    std::function<void(benchmark::State&)> measure;
    /// The printed line, without its end.
    std::function<std::string(const benchmark::BenchmarkReporter::Run&)> line;
};

/// A benchmark, ready to be measured: the words above its rows, and these.
struct Table {
    std::string introduction;
    std::vector<Row> rows;
};

/// The value of a counter; 0 where the row did not set it.
double counter(const benchmark::BenchmarkReporter::Run& run, const char* key);

/// Keeps the rows whose name the regular expression matches. Throws std::invalid_argument for an expression that is
/// none, or that no row matches.
void filter_rows(std::vector<Row>& rows, const std::string& expression);

/// Measures and prints the rows in order; `json` may be null. False where a row ended with an error.
bool run_rows(const Table& measured, std::ostream& table, std::ostream* json);

} // namespace hybmss::bench
