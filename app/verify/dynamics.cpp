#include "app/verify/bodies.hpp"

#include "hybmss/batch.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "reference/forces.hpp"
#include "reference/semi_implicit_euler.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace hybmss::verify {
namespace {

using Eigen::Vector3d;

constexpr int kSteps = 50;

// Small enough that no body is unstable: an unstable one would multiply rounding errors without bound.
constexpr double kStrain = 0.03;

/// The first and the last node, one of them free along y.
std::vector<PrescribedNode> prescribed_nodes(const TestBody& body, std::size_t nodes) {
    const double h = body.cell_size;
    PrescribedNode first, last;
    first.axes = 5;
    first.displacement = {0.03 * h, 0, -0.05 * h};
    last.node = static_cast<std::uint32_t>(nodes - 1);
    last.displacement = {0, 0.05 * h, 0};
    last.velocity = {0, 0.5, 0};
    return {first, last};
}

struct Run {
    reference::State state; ///< after kSteps steps
    double kinetic_energy = 0;
    /// The greatest during the run, since an oscillation may end where one of them is near zero.
    double greatest_u = 0, greatest_v = 0, greatest_kinetic_energy = 0;
};

/// With damping along the springs of `spring_damping` seconds: it kicks the velocities before a step.
Run run_reference(const reference::Body& body, const StepParameters& parameters, double spring_damping,
                  const std::vector<PrescribedNode>& prescribed, const std::vector<Vector3d>& start) {
    reference::State state = reference::rest_state(body);
    state.u = start;
    reference::prescribe(prescribed, state);
    Run run;
    for (int s = 0; s < kSteps; ++s) {
        if (spring_damping > 0) {
            const std::vector<Vector3d> force = reference::damping_forces(body, spring_damping, state.u, state.v);
            for (std::size_t n = 0; n < force.size(); ++n) {
                state.v[n] += parameters.time_step / body.mass[n] * force[n];
            }
        }
        reference::semi_implicit_euler_step(body, parameters, prescribed, state);
        run.kinetic_energy = reference::kinetic_energy(body, state);
        run.greatest_u = std::max(run.greatest_u, max_component(state.u));
        run.greatest_v = std::max(run.greatest_v, max_component(state.v));
        run.greatest_kinetic_energy = std::max(run.greatest_kinetic_energy, run.kinetic_energy);
    }
    run.state = std::move(state);
    return run;
}

/// Gravity, damping and prescribed nodes, or none of them: kernels have a variant of its own for each. Then the
/// body in one tile, and damping along the springs, which takes kernels of its own. Then several bodies in a batch, the
/// first and the last in motion: lanes of vectors that are full, and of one that is not.
struct Case {
    const char* check;
    bool driven;
    bool one_tile = false;
    double spring_damping = 0; ///< in critical time steps
    std::size_t bodies = 1;
};
constexpr Case kCases[] = {{"50 driven steps", true},
                           {"50 free steps", false},
                           {"one-tile steps", true, true},
                           {"damped steps", true, false, 0.1},
                           {"side by side", true, false, 0, 18}};

StepParameters step_parameters(const Case& which, double critical_time_step, double cell_size) {
    const double dt = 0.3 * critical_time_step;
    if (!which.driven) {
        return {dt, {0, 0, 0}, 0};
    }
    // A free node falls by about a tenth of a cell in all; a step takes one percent of the velocity.
    const double g = 1e-4 * cell_size / (dt * dt);
    return {dt, {0.1 * g, -g, 0.2 * g}, 0.01 / dt};
}

/// The reference's runs by driven, time step and damping along the springs: they take longer than all else.
using Runs = std::map<std::tuple<bool, double, double>, Run>;

template <class T>
void compare(const TestBody& body, const reference::Body& reference, const std::vector<Vector3d>& start, Runs& runs,
             const Case& which, const MatrixOptions& options, RowTable& table) {
    const auto prescribed = which.driven ? prescribed_nodes(body, start.size()) : std::vector<PrescribedNode>{};
    for (RowKey key : kernel_keys(body, options.instruction_sets, precision_name<T>())) {
        if (which.bodies > 1 && !key.layout.starts_with("flat-rows")) {
            continue;
        }
        PlanOptions plan = plan_options(key);
        plan.one_tile = which.one_tile;
        std::vector<ExplicitDynamics<T>> bodies;
        for (std::size_t b = 0; b < which.bodies; ++b) {
            bodies.push_back(make_planned<ExplicitDynamics<T>>(body, plan));
        }
        ExplicitDynamics<T>& dynamics = bodies.front();
        const double spring_damping = which.spring_damping * dynamics.critical_time_step();
        dynamics.damp_springs(spring_damping);
        const StepParameters parameters = step_parameters(which, dynamics.critical_time_step(), body.cell_size);
        // Each layout has a bound of its own for the critical step, so the reference runs with the same step.
        const auto [run, is_new] = runs.try_emplace({which.driven, parameters.time_step, spring_damping});
        Run& expected = run->second;
        if (is_new) {
            expected = run_reference(reference, parameters, spring_damping, prescribed, start);
        }

        NodeArray<T> u(Arrangement::stride_3, start), v(Arrangement::separate_arrays, start.size());
        for (ExplicitDynamics<T>* moving : {&dynamics, &bodies.back()}) {
            moving->set_displacements(u.field());
            moving->prescribe(prescribed);
        }
        if (which.bodies == 1) {
            dynamics.step(parameters, kSteps - 1);
            dynamics.step(parameters);
        } else {
            Batch<T> batch(1, BatchLayout::side_by_side);
            batch.step(bodies, parameters, kSteps - 1);
            batch.step(bodies, parameters);
            if (batch.describe().side_by_side < which.bodies) { // such a body does not go so
                continue;
            }
        }
        key.check = which.check;
        const std::string name = body.name + ", " + body.variant;
        const auto record = [&](double error, double scale) { table.record(key, error / scale, name); };
        for (const ExplicitDynamics<T>* moved : {&dynamics, &bodies.back()}) {
            moved->get_displacements(u.field());
            moved->get_velocities(v.field());
            record(max_difference(u.vectors(), expected.state.u), expected.greatest_u);
            record(max_difference(v.vectors(), expected.state.v), expected.greatest_v);
            record(std::abs(moved->kinetic_energy() - expected.kinetic_energy), expected.greatest_kinetic_energy);
            if (which.bodies == 1) {
                break;
            }
        }
    }
}

template <class T>
void compare_all(const TestBody& body, const reference::Body& reference, const MatrixOptions& options,
                 RowTable& table) {
    std::mt19937 random(options.seed);
    const std::vector<Vector3d> start = random_vectors<T>(reference.rest.size(), kStrain * body.cell_size, random);
    Runs runs;
    for (const Case& which : kCases) {
        compare<T>(body, reference, start, runs, which, options, table);
    }
}

} // namespace

void run_dynamics(const MatrixOptions& options, RowTable& table) {
    for_each_body(property_bodies(options.seed), table, [&](const TestBody& body, RowTable& rows) {
        const reference::Body reference = reference_body(body);
        compare_all<float>(body, reference, options, rows);
        compare_all<double>(body, reference, options, rows);
    });
}

} // namespace hybmss::verify
