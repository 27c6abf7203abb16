#include "bench/row.hpp"

#include "bench/row_reporter.hpp"

#include <algorithm>
#include <regex>
#include <stdexcept>

namespace hybmss::bench {

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

bool run_rows(const std::vector<Row>& rows, const std::string& introduction, std::ostream& table, std::ostream* json) {
    for (const Row& row : rows) {
        const auto guarded = [measure = row.measure](benchmark::State& state) {
            try {
                measure(state);
            } catch (const std::exception& error) {
                state.SkipWithError(error.what());
            }
        };
        benchmark::RegisterBenchmark(row.name.c_str(), guarded)->UseManualTime()->Iterations(row.rounds);
    }
    RowReporter reporter(rows, introduction, table, json);
    std::string program = "hybmss bench";
    char* argv[] = {program.data()};
    int argc = 1;
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks(&reporter, ".*");
    benchmark::Shutdown();
    return !reporter.failed();
}

} // namespace hybmss::bench
