#pragma once

#include "integrations/petsc/block.hpp"
#include "integrations/petsc/block_forces.hpp"

#include "hybmss/explicit_dynamics.hpp"

#include <memory>

namespace hybmss::distributed {

/// A body on several ranks that takes the semi-implicit Euler steps of ExplicitDynamics, from rest. Vectors are those
/// of Block::nodes(). Every call is collective.
class Motion {
public:
    virtual ~Motion() = default;
    virtual void step(const StepParameters& parameters, long count) = 0;
    /// Sets what set_state() of a motion made in the same way goes on from to the same bits: displacements and
    /// velocities in a unit of length that is the method's own.
    virtual void get_state(Vec displacement, Vec velocity) = 0;
    virtual void set_state(Vec displacement, Vec velocity) = 0;
    /// Sets the displacements, m.
    virtual void get_displacement(Vec displacement) = 0;
};

/// The fused kernels on each rank's block, in float or double; a PetscSF brings the ghosts' displacements. `block` must
/// outlive it. Throws as a plan does.
std::unique_ptr<Motion> make_fused_motion(bool single_precision, const Block& block, const Material& material,
                                          const Supports& supports, const PlanOptions& options);

/// PETSc's TS over BlockForces, in double. Takes no mass damping: step() throws std::invalid_argument. `forces` must
/// outlive it.
std::unique_ptr<Motion> make_ts_motion(BlockForces& forces, const Supports& supports);

} // namespace hybmss::distributed
