#pragma once

#include "plan/bodies/lattice_body.hpp"

namespace hybmss {

/// A lattice in the layout gather-rows (see flat_rows): each node collects its own forces, plane by plane in any order.
///
/// No joins, no buffers, and sums that depend on nothing but the node. For that every spring is computed at both of its
/// ends and every cell's volume at all eight corners, and forces and integration are two passes. What is not forces or
/// steps is as in flat rows.
template <class T>
class GatherBody final : public LatticeBody<T> {
public:
    GatherBody(const Lattice& lattice, const Material& material, const PlanOptions& options);

    PlanDescription describe() const override;
    std::vector<Stage> force_stages(State<T>& state) const override;
    std::vector<Stage> step_stages(State<T>& state, const StepParameters& parameters) const override;

private:
    Stage gathering(State<T>& state) const;
};

extern template class GatherBody<float>;
extern template class GatherBody<double>;

} // namespace hybmss
