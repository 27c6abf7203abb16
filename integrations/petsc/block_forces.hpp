#pragma once

#include "integrations/petsc/block.hpp"

#include "hybmss/force_plan.hpp"

#include <memory>
#include <vector>

namespace hybmss::distributed {

/// Forces, second derivatives and energy of the whole body, each rank by a plan for its block. Vectors are those of
/// Block::nodes(): three components a node, m and N. Nothing is added across ranks but the energy, so results depend on
/// the number of ranks by rounding alone, and not at all from one run to the next.
class BlockForces {
public:
    BlockForces(const Block& block, const Material& material, const PlanOptions& options);

    const Block& block() const { return block_; }
    const Material& material() const { return material_; }
    const PlanOptions& options() const { return options_; }
    /// Nodal masses, kg: of every component; zero at nodes that touch no cell.
    Vec masses() const { return masses_; }

    /// Fetches the displacements of ghosts; those that all calls below are at. Collective.
    void set_displacement(Vec displacement);
    /// Sets `force` to the internal forces.
    void get_forces(Vec force);
    /// Sets `product` to K p. Collective: fetches the ghosts of `direction`.
    void get_hessian_product(Vec direction, Vec product);
    /// The 3x3 blocks on K's diagonal, six values an owned node: xx, yy, zz, xy, xz, yz. Zeros where no cell is.
    std::vector<double> hessian_diagonal();
    /// J, of all ranks, at a plan's expense: for the end of a run. Collective.
    double energy() const;
    /// s: the least of all ranks' bounds. Collective.
    double critical_time_step() const;

private:
    using Field = std::vector<double>; ///< x y z of every node of the rank's lattice

    void set_masses();
    void fetch(Vec owned, Field& field);
    void store(const Field& field, Vec owned) const;

    const Block& block_;
    Material material_;
    PlanOptions options_;
    std::unique_ptr<ForcePlan<double>> plan_; ///< none where the rank has no cell
    OwnedVec masses_, ghosted_;
    Field displacement_, direction_, result_;
};

} // namespace hybmss::distributed
