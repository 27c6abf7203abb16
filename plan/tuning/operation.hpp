#pragma once

namespace hybmss {

/// What a plan is for: it is what gets timed.
enum class Operation {
    step,  ///< ExplicitDynamics::step
    forces ///< ForcePlan::add_forces
};

} // namespace hybmss
