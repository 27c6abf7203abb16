#include "studies/stability/hard_case.hpp"

#include "hybmss/simulation/scene.hpp"

#include <fmt/format.h>

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

std::vector<HardCase> hard_cases() {
    std::vector<HardCase> cases;
    append_recovery_cases(cases);
    append_shape_cases(cases);
    append_precision_cases(cases);
    append_long_run_cases(cases);
    append_time_step_cases(cases);
    append_bad_number_cases(cases);
    append_static_cases(cases);
    append_solver_cases(cases);
    return cases;
}

} // namespace hybmss::stability
