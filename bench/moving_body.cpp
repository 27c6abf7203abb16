#include "bench/moving_body.hpp"

#include "plan/bodies/layout_table.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace hybmss::bench {

template <class T>
std::vector<T> random_displacements(std::size_t nodes, double cell_size) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-kDisturbance * cell_size, kDisturbance * cell_size);
    std::vector<T> values(3 * nodes);
    std::generate(values.begin(), values.end(), [&] { return static_cast<T>(uniform(random)); });
    return values;
}

template <class T>
void disturb(ExplicitDynamics<T>& dynamics, double cell_size) {
    std::vector<T> u = random_displacements<T>(dynamics.node_count(), cell_size);
    dynamics.set_displacements(VectorField<T>::aos(u.data(), dynamics.node_count()));
}

template <class T>
ExplicitDynamics<T> row_dynamics(const BenchRow& row) {
    const Lattice lattice = row_lattice(row);
    const Material material = row_material(row);
    const PlanOptions options = row_options(row);
    ExplicitDynamics<T> dynamics = is_network(row)
                                       ? ExplicitDynamics<T>(Network::from_lattice(lattice, material), options)
                                       : ExplicitDynamics<T>(lattice, material, options);
    disturb(dynamics, lattice.cell_size());
    return dynamics;
}

template <class T>
StepParameters gentle_steps(const ExplicitDynamics<T>& dynamics) {
    StepParameters parameters;
    parameters.time_step = 0.5 * dynamics.critical_time_step();
    parameters.mass_damping = 1e-5 / parameters.time_step;
    return parameters;
}

template <class T>
bool all_finite(const ExplicitDynamics<T>& dynamics) {
    std::vector<T> u(3 * dynamics.node_count());
    dynamics.get_displacements(VectorField<T>::aos(u.data(), dynamics.node_count()));
    return std::all_of(u.begin(), u.end(), [](T value) { return std::isfinite(value); });
}

bool all_finite(const Yardstick& body) {
    return std::all_of(body.nodes.begin(), body.nodes.end(), [](const YardstickNode& node) {
        return std::isfinite(node.position.x + node.position.y + node.position.z);
    });
}

Yardstick moving_yardstick(const Lattice& lattice, const Material& material) {
    Material between_nodes = material; // as people would write it
    between_nodes.springs = SpringForm::nodes;
    Yardstick body = make_yardstick(Network::from_lattice(lattice, between_nodes));
    const std::vector<double> u = random_displacements<double>(body.nodes.size(), lattice.cell_size());
    for (std::size_t n = 0; n < body.nodes.size(); ++n) {
        Vector3& x = body.nodes[n].position;
        x = {x.x + u[3 * n], x.y + u[3 * n + 1], x.z + u[3 * n + 2]};
    }
    return body;
}

Work steps_of(Yardstick& body, const StepParameters& parameters) {
    return [&body, dt = parameters.time_step, damping = parameters.mass_damping](long steps) {
        for (long s = 0; s < steps; ++s) {
            step(body, dt, damping);
        }
    };
}

template std::vector<float> random_displacements(std::size_t, double);
template std::vector<double> random_displacements(std::size_t, double);
template void disturb(ExplicitDynamics<float>&, double);
template void disturb(ExplicitDynamics<double>&, double);
template ExplicitDynamics<float> row_dynamics(const BenchRow&);
template ExplicitDynamics<double> row_dynamics(const BenchRow&);
template StepParameters gentle_steps(const ExplicitDynamics<float>&);
template StepParameters gentle_steps(const ExplicitDynamics<double>&);
template bool all_finite(const ExplicitDynamics<float>&);
template bool all_finite(const ExplicitDynamics<double>&);

template <class T>
BareStep<T> bare_step(const Lattice& lattice, const Material& material, const PlanOptions& options,
                      const std::vector<T>& displacements) {
    const std::shared_ptr<const Body<T>> body = make_body<T>(lattice, material, options);
    const auto state = std::make_shared<State<T>>(body->make_state(true));
    body->write(VectorField<const T>::aos(displacements.data(), body->node_count()), 1 / body->length_unit(),
                state->displacement);
    return {[body, state](const StepParameters& parameters, long count) {
                body->workers().run(body->step_stages(*state, step_factors(parameters)), count);
            },
            body->describe().bytes + state->bytes()};
}

template BareStep<float> bare_step(const Lattice&, const Material&, const PlanOptions&, const std::vector<float>&);
template BareStep<double> bare_step(const Lattice&, const Material&, const PlanOptions&, const std::vector<double>&);

} // namespace hybmss::bench
