#include "bench/row_reporter.hpp"

#include "bench/machine.hpp"

#include <cstdio>

namespace hybmss::bench {
namespace {

double counter(const benchmark::BenchmarkReporter::Run& run, const char* key) {
    const auto found = run.counters.find(key);
    return found == run.counters.end() ? 0.0 : found->second.value;
}

} // namespace

RowReporter::RowReporter(const std::vector<BenchRow>& rows, std::ostream& table, std::ostream* json)
    : table_(table), write_json_(json != nullptr) {
    for (const BenchRow& row : rows) {
        rows_.emplace(name(row), row);
    }
    if (write_json_) {
        json_.SetOutputStream(json);
        json_.SetErrorStream(json);
    }
}

bool RowReporter::ReportContext(const Context& context) {
    for (const auto& [key, value] : machine_description()) {
        benchmark::AddCustomContext(key, value);
        table_ << key << ": " << value << '\n';
    }
    table_
        << "One step = springs + volume + integration; medians of interleaved rounds; `x ref` is the speed over the\n"
           "plain double array-of-structs loops, measured in the same rounds.\n";
    return !write_json_ || json_.ReportContext(context);
}

void RowReporter::ReportRuns(const std::vector<Run>& runs) {
    std::vector<Run> named = runs;
    for (Run& run : named) {
        // Google Benchmark appends how it was told to measure; a row's name says what was measured only.
        run.run_name = {};
        run.run_name.function_name = runs.front().run_name.function_name;
        const auto found = rows_.find(run.run_name.function_name);
        if (found == rows_.end()) {
            continue;
        }
        run.threads = found->second.threads;
        failed_ = failed_ || run.error_occurred;
        print(found->second, run);
    }
    if (write_json_) {
        json_.ReportRuns(named);
    }
}

void RowReporter::Finalize() {
    if (write_json_) {
        json_.Finalize();
    }
}

void RowReporter::print(const BenchRow& row, const Run& run) {
    char line[256];
    const std::string group = mesh_name(row) + " " + name(row.model);
    if (group != group_) {
        group_ = group;
        std::snprintf(line, sizeof line, "\n%-20s %-8s %-7s %-6s %7s %5s %10s %10s %11s %10s %8s\n", group.c_str(),
                      "layout", "isa", "type", "threads", "used", "ns/cell", "Mcells/s", "Msprings/s", "bytes/cell",
                      "x ref");
        table_ << line;
    }
    if (run.error_occurred) {
        table_ << "    " << name(row) << ": " << run.error_message << std::endl;
        return;
    }
    std::snprintf(line, sizeof line, "%-20s %-8s %-7s %-6s %7d %5.0f %10.2f %10.1f %11.1f %10.1f %8.2f\n", "",
                  row.layout.c_str(), std::string(name(row.instruction_set)).c_str(), name(row.precision).c_str(),
                  row.threads, counter(run, "threads_used"), counter(run, "ns_per_cell"),
                  counter(run, "cells_per_second") / 1e6, counter(run, "springs_per_second") / 1e6,
                  counter(run, "bytes_per_cell"), counter(run, "ratio_to_reference"));
    table_ << line << std::flush;
}

} // namespace hybmss::bench
