#pragma once

/// \file
/// Prints the rows as a table while they are measured, and writes them as Google Benchmark's JSON.

#include "bench/row.hpp"

#include <map>
#include <ostream>
#include <string>

namespace hybmss::bench {

/// Reports `rows` (those that were registered), which must outlive it. `json` may be null.
class RowReporter : public benchmark::BenchmarkReporter {
public:
    RowReporter(const std::vector<Row>& rows, std::string introduction, std::ostream& table, std::ostream* json);

    bool ReportContext(const Context& context) override;
    void ReportRuns(const std::vector<Run>& runs) override;
    void Finalize() override;

    bool failed() const { return failed_; }

private:
    void print(const Row& row, const Run& run);

    std::map<std::string, const Row*> rows_;
    std::string introduction_;
    std::ostream& table_;
    bool write_json_;
    benchmark::JSONReporter json_;
    std::string heading_;
    bool failed_ = false;
};

} // namespace hybmss::bench
