#pragma once

/// \file
/// Prints the rows as a table while they are measured, and writes them as Google Benchmark's JSON.

#include "bench/bench_row.hpp"

#include <benchmark/benchmark.h>

#include <map>
#include <ostream>
#include <string>

namespace hybmss::bench {

/// Reports `rows` (those that were registered). `json` may be null.
class RowReporter : public benchmark::BenchmarkReporter {
public:
    RowReporter(const std::vector<BenchRow>& rows, std::ostream& table, std::ostream* json);

    bool ReportContext(const Context& context) override;
    void ReportRuns(const std::vector<Run>& runs) override;
    void Finalize() override;

    bool failed() const { return failed_; }

private:
    void print(const BenchRow& row, const Run& run);

    std::map<std::string, BenchRow> rows_;
    std::ostream& table_;
    bool write_json_;
    benchmark::JSONReporter json_;
    std::string group_;
    bool failed_ = false;
};

} // namespace hybmss::bench
