#pragma once

#include "hybmss/hybmss.h"
#include "hybmss/plan_options.hpp"
#include "hybmss/task_runner.hpp"

namespace hybmss::c_interface {

/// Options in the library's words, and what they point to. Not to be moved.
struct GivenOptions {
    /// Null: the defaults. Throws std::invalid_argument.
    explicit GivenOptions(const hybmss_plan_options* given);
    GivenOptions(const GivenOptions&) = delete;
    GivenOptions& operator=(const GivenOptions&) = delete;

    TaskRunner runner;
    PlanOptions options;
};

/// Throws std::invalid_argument for a number that names none. True for double.
bool is_double(hybmss_precision precision, const char* name);

} // namespace hybmss::c_interface
