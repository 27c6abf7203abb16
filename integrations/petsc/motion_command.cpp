#include "integrations/petsc/commands.hpp"

#include "integrations/petsc/checkpoint.hpp"
#include "integrations/petsc/motion.hpp"

#include <petsclog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hybmss::distributed {
namespace {

void refuse_unless_one_of(const char* name, const std::string& value, const char* one, const char* other) {
    if (value != one && value != other) {
        throw std::invalid_argument(std::string(name) + " = \"" + value + "\" is not allowed: it must be " + one +
                                    " or " + other);
    }
}

RunIdentity identity_of(const MotionArguments& arguments, double time_step) {
    const BodyArguments& body = arguments.body;
    RunIdentity identity = {{"cells along x", static_cast<double>(body.cells[0])},
                            {"cells along y", static_cast<double>(body.cells[1])},
                            {"cells along z", static_cast<double>(body.cells[2])},
                            {"hollow", body.hollow ? 1.0 : 0.0},
                            {"cell size", body.cell_size},
                            {"young modulus", body.material.young_modulus},
                            {"poisson ratio", body.material.poisson_ratio},
                            {"density", body.material.density},
                            {"face diagonal ratio", body.material.face_diagonal_ratio},
                            {"gravity along x", arguments.gravity[0]},
                            {"gravity along y", arguments.gravity[1]},
                            {"gravity along z", arguments.gravity[2]},
                            {"mass damping", arguments.mass_damping},
                            {"time step", time_step},
                            {"method fused", arguments.method == "fused" ? 1.0 : 0.0},
                            {"precision float", arguments.precision == "float" ? 1.0 : 0.0}};
    if (body.material.springs == SpringForm::means) { // files of before know of nothing else
        identity.push_back({"springs on means", 1});
    }
    return identity;
}

/// Steps from `done` on, with checkpoints on the way; returns the seconds that the steps took.
double take_steps(const MotionArguments& arguments, const Block& block, const StepParameters& parameters, long done,
                  Motion& motion, Vec displacement, Vec velocity) {
    const RunIdentity identity = identity_of(arguments, parameters.time_step);
    double seconds = 0;
    while (done < arguments.steps) {
        const long every = arguments.checkpoint_every;
        const long until = every > 0 ? std::min(arguments.steps, (done / every + 1) * every) : arguments.steps;
        MPI_Barrier(block.communicator());
        const double start = MPI_Wtime();
        motion.step(parameters, until - done);
        MPI_Barrier(block.communicator());
        seconds += MPI_Wtime() - start;
        done = until;
        if (!arguments.checkpoint.empty()) {
            motion.get_state(displacement, velocity);
            write_checkpoint(arguments.checkpoint, block, identity, done, displacement, velocity);
            if (block.rank() == 0) {
                std::printf("checkpoint at step %ld\n", done);
                std::fflush(stdout);
            }
        }
    }
    return seconds;
}

/// Bytes of messages.
struct Traffic {
    double total = 0; ///< sent by all ranks together
    double most = 0;  ///< received by one rank, of all the one with the most
};

/// A step's exchange by the model: every ghost's three components once. `value_bytes` is the size of one, 4 or 8.
Traffic modelled_traffic(const Block& block, std::size_t value_bytes) {
    Traffic traffic;
    for (int rank = 0; rank < block.ranks(); ++rank) {
        const std::size_t ghosts = block.ghosted_of(rank).count() - block.owned_by(rank).count();
        const double bytes = static_cast<double>(3 * value_bytes * ghosts);
        traffic.total += bytes;
        traffic.most = std::max(traffic.most, bytes);
    }
    return traffic;
}

/// Counts what PETSc's message calls send and receive from its construction on.
class TrafficCounter {
public:
    /// Collective.
    Traffic count(MPI_Comm communicator) const {
        const double own_sent = sent() - sent_, own_received = received() - received_;
        Traffic traffic;
        MPI_Allreduce(&own_sent, &traffic.total, 1, MPI_DOUBLE, MPI_SUM, communicator);
        MPI_Allreduce(&own_received, &traffic.most, 1, MPI_DOUBLE, MPI_MAX, communicator);
        return traffic;
    }

private:
    static double sent() { return petsc_isend_len + petsc_send_len; }
    static double received() { return petsc_irecv_len + petsc_recv_len; }

    double sent_ = sent(), received_ = received();
};

} // namespace

bool run_motion(const MotionArguments& arguments) {
    refuse_unless_one_of("method", arguments.method, "fused", "ts");
    refuse_unless_one_of("precision", arguments.precision, "double", "float");
    const bool single = arguments.precision == "float", fused = arguments.method == "fused";
    if (single && !fused) {
        throw std::invalid_argument("precision = \"float\" is not allowed with the method ts: PETSc's vectors hold "
                                    "doubles");
    }
    const BodyArguments& body = arguments.body;
    const Block block(PETSC_COMM_WORLD, body.grid());
    BlockForces forces(block, body.material, body.plan_options());
    const Supports clamp = [](PetscInt i, PetscInt, PetscInt) -> std::optional<std::array<double, 3>> {
        return i == 0 ? std::optional(std::array<double, 3>{0, 0, 0}) : std::nullopt;
    };
    const auto motion = fused ? make_fused_motion(single, block, body.material, clamp, body.plan_options())
                              : make_ts_motion(forces, clamp);
    const StepParameters parameters{.time_step = arguments.time_step.value_or(0.7 * forces.critical_time_step()),
                                    .acceleration = arguments.gravity,
                                    .mass_damping = arguments.mass_damping};
    OwnedVec u, v;
    check(VecDuplicate(forces.masses(), u.make()));
    check(VecDuplicate(forces.masses(), v.make()));
    check(VecSet(u, 0));
    forces.set_displacement(u); // the first exchange sends what the later ones need to know, too: it is not counted
    long first = 0;
    if (!arguments.restart.empty()) {
        first = read_checkpoint(arguments.restart, block, identity_of(arguments, parameters.time_step), u, v);
        motion->set_state(u, v);
        if (block.rank() == 0) {
            std::printf("restarted at step %ld\n", first);
        }
    }

    const TrafficCounter counter;
    const double seconds = take_steps(arguments, block, parameters, first, *motion, u, v);
    const Traffic counted = counter.count(block.communicator());
    motion->get_displacement(u);
    double greatest = 0;
    check(VecNorm(u, NORM_INFINITY, &greatest));
    forces.set_displacement(u);
    const double energy = forces.energy();
    if (!std::isfinite(greatest) || !std::isfinite(energy)) {
        throw std::runtime_error("the motion is not finite: the time step " + std::to_string(parameters.time_step) +
                                 " s is too long");
    }
    if (block.rank() == 0) {
        const double steps = static_cast<double>(std::max(arguments.steps - first, 1L));
        std::printf("%s %s, ranks %d, cells %s: %ld steps, %.4f ms a step, %.3f ns a cell and step\n",
                    arguments.method.c_str(), arguments.precision.c_str(), block.ranks(),
                    (std::to_string(body.cells[0]) + " x " + std::to_string(body.cells[1]) + " x " +
                     std::to_string(body.cells[2]))
                        .c_str(),
                    std::max(arguments.steps - first, 0L), 1e3 * seconds / steps,
                    1e9 * seconds / steps / body.cell_count());
        // A checkpoint sends whole states, which the model of a step does not hold.
        if (arguments.checkpoint.empty() && arguments.steps > first) {
            const Traffic modelled = modelled_traffic(block, single ? 4 : 8);
            std::printf("bytes a step: sent by all ranks %.15g (modelled %.15g), received by one rank at most %.15g "
                        "(modelled %.15g)\n",
                        counted.total / steps, modelled.total, counted.most / steps, modelled.most);
        }
        std::printf("greatest displacement %.17g m, elastic energy %.17g J\n", greatest, energy);
    }
    return save_and_compare(arguments.result, block, u);
}

} // namespace hybmss::distributed
