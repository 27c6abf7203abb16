#pragma once

/// \file
/// The hard cases as a table and as JSON.

#include "studies/stability/hard_case.hpp"

#include <nlohmann/json_fwd.hpp>

#include <ostream>
#include <vector>

namespace hybmss::stability {

struct CaseRow {
    HardCase hard_case;
    Outcome outcome;
    double seconds = 0;
};

/// How many ended in each way.
struct CaseCount {
    int right = 0, error = 0, wrong = 0;
    int total() const { return right + error + wrong; }
};
CaseCount count(const std::vector<CaseRow>& rows);

void print_cases(const std::vector<CaseRow>& rows, std::ostream& out);
nlohmann::ordered_json cases_json(const std::vector<CaseRow>& rows);

} // namespace hybmss::stability
