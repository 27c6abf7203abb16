#include "integrations/petsc/motion.hpp"

namespace hybmss::distributed {
namespace {

/// PETSc's symplectic Euler (TSBASICSYMPLECTIC) over vectors of PETSc's: all displacements of a rank before all its
/// velocities, so that both are views of one state and nothing is copied.
class TsMotion final : public Motion {
public:
    TsMotion(BlockForces& forces, const Supports& supports)
        : forces_(forces), held_(held_components(forces.block(), supports)) {
        PetscInt size = 0, first = 0;
        check(VecGetLocalSize(forces.masses(), &size));
        const MPI_Comm communicator = forces.block().communicator();
        check(VecCreateMPI(communicator, 2 * size, PETSC_DETERMINE, state_.make()));
        check(VecGetOwnershipRange(state_, &first, nullptr));
        check(ISCreateStride(communicator, size, first, 1, positions_.make()));
        check(ISCreateStride(communicator, size, first + size, 1, velocities_.make()));
        check(TSCreate(communicator, ts_.make()));
        check(TSSetType(ts_, TSBASICSYMPLECTIC));
        check(TSBasicSymplecticSetType(ts_, TSBASICSYMPLECTICSIEULER));
        check(TSRHSSplitSetIS(ts_, "position", positions_));
        check(TSRHSSplitSetIS(ts_, "momentum", velocities_));
        check(TSRHSSplitSetRHSFunction(ts_, "position", nullptr, position_rate, this));
        check(TSRHSSplitSetRHSFunction(ts_, "momentum", nullptr, velocity_rate, this));
        check(TSSetExactFinalTime(ts_, TS_EXACTFINALTIME_STEPOVER));
        check(TSSetMaxTime(ts_, PETSC_MAX_REAL));

        OwnedVec start;
        check(VecDuplicate(forces.masses(), start.make()));
        check(VecSet(start, 0));
        set_held(start, held_);
        check(VecSet(state_, 0));
        copy(start, positions_, Direction::in);
    }

    void step(const StepParameters& parameters, long count) override {
        if (parameters.mass_damping != 0) {
            throw std::invalid_argument("mass_damping = " + std::to_string(parameters.mass_damping) +
                                        " is not allowed with the method ts: PETSc's symplectic steps take forces that "
                                        "depend on positions alone");
        }
        gravity_ = parameters.acceleration;
        check(TSSetTime(ts_, 0));
        check(TSSetStepNumber(ts_, 0));
        check(TSSetTimeStep(ts_, parameters.time_step));
        check(TSSetMaxSteps(ts_, static_cast<PetscInt>(count)));
        check(TSSolve(ts_, state_));
    }

    void get_state(Vec displacement, Vec velocity) override {
        copy(displacement, positions_, Direction::out);
        copy(velocity, velocities_, Direction::out);
    }
    void set_state(Vec displacement, Vec velocity) override {
        copy(displacement, positions_, Direction::in);
        copy(velocity, velocities_, Direction::in);
    }
    void get_displacement(Vec displacement) override { copy(displacement, positions_, Direction::out); }

private:
    enum class Direction { in, out };
    void copy(Vec field, IS part, Direction direction) {
        Vec view = nullptr;
        check(VecGetSubVector(state_, part, &view));
        check(direction == Direction::in ? VecCopy(field, view) : VecCopy(view, field));
        check(VecRestoreSubVector(state_, part, &view));
    }

    /// f/m + g, zero where a node is held or has no mass.
    void get_acceleration(Vec displacement, Vec acceleration) {
        forces_.set_displacement(displacement);
        forces_.get_forces(acceleration);
        const PetscScalar* m = nullptr;
        PetscScalar* a = nullptr;
        PetscInt size = 0;
        check(VecGetLocalSize(acceleration, &size));
        check(VecGetArrayRead(forces_.masses(), &m));
        check(VecGetArray(acceleration, &a));
        for (PetscInt i = 0; i < size; ++i) {
            a[i] = m[i] > 0 ? a[i] / m[i] + gravity_[static_cast<std::size_t>(i % 3)] : 0;
        }
        check(VecRestoreArray(acceleration, &a));
        check(VecRestoreArrayRead(forces_.masses(), &m));
        clear_held(acceleration, held_);
    }

    static PetscErrorCode position_rate(TS, PetscReal, Vec velocity, Vec rate, void*) {
        return VecCopy(velocity, rate);
    }
    static PetscErrorCode velocity_rate(TS, PetscReal, Vec displacement, Vec rate, void* self) {
        return guarded([&] { static_cast<TsMotion*>(self)->get_acceleration(displacement, rate); });
    }

    BlockForces& forces_;
    std::vector<HeldComponent> held_;
    std::array<double, 3> gravity_ = {0, 0, 0};
    OwnedVec state_;
    OwnedIs positions_, velocities_;
    OwnedTs ts_;
};

} // namespace

std::unique_ptr<Motion> make_ts_motion(BlockForces& forces, const Supports& supports) {
    return std::make_unique<TsMotion>(forces, supports);
}

} // namespace hybmss::distributed
