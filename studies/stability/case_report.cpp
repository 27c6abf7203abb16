#include "studies/stability/case_report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace hybmss::stability {
namespace {

std::string cell(const std::optional<double>& figure, const char* format) {
    return figure ? fmt::format(fmt::runtime(format), *figure) : "-";
}

template <class T>
nlohmann::ordered_json value(const std::optional<T>& figure) {
    return figure ? nlohmann::ordered_json(*figure) : nlohmann::ordered_json();
}

} // namespace

CaseCount count(const std::vector<CaseRow>& rows) {
    CaseCount sum;
    for (const CaseRow& row : rows) {
        ++(row.outcome.ending == Ending::right   ? sum.right
           : row.outcome.ending == Ending::error ? sum.error
                                                 : sum.wrong);
    }
    return sum;
}

void print_cases(const std::vector<CaseRow>& rows, std::ostream& out) {
    std::size_t width = 4;
    for (const CaseRow& row : rows) {
        width = std::max(width, row.hard_case.name.size());
    }
    out << fmt::format("{:<{}}  {:<6}{:>9}{:>10}{:>10}{:>10}  {}\n", "case", width, "ending", "min J", "residual",
                       "drift", "iter.", "asked => what came out");
    for (const CaseRow& row : rows) {
        const Outcome& o = row.outcome;
        out << fmt::format("{:<{}}  {:<6}{:>9}{:>10}{:>10}{:>10}  {} => {}\n", row.hard_case.name, width,
                           name(o.ending), cell(o.min_cell_volume_ratio, "{:.3f}"), cell(o.residual, "{:.1e}"),
                           cell(o.energy_drift, "{:.1e}"), o.iterations ? std::to_string(*o.iterations) : "-",
                           row.hard_case.asked, o.how);
    }
    const CaseCount sum = count(rows);
    out << fmt::format("\n{} cases: {} right, {} ended in one clear error, {} WRONG\n", sum.total(), sum.right,
                       sum.error, sum.wrong);
}

nlohmann::ordered_json cases_json(const std::vector<CaseRow>& rows) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const CaseRow& row : rows) {
        const Outcome& o = row.outcome;
        all.push_back({{"name", row.hard_case.name},
                       {"asked", row.hard_case.asked},
                       {"ending", name(o.ending)},
                       {"how", o.how},
                       {"min_cell_volume_ratio", value(o.min_cell_volume_ratio)},
                       {"residual", value(o.residual)},
                       {"energy_drift", value(o.energy_drift)},
                       {"iterations", value(o.iterations)},
                       {"seconds", row.seconds}});
    }
    const CaseCount sum = count(rows);
    return {{"right", sum.right}, {"error", sum.error}, {"wrong", sum.wrong}, {"cases", all}};
}

} // namespace hybmss::stability
