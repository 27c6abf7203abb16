#include "bench/row_reporter.hpp"

#include "bench/machine.hpp"

#include <utility>

namespace hybmss::bench {

RowReporter::RowReporter(const std::vector<Row>& rows, std::string introduction, std::ostream& table,
                         std::ostream* json)
    : introduction_(std::move(introduction)), table_(table), write_json_(json != nullptr) {
    for (const Row& row : rows) {
        rows_.emplace(row.name, &row);
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
    table_ << introduction_;
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
        run.threads = found->second->threads;
        failed_ = failed_ || run.error_occurred;
        print(*found->second, run);
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

void RowReporter::print(const Row& row, const Run& run) {
    if (row.heading != heading_) {
        heading_ = row.heading;
        table_ << '\n' << heading_ << '\n';
    }
    if (run.error_occurred) {
        table_ << "    " << row.name << ": " << run.error_message << std::endl;
    } else {
        table_ << row.line(run) << std::endl;
    }
}

} // namespace hybmss::bench
