#include "studies/stability/hard_case.hpp"

#include "hybmss/simulation/scene.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hybmss::stability {
namespace {

bool is_number(const std::optional<double>& figure) {
    return !figure || std::isfinite(*figure);
}

Outcome wrong(std::string reason) {
    return {Ending::wrong, std::move(reason), {}, {}, {}, {}};
}

Outcome run_unchecked(const HardCase& hard_case) {
    try {
        return hard_case.run();
    } catch (const Wrong& found) {
        return wrong(found.reason);
    } catch (const std::invalid_argument& refused) {
        return error(refused.what());
    } catch (const SceneError& refused) {
        return error(refused.what());
    } catch (const std::exception& other) {
        return wrong(fmt::format("exception that is no refusal: {}", other.what()));
    }
}

/// What makes an outcome WRONG whatever the case says of itself; "" where nothing does.
std::string objection(const HardCase& hard_case, const Outcome& outcome) {
    if (!is_number(outcome.min_cell_volume_ratio) || !is_number(outcome.residual) || !is_number(outcome.energy_drift)) {
        return "a figure is not a finite number";
    }
    if (outcome.ending == Ending::error) {
        if (outcome.how.empty() || outcome.how.find('\n') != std::string::npos) {
            return "the error is not one line";
        }
        if (hard_case.wanted == Wanted::answer) {
            return "an error where there is an answer";
        }
    }
    if (outcome.ending == Ending::right && hard_case.wanted == Wanted::error) {
        return "an answer where an error is due";
    }
    return "";
}

} // namespace

std::string_view name(Ending ending) {
    switch (ending) {
    case Ending::right:
        return "right";
    case Ending::error:
        return "error";
    default:
        return "WRONG";
    }
}

Outcome run_case(const HardCase& hard_case) {
    Outcome outcome = run_unchecked(hard_case);
    if (const std::string reason = objection(hard_case, outcome); !reason.empty()) {
        outcome.ending = Ending::wrong;
        outcome.how = fmt::format("{}: {}", reason, outcome.how);
    }
    return outcome;
}

void require(bool good, const std::string& reason) {
    if (!good) {
        throw Wrong{reason};
    }
}

Outcome right(std::string how) {
    return {Ending::right, std::move(how), {}, {}, {}, {}};
}

Outcome error(std::string how) {
    return {Ending::error, std::move(how), {}, {}, {}, {}};
}

std::vector<HardCase> hard_cases(SpringForm springs) {
    std::vector<HardCase> cases;
    append_recovery_cases(cases, springs);
    append_shape_cases(cases, springs);
    append_precision_cases(cases, springs);
    append_long_run_cases(cases, springs);
    append_time_step_cases(cases, springs);
    append_bad_number_cases(cases, springs);
    append_static_cases(cases, springs);
    append_solver_cases(cases, springs);
    return cases;
}

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
