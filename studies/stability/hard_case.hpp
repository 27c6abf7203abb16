#pragma once

/// \file
/// One hard case: what is asked, how it is run, how it may end; and all of them as a table and as JSON.

#include "hybmss/material.hpp"

#include <nlohmann/json_fwd.hpp>

#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace hybmss::stability {

enum class Ending {
    right, ///< the answer that the equations call for
    error, ///< one clear line that says why there is none
    wrong  ///< anything else
};

/// "right", "error" or "WRONG".
std::string_view name(Ending ending);

/// What came of a case. Figures that a case does not have stay empty.
struct Outcome {
    Ending ending = Ending::wrong;
    std::string how; ///< what came out, or the error's own text, or what is wrong
    std::optional<double> min_cell_volume_ratio;
    std::optional<double> residual;     ///< unbalanced force, relative to what the case names its scale
    std::optional<double> energy_drift; ///< relative; of the total energy where it should stay, else what it rose by
    std::optional<long> iterations;     ///< Hessian products of a static solve, steps of a motion
};

/// How a case must end. An error in place of an answer is WRONG, and so is the reverse, unless both are allowed.
enum class Wanted { answer, error, answer_or_error };

struct HardCase {
    std::string name;  ///< "group: what", unique
    std::string asked; ///< what must come out, for a reader
    Wanted wanted = Wanted::answer;
    bool quick = false; ///< well below a second: part of the tests
    std::function<Outcome()> run;
};

/// Runs it. std::invalid_argument and SceneError are its errors; any other exception, an error of several lines, a
/// figure that is not a number, and an ending that is not wanted make it WRONG.
Outcome run_case(const HardCase& hard_case);

/// Ends a case as WRONG with the reason, unless `good`.
struct Wrong {
    std::string reason;
};
void require(bool good, const std::string& reason);

Outcome right(std::string how);
Outcome error(std::string how);

/// Every case there is, in the order of the table, of bodies with such springs.
std::vector<HardCase> hard_cases(SpringForm springs);

// The cases by subject: each appends its own.
void append_recovery_cases(std::vector<HardCase>& cases, SpringForm springs);
void append_shape_cases(std::vector<HardCase>& cases, SpringForm springs);
void append_precision_cases(std::vector<HardCase>& cases, SpringForm springs);
void append_long_run_cases(std::vector<HardCase>& cases, SpringForm springs);
void append_time_step_cases(std::vector<HardCase>& cases, SpringForm springs);
void append_bad_number_cases(std::vector<HardCase>& cases, SpringForm springs);
void append_static_cases(std::vector<HardCase>& cases, SpringForm springs);
void append_solver_cases(std::vector<HardCase>& cases, SpringForm springs);

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
