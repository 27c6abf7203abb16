#pragma once

#include "solvers/multigrid/multigrid.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace hybmss {

/// Multigrid in float for a solve in double: a product with the finest level's second derivatives takes half the time,
/// and of what only preconditions a few digits will do. Holds the body once more, in float.
///
/// Stiffness and pull are scaled so that no material, and residuals so that no load, leaves float's range.
class FloatMultigrid final : public Preconditioner<double> {
public:
    /// `choice`: what the body in double was made with. `ranks`: as Multigrid's.
    FloatMultigrid(const Body<double>& body, const Lattice& lattice, const Material& material,
                   const PlanOptions& choice, const Ranks* ranks = nullptr);

    void update(const Potential<double>& potential) override;
    void apply(const NodeVector<double>& r, NodeVector<double>& z) override;
    std::string_view name() const override { return multigrid_.name(); }

    /// As Multigrid's.
    std::vector<double> memory() const;
    void set_memory(const VectorSpace<double>&, std::span<const double> values);

private:
    void to_float(const NodeField<double>& from, double factor, NodeField<float>& to);

    const Body<double>* given_;
    const VectorSpace<double>* space_ = nullptr; ///< of the last update
    double scale_;                               ///< of the stiffness
    std::unique_ptr<Body<float>> body_;
    State<float> state_;
    Potential<float> potential_;
    Multigrid multigrid_;
    NodeVector<float> in_, out_;
    bool same_places_;            ///< of the nodes in both bodies
    std::vector<double> doubles_; ///< x y z a node, in the body's order; empty where places are the same
    std::vector<float> floats_;
    std::vector<std::uint8_t> held_;
};

} // namespace hybmss
