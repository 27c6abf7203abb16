#include "hybmss/equilibrium.hpp"

#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace hybmss::c_interface {
namespace {

template <class T>
struct Solving {
    EquilibriumSolver<T> solver;
    Scratch<T> scratch;
    std::string message;

    Solving(const hybmss_body& body, const PlanOptions& options)
        : solver(made_of<EquilibriumSolver<T>>(body, options)) {}
};

Loading loading_of(const hybmss_loading* given, std::size_t nodes) {
    require(given, "loading");
    require(given->supports, "supports", given->support_count);
    require(given->loads, "loads", given->load_count);
    require(given->pressures, "pressures", given->pressure_count);
    require(given->obstacles, "obstacles", given->obstacle_count);
    Loading loading;
    std::transform(given->supports, given->supports + given->support_count, std::back_inserter(loading.supports),
                   prescribed_node);
    if (given->load_count > 0) {
        loading.forces.assign(nodes, {0, 0, 0});
    }
    for (std::size_t l = 0; l < given->load_count; ++l) {
        const hybmss_nodal_load& load = given->loads[l];
        if (load.node >= nodes) {
            throw std::invalid_argument("loaded node " + std::to_string(load.node) + ": the body has " +
                                        std::to_string(nodes) + " nodes");
        }
        for (std::size_t a = 0; a < 3; ++a) {
            loading.forces[load.node][a] += load.force[a];
        }
    }
    std::copy_n(given->acceleration, 3, loading.acceleration.begin());
    loading.pressures.assign(given->pressures, given->pressures + given->pressure_count);
    std::transform(given->obstacles, given->obstacles + given->obstacle_count, std::back_inserter(loading.obstacles),
                   pose_of);
    loading.rest_stretches = stretches_of(given->stretches, given->stretch_count);
    return loading;
}

EquilibriumOptions options_of(const hybmss_equilibrium_options* given) {
    EquilibriumOptions options;
    if (!given) {
        return options;
    }
    if (given->preconditioner < HYBMSS_PRECONDITIONER_AUTOMATIC || given->preconditioner > HYBMSS_MULTIGRID) {
        throw std::invalid_argument("preconditioner = " + std::to_string(given->preconditioner) +
                                    " is not allowed: it must be 0 to 2");
    }
    if (given->leave_saddles != 0 && given->leave_saddles != 1) {
        throw std::invalid_argument("leave_saddles = " + std::to_string(given->leave_saddles) +
                                    " is not allowed: it must be 0 or 1");
    }
    options.tolerance = given->tolerance;
    options.newton_iterations = given->newton_iterations;
    options.load_steps = given->load_steps;
    options.first_load_step = given->first_load_step;
    options.preconditioner = static_cast<PreconditionerKind>(given->preconditioner);
    options.leave_saddles = given->leave_saddles == 1;
    if (given->progress) {
        options.progress = [call = given->progress, user = given->user](const EquilibriumProgress& at) {
            return call(at.load_fraction, at.newton_iteration, at.residual, user) == 0;
        };
    }
    return options;
}

hybmss_equilibrium_result result_of(const EquilibriumResult& found) {
    hybmss_equilibrium_result result{};
    result.outcome = static_cast<hybmss_outcome>(found.status);
    result.residual = found.residual;
    result.potential = found.potential;
    result.load_fraction = found.load_fraction;
    result.load_steps = found.load_steps;
    result.newton_iterations = found.newton_iterations;
    result.cg_iterations = found.cg_iterations;
    result.least_volume_ratio = found.min_cell_volume_ratio;
    result.greatest_volume_ratio = found.max_cell_volume_ratio;
    return result;
}

/// A field that is read and written: in the body's order, brought back by set().
template <class T>
class Changed {
public:
    Changed(const hybmss_field* field, Solving<T>& solving, const char* name)
        : output_((check<T>(field, solving.solver.node_count(), name), *field), solving.solver.node_count(),
                  solving.scratch) {
        const std::size_t nodes = solving.solver.node_count();
        const hybmss_const_field in = {field->precision, field->x,     field->y,  field->z,
                                       field->stride,    field->count, field->map};
        const Input<T> input(in, nodes, solving.scratch);
        if (field->map) {
            const VectorField<const T>& from = input.view();
            const VectorField<T>& to = view();
            for (std::size_t n = 0; n < nodes; ++n) {
                const auto at = static_cast<std::ptrdiff_t>(n);
                to.x[at * to.stride] = from.x[at * from.stride];
                to.y[at * to.stride] = from.y[at * from.stride];
                to.z[at * to.stride] = from.z[at * from.stride];
            }
        }
    }
    const VectorField<T>& view() const { return output_.view(); }
    void set() const { output_.set(); }

private:
    Output<T> output_;
};

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_equilibrium {
    std::variant<std::unique_ptr<Solving<float>>, std::unique_ptr<Solving<double>>> held;
};

extern "C" {

hybmss_equilibrium_options hybmss_default_equilibrium_options(void) {
    const EquilibriumOptions options;
    return {options.tolerance,
            options.newton_iterations,
            options.load_steps,
            options.first_load_step,
            HYBMSS_PRECONDITIONER_AUTOMATIC,
            options.leave_saddles ? 1 : 0,
            nullptr,
            nullptr};
}

hybmss_status hybmss_equilibrium_create(const hybmss_body* body, hybmss_precision precision,
                                        const hybmss_plan_options* options, hybmss_equilibrium** equilibrium) {
    return create<Solving>(body, precision, options, equilibrium, "equilibrium");
}

void hybmss_equilibrium_destroy(hybmss_equilibrium* equilibrium) {
    delete equilibrium;
}

hybmss_status hybmss_equilibrium_press(hybmss_equilibrium* equilibrium, const hybmss_body* body, const uint32_t* nodes,
                                       size_t count) {
    return guarded(equilibrium, "equilibrium", [&](auto& solving) {
        require_own(body, solving.solver.node_count(), "equilibrium");
        require(nodes, "nodes", count);
        solving.solver.press(faces_of(*body, nodes, count));
    });
}

hybmss_status hybmss_equilibrium_set_obstacles(hybmss_equilibrium* equilibrium, const hybmss_body* body,
                                               const hybmss_obstacle* obstacles, size_t count) {
    return guarded(equilibrium, "equilibrium", [&](auto& solving) {
        require_own(body, solving.solver.node_count(), "equilibrium");
        require(obstacles, "obstacles", count);
        std::vector<Obstacle> given;
        std::transform(obstacles, obstacles + count, std::back_inserter(given), obstacle_of);
        const auto* const network = std::get_if<Network>(&body->shape);
        solving.solver.set_obstacles(
            network ? surface_nodes(*network) : surface_nodes(std::get<LatticeBody>(body->shape).lattice), given);
    });
}

hybmss_status hybmss_equilibrium_actuate(hybmss_equilibrium* equilibrium, const uint32_t* cells, size_t count) {
    return guarded(equilibrium, "equilibrium", [&](auto& solving) {
        require(cells, "cells", count);
        solving.solver.actuate({cells, count});
    });
}

hybmss_status hybmss_equilibrium_solve(hybmss_equilibrium* equilibrium, const hybmss_loading* loading,
                                       const hybmss_field* displacements, const hybmss_equilibrium_options* options,
                                       hybmss_equilibrium_result* result) {
    return guarded(equilibrium, "equilibrium", [&]<class T>(Solving<T>& solving) {
        require(result, "result");
        const Changed<T> u(displacements, solving, "displacements");
        const EquilibriumResult found =
            solving.solver.solve(loading_of(loading, solving.solver.node_count()), u.view(), options_of(options));
        u.set();
        solving.message = found.message;
        *result = result_of(found);
    });
}

hybmss_status hybmss_equilibrium_step(hybmss_equilibrium* equilibrium, const hybmss_loading* loading, double time_step,
                                      double mass_damping, const hybmss_field* displacements,
                                      const hybmss_field* velocities, const hybmss_equilibrium_options* options,
                                      hybmss_equilibrium_result* result) {
    return guarded(equilibrium, "equilibrium", [&]<class T>(Solving<T>& solving) {
        require(result, "result");
        const Changed<T> u(displacements, solving, "displacements"), v(velocities, solving, "velocities");
        const EquilibriumResult found = solving.solver.step(loading_of(loading, solving.solver.node_count()), time_step,
                                                            mass_damping, u.view(), v.view(), options_of(options));
        u.set();
        v.set();
        solving.message = found.message;
        *result = result_of(found);
    });
}

const char* hybmss_equilibrium_message(const hybmss_equilibrium* equilibrium) {
    return equilibrium ? std::visit([](const auto& solving) { return solving->message.c_str(); }, equilibrium->held)
                       : "equilibrium is null";
}

} // extern "C"
