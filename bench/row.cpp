#include "bench/row.hpp"

#include "bench/machine.hpp"

#include <algorithm>
#include <map>
#include <regex>
#include <stdexcept>
#include <utility>

namespace hybmss::bench {
namespace {

/// Prints the rows as a table while they are measured, and writes them as Google Benchmark's JSON. `json` may be null.
class RowReporter : public benchmark::BenchmarkReporter {
public:
    RowReporter(const std::vector<Row>& rows, std::string introduction, std::ostream& table, std::ostream* json)
        : introduction_(std::move(introduction)), table_(table), write_json_(json != nullptr) {
        for (const Row& row : rows) {
            rows_.emplace(row.name, &row);
        }
        if (write_json_) {
            json_.SetOutputStream(json);
            json_.SetErrorStream(json);
        }
    }

    bool ReportContext(const Context& context) override {
        for (const auto& [key, value] : machine_description()) {
            benchmark::AddCustomContext(key, value);
        }
        table_ << machine_line() << '\n' << introduction_;
        return !write_json_ || json_.ReportContext(context);
    }

    void ReportRuns(const std::vector<Run>& runs) override {
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

    void Finalize() override {
        if (write_json_) {
            json_.Finalize();
        }
    }

    bool failed() const { return failed_; }

private:
    void print(const Row& row, const Run& run) {
        if (row.heading != heading_) {
            table_ << (heading_.empty() ? "" : "\n") << row.heading << '\n';
            heading_ = row.heading;
        }
        if (run.error_occurred) {
            table_ << "    " << row.name << ": " << run.error_message << std::endl;
        } else {
            table_ << row.line(run) << std::endl;
        }
    }

    std::map<std::string, const Row*> rows_;
    std::string introduction_;
    std::ostream& table_;
    bool write_json_;
    benchmark::JSONReporter json_;
    std::string heading_;
    bool failed_ = false;
};

} // namespace

double counter(const benchmark::BenchmarkReporter::Run& run, const char* key) {
    const auto found = run.counters.find(key);
    return found == run.counters.end() ? 0.0 : found->second.value;
}

void filter_rows(std::vector<Row>& rows, const std::string& expression) {
    const std::string example = rows.empty() ? "" : rows.front().name;
    try {
        const std::regex filter(expression);
        std::erase_if(rows, [&](const Row& row) { return !std::regex_search(row.name, filter); });
    } catch (const std::regex_error& error) {
        throw std::invalid_argument("--filter " + expression + ": not a regular expression: " + error.what());
    }
    if (rows.empty()) {
        throw std::invalid_argument("--filter " + expression + ": no row matches (they are named like " + example +
                                    ")");
    }
}

bool run_rows(const Table& measured, std::ostream& table, std::ostream* json) {
    for (const Row& row : measured.rows) {
        const auto guarded = [measure = row.measure](benchmark::State& state) {
            try {
                measure(state);
            } catch (const std::exception& error) {
                state.SkipWithError(error.what());
            }
        };
        benchmark::RegisterBenchmark(row.name.c_str(), guarded)->UseManualTime()->Iterations(row.rounds);
    }
    RowReporter reporter(measured.rows, measured.introduction, table, json);
    std::string program = "hybmss bench";
    char* argv[] = {program.data()};
    int argc = 1;
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks(&reporter, ".*");
    benchmark::Shutdown();
    return !reporter.failed();
}

} // namespace hybmss::bench
