#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"
#include "hybmss/explicit_dynamics.hpp"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss::c_interface {
namespace {

template <class T>
struct Moving {
    ExplicitDynamics<T> body;
    mutable Scratch<T> scratch;

    Moving(const hybmss_body& shape, const PlanOptions& options) : body(made_of<ExplicitDynamics<T>>(shape, options)) {}

    /// get(view) writes the view.
    template <class Get>
    void read(const hybmss_field* out, const Get& get) const {
        check<T>(out, body.node_count(), "out");
        const Output<T> field(*out, body.node_count(), scratch);
        get(field.view());
        field.set();
    }
    /// set(view) reads the view.
    template <class Set>
    void write(const hybmss_const_field* in, const Set& set) const {
        check<T>(in, body.node_count(), "in");
        set(Input<T>(*in, body.node_count(), scratch).view());
    }
};

PrescribedNode prescribed_node(const hybmss_prescribed_node& given) {
    if (given.axes > 7) {
        throw std::invalid_argument("axes of prescribed node " + std::to_string(given.node) + " = " +
                                    std::to_string(given.axes) + " is not allowed: it must be 0 to 7");
    }
    PrescribedNode node{given.node, static_cast<std::uint8_t>(given.axes), {}, {}};
    std::copy_n(given.displacement, 3, node.displacement.begin());
    std::copy_n(given.velocity, 3, node.velocity.begin());
    return node;
}

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_dynamics {
    std::variant<std::unique_ptr<Moving<float>>, std::unique_ptr<Moving<double>>> held;
};

extern "C" {

hybmss_status hybmss_dynamics_create(const hybmss_body* body, hybmss_precision precision,
                                     const hybmss_plan_options* options, hybmss_dynamics** dynamics) {
    return create<Moving>(body, precision, options, dynamics, "dynamics");
}

void hybmss_dynamics_destroy(hybmss_dynamics* dynamics) {
    delete dynamics;
}

hybmss_status hybmss_dynamics_prescribe(hybmss_dynamics* dynamics, const hybmss_prescribed_node* nodes, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(nodes, "nodes", count);
        std::vector<PrescribedNode> prescribed;
        std::transform(nodes, nodes + count, std::back_inserter(prescribed), prescribed_node);
        moving.body.prescribe(prescribed);
    });
}

hybmss_status hybmss_dynamics_load(hybmss_dynamics* dynamics, const hybmss_nodal_load* loads, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(loads, "loads", count);
        std::vector<NodalLoad> given;
        std::transform(loads, loads + count, std::back_inserter(given), [](const hybmss_nodal_load& load) {
            return NodalLoad{load.node, {load.force[0], load.force[1], load.force[2]}};
        });
        moving.body.load(given);
    });
}

hybmss_status hybmss_dynamics_damp_springs(hybmss_dynamics* dynamics, double stiffness_damping) {
    return guarded(dynamics, "dynamics", [&](auto& moving) { moving.body.damp_springs(stiffness_damping); });
}

hybmss_status hybmss_dynamics_step(hybmss_dynamics* dynamics, const hybmss_step_parameters* parameters, int64_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(parameters, "parameters");
        if (count < 0) {
            throw std::invalid_argument("count = " + std::to_string(count) + " is not allowed: it must be at least 0");
        }
        const double* g = parameters->acceleration;
        if (parameters->integrator != HYBMSS_SYMPLECTIC_EULER && parameters->integrator != HYBMSS_LEAPFROG) {
            throw std::invalid_argument(
                "integrator = " + std::to_string(parameters->integrator) +
                " is not allowed: it must be 0 (HYBMSS_SYMPLECTIC_EULER) or 1 (HYBMSS_LEAPFROG)");
        }
        const StepParameters step{parameters->time_step,
                                  {g[0], g[1], g[2]},
                                  parameters->mass_damping,
                                  static_cast<Integrator>(parameters->integrator)};
        moving.body.step(step, static_cast<long>(count));
    });
}

hybmss_status hybmss_dynamics_get_displacements(const hybmss_dynamics* dynamics, const hybmss_field* out) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        moving.read(out, [&](const auto& view) { moving.body.get_displacements(view); });
    });
}

hybmss_status hybmss_dynamics_get_velocities(const hybmss_dynamics* dynamics, const hybmss_field* out) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        moving.read(out, [&](const auto& view) { moving.body.get_velocities(view); });
    });
}

hybmss_status hybmss_dynamics_get_forces(const hybmss_dynamics* dynamics, const hybmss_field* out) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        moving.read(out, [&](const auto& view) { moving.body.get_forces(view); });
    });
}

hybmss_status hybmss_dynamics_set_displacements(hybmss_dynamics* dynamics, const hybmss_const_field* in) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        moving.write(in, [&](const auto& view) { moving.body.set_displacements(view); });
    });
}

hybmss_status hybmss_dynamics_set_velocities(hybmss_dynamics* dynamics, const hybmss_const_field* in) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        moving.write(in, [&](const auto& view) { moving.body.set_velocities(view); });
    });
}

hybmss_status hybmss_dynamics_energies(const hybmss_dynamics* dynamics, double* springs, double* volume,
                                       double* kinetic) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        const PotentialEnergy energy = moving.body.potential_energy();
        const double motion = moving.body.kinetic_energy();
        for (const auto& [value, out] :
             {std::pair{energy.springs, springs}, {energy.volume, volume}, {motion, kinetic}}) {
            if (out) {
                *out = value;
            }
        }
    });
}

hybmss_status hybmss_dynamics_not_finite_at(const hybmss_dynamics* dynamics, int64_t* steps) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(steps, "steps");
        *steps = moving.body.not_finite_at();
    });
}

hybmss_status hybmss_dynamics_masses(const hybmss_dynamics* dynamics, double* masses, size_t count) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(masses, "masses", count);
        const std::span<const double> all = moving.body.masses();
        require_count(count, all.size(), "masses");
        std::copy(all.begin(), all.end(), masses);
    });
}

hybmss_status hybmss_dynamics_critical_time_step(const hybmss_dynamics* dynamics, double* time_step) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(time_step, "time_step");
        *time_step = moving.body.critical_time_step();
    });
}

} // extern "C"
