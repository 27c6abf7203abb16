#pragma once

#include "plan/tuning/candidates.hpp"
#include "plan/tuning/tuner_subject.hpp"

#include <memory>

namespace hybmss {

/// A body made as the options' effort says, and why it is so.
template <class T>
struct PlannedBody {
    std::unique_ptr<Body<T>> body;
    PlanOptions choice; ///< that made it
    Effort effort = Effort::estimate;
    std::string reason;
    std::vector<CandidateFigure> figures;

    PlanDescription describe() const;
};

/// Throws std::invalid_argument for options that cannot be met, `stored` without a fitting entry among them.
template <class T>
PlannedBody<T> plan_body(const Lattice& lattice, const Material& material, const PlanOptions& options,
                         Operation operation);
template <class T>
PlannedBody<T> plan_body(const Network& network, const PlanOptions& options, Operation operation);

} // namespace hybmss
