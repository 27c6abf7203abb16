#include "bench/step/bare_step.hpp"

#include "plan/bodies/layout_table.hpp"

namespace hybmss::bench {

template <class T>
BareStep<T> bare_step(const Lattice& lattice, const Material& material, const PlanOptions& options,
                      const std::vector<T>& displacements) {
    const std::shared_ptr<const Body<T>> body = make_body<T>(lattice, material, options);
    const auto state = std::make_shared<State<T>>(body->make_state(true));
    body->write(VectorField<const T>::aos(displacements.data(), body->node_count()), 1 / body->length_unit(),
                state->displacement);
    return {[body, state](const StepParameters& parameters, long count) {
                body->workers().run(body->step_stages(*state, parameters), count);
            },
            body->describe().bytes + state->bytes()};
}

template BareStep<float> bare_step(const Lattice&, const Material&, const PlanOptions&, const std::vector<float>&);
template BareStep<double> bare_step(const Lattice&, const Material&, const PlanOptions&, const std::vector<double>&);

} // namespace hybmss::bench
