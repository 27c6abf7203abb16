// A body that moves: how it is made, held, loaded, stepped and cut.
#include "dynamics/explicit_dynamics_implementation.hpp"
#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>

namespace hybmss {
namespace {

/// Takes over the values of one axis of a node. What is not finite would be carried to every node, and be told of only
/// much later.
template <class T>
void take_over(PrescribedComponent<T>& component, const PrescribedNode& given, double length_unit) {
    const auto converted = [&](const char* what, double value) {
        const T inside = static_cast<T>(value * (1 / length_unit));
        if (!std::isfinite(inside)) {
            throw std::invalid_argument(std::string(what) + " of node " + std::to_string(given.node) + " = " +
                                        std::to_string(value) + " is not allowed: it must be finite" +
                                        (std::isfinite(value) ? " in the body's precision" : ""));
        }
        return inside;
    };
    component.displacement = converted("prescribed displacement", given.displacement[component.axis]);
    component.velocity = converted("prescribed velocity", given.velocity[component.axis]);
}

/// Pieces of the list are set at the same time, so none may be named twice.
template <class T>
void require_each_once(std::span<const PrescribedComponent<T>> components) {
    const auto key = [](const PrescribedComponent<T>& p) { return std::tuple(p.node, p.axis); };
    const auto ascending = [&](const auto& p, const auto& q) { return key(p) < key(q); };
    if (std::adjacent_find(components.begin(), components.end(),
                           [&](const auto& p, const auto& q) { return !ascending(p, q); }) == components.end()) {
        return;
    }
    std::vector<PrescribedComponent<T>> sorted(components.begin(), components.end());
    std::sort(sorted.begin(), sorted.end(), ascending);
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end(),
                                          [&](const auto& p, const auto& q) { return key(p) == key(q); });
    if (twice != sorted.end()) {
        throw std::invalid_argument("prescribed node " + std::to_string(twice->node) + ": given twice along " +
                                    "xyz"[twice->axis] + "; each axis of a node may be given once");
    }
}

[[noreturn]] void refuse_other_nodes() {
    throw std::invalid_argument("the motion gives other nodes or axes than prescribe(): they must be the same, in the "
                                "same order");
}

/// velocity += seconds * loads
template <class T>
void add_scaled(const std::vector<LoadedComponent<T>>& loads, double seconds, NodeField<T>& velocity) {
    for (const LoadedComponent<T>& load : loads) {
        const Component<T> v = component(velocity, static_cast<std::size_t>(load.axis));
        v.first[static_cast<std::ptrdiff_t>(load.index) * v.stride] += static_cast<T>(seconds) * load.acceleration;
    }
}

double longest_spring(const Network& network) {
    double longest = 0;
    for (const Network::Spring& spring : network.springs) {
        const auto& r = spring.rest_vector;
        longest = std::max(longest, std::hypot(r[0], r[1], r[2]));
    }
    for (const Network::Cell* cell : cells_of(network, true)) {
        longest = std::max(longest, std::sqrt(3.0) * rest_shape(network, *cell).edges[0]);
    }
    return longest;
}

} // namespace

template <class T>
ExplicitDynamics<T>::ExplicitDynamics(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(plan_body<T>(lattice, material, options, Operation::step),
                                                       lattice.cell_size())) {}
template <class T>
ExplicitDynamics<T>::ExplicitDynamics(const Network& network, const PlanOptions& options)
    : implementation_(
          std::make_unique<Implementation>(plan_body<T>(network, options, Operation::step), longest_spring(network))) {}
template <class T>
ExplicitDynamics<T>::ExplicitDynamics(ExplicitDynamics&&) noexcept = default;
template <class T>
ExplicitDynamics<T>& ExplicitDynamics<T>::operator=(ExplicitDynamics&&) noexcept = default;
template <class T>
ExplicitDynamics<T>::~ExplicitDynamics() = default;

template <class T>
std::size_t ExplicitDynamics<T>::node_count() const {
    return implementation_->body->node_count();
}

template <class T>
void ExplicitDynamics<T>::prescribe(std::span<const PrescribedNode> nodes) {
    const Body<T>& body = *implementation_->body;
    std::vector<PrescribedComponent<T>> components;
    for (const PrescribedNode& p : nodes) {
        if (p.node >= body.node_count()) {
            throw std::invalid_argument("prescribed node " + std::to_string(p.node) + ": the body has " +
                                        std::to_string(body.node_count()) + " nodes");
        }
        if (p.axes > 7) {
            throw std::invalid_argument("prescribed node " + std::to_string(p.node) + ": axes = " +
                                        std::to_string(p.axes) + " is not allowed: it must be a sum of 1, 2 and 4");
        }
        const std::size_t index = body.index_of(p.node);
        for (std::uint8_t axis = 0; axis < 3; ++axis) {
            if (p.axes >> axis & 1) {
                components.push_back({index, p.node, axis, T(0), T(0)});
                take_over(components.back(), p, body.length_unit());
            }
        }
    }
    require_each_once<T>(components);
    const auto& held = implementation_->prescribed;
    if (!std::equal(held.begin(), held.end(), components.begin(), components.end(), [](const auto& p, const auto& q) {
            return p.index == q.index && p.axis == q.axis;
        })) { // what is let go has the velocity of a whole step
        implementation_->complete();
    }
    implementation_->prescribed = std::move(components);
    for (const auto& effect : implementation_->effects) {
        effect->set_prescribed(implementation_->prescribed);
    }
    hybmss::set_prescribed<T>(implementation_->state, implementation_->prescribed);
    ++implementation_->holds;
}

template <class T>
void ExplicitDynamics<T>::Implementation::lead(std::span<const PrescribedNode> nodes) {
    std::vector<PrescribedComponent<T>> led = prescribed;
    auto next = led.begin();
    for (const PrescribedNode& p : nodes) {
        for (std::uint8_t axis = 0; axis < 3; ++axis) {
            if (p.axes >> axis & 1) {
                if (next == led.end() || next->node != p.node || next->axis != axis) {
                    refuse_other_nodes();
                }
                take_over(*next++, p, body->length_unit());
            }
        }
    }
    if (next != led.end()) {
        refuse_other_nodes();
    }
    std::copy(led.begin(), led.end(), prescribed.begin()); // in place: stages know where they lie
    for (const auto& effect : effects) {
        effect->set_prescribed(prescribed);
    }
}

template <class T>
void ExplicitDynamics<T>::load(std::span<const NodalLoad> loads) {
    const Body<T>& body = *implementation_->body;
    std::vector<NodalLoad> given(loads.begin(), loads.end()), forces; // each node once
    std::stable_sort(given.begin(), given.end(), [](const auto& a, const auto& b) { return a.node < b.node; });
    for (const NodalLoad& load : given) {
        if (load.node >= body.node_count()) {
            throw std::invalid_argument("loaded node " + std::to_string(load.node) + ": the body has " +
                                        std::to_string(body.node_count()) + " nodes");
        }
        for (std::size_t c = 0; c < 3; ++c) {
            if (!std::isfinite(load.force[c])) {
                throw std::invalid_argument("load on node " + std::to_string(load.node) + ": the force along " +
                                            "xyz"[c] + " is not finite");
            }
        }
        if (forces.empty() || forces.back().node != load.node) {
            forces.push_back({load.node});
        }
        for (std::size_t c = 0; c < 3; ++c) {
            forces.back().force[c] += load.force[c];
        }
    }
    std::vector<LoadedComponent<T>> components;
    for (const auto& [node, force] : forces) {
        for (std::size_t c = 0; c < 3; ++c) {
            if (force[c] != 0 && body.masses()[node] > 0) { // not where all cells have been cut away
                const auto acceleration = static_cast<T>(force[c] / (body.masses()[node] * body.length_unit()));
                if (!std::isfinite(acceleration)) {
                    throw std::invalid_argument("load on node " + std::to_string(node) + ": the force along " +
                                                "xyz"[c] + " is not finite in the body's precision");
                }
                components.push_back({body.index_of(node), static_cast<int>(c), acceleration});
            }
        }
    }
    implementation_->replace_loads(std::move(components));
    for (const auto& effect : implementation_->effects) {
        effect->set_loaded(implementation_->loaded);
    }
    std::erase_if(forces, [](const NodalLoad& load) { return load.force == std::array<double, 3>{0, 0, 0}; });
    implementation_->loads = std::move(forces);
}

template <class T>
void ExplicitDynamics<T>::step(const StepParameters& parameters, long count) {
    step(parameters, count, {});
}

template <class T>
void ExplicitDynamics<T>::step(const StepParameters& parameters, long count, const StepMotion& motion) {
    if (count < 0) {
        throw std::invalid_argument("count = " + std::to_string(count) +
                                    " is not allowed: it must be at least 0 steps");
    }
    Implementation& i = *implementation_;
    const bool leapfrog = parameters.integrator == Integrator::leapfrog;
    const auto before = leapfrog ? i.half : std::nullopt;
    static_cast<void>(step_constants<T>(step_factors(parameters, before), i.body->length_unit())); // what it throws
    if (count > 0 && !leapfrog) {
        i.complete();
    }
    std::exception_ptr thrown;
    std::function<void()> lead;
    long led = 0;
    if (motion.nodes || motion.obstacles) {
        lead = [&] {
            ++led;
            if (thrown) {
                return;
            }
            try {
                const UnderflowMode callers(Underflow::gradual);
                if (motion.nodes) {
                    i.lead(motion.nodes(led));
                }
                if (motion.obstacles) {
                    move_obstacles(motion.obstacles(led));
                }
            } catch (...) {
                thrown = std::current_exception();
            }
        };
    }
    const StepActions<T> actions{i.effects, i.prescribed, i.loaded, lead};
    take_steps<T>(*i.body, i.state, parameters, before, actions, count);
    i.took(parameters, count);
    if (thrown) {
        std::rethrow_exception(thrown);
    }
}

/// By all the forces of the present state.
template <class T>
void ExplicitDynamics<T>::Implementation::find_whole_velocity() const {
    const StepFactors kick = half_kick(*half);
    body->compute_forces(state);
    for (const auto& effect : effects) {
        effect->add_forces(*body, state, state.force);
    }
    Body<T>::allocate_like(state.velocity, whole_velocity);
    const std::size_t arrays = array_count(state.velocity), size = state.velocity[0].size();
    for (std::size_t a = 0; a < arrays; ++a) {
        std::copy_n(state.velocity[a].data(), size, whole_velocity[a].data());
    }
    std::vector<Stage> stages;
    body->add_kick_stages(whole_velocity, state.force, -kick.kick, nullptr, stages);
    body->workers().run(stages, 1);
    const T factor = static_cast<T>(kick.velocity);
    for (std::size_t a = 0; kick.driven && a < arrays; ++a) {
        for (std::size_t i = 0; i < size; ++i) {
            const std::size_t axis = arrays == 1 ? i % 4 : a;
            if (body->inverse_masses()[i] > 0) {
                whole_velocity[a][i] =
                    factor * whole_velocity[a][i] + static_cast<T>(kick.gain[axis] / body->length_unit());
            }
        }
    }
    add_scaled(loaded, kick.force, whole_velocity);
    for (const PrescribedComponent<T>& p : prescribed) {
        const Component<T> v = component(whole_velocity, p.axis);
        v.first[static_cast<std::ptrdiff_t>(p.index) * v.stride] = p.velocity;
    }
}

template <class T>
void ExplicitDynamics<T>::Implementation::complete() {
    if (half) {
        find_whole_velocity();
        for (std::size_t a = 0; a < array_count(state.velocity); ++a) { // copied: a world knows where they lie
            std::copy_n(whole_velocity[a].data(), whole_velocity[a].size(), state.velocity[a].data());
        }
        complete_effects();
        half.reset();
        for (const auto& effect : effects) {
            effect->state_was_set();
        }
    }
}

/// The half kick that is still to come takes the loads of its own step, not those after it.
template <class T>
void ExplicitDynamics<T>::Implementation::replace_loads(std::vector<LoadedComponent<T>> loads_from_now) {
    if (half && loaded != loads_from_now) {
        const double kick = half_kick(*half).kick;
        add_scaled(loaded, kick, state.velocity);
        add_scaled(loads_from_now, -kick, state.velocity);
    }
    loaded = std::move(loads_from_now);
}

template <class T>
void ExplicitDynamics<T>::Implementation::took(const StepParameters& parameters, long count) {
    // A look at the whole state takes about as long as a fifth of a step.
    constexpr long kStepsBetweenLooks = 64;
    if (parameters.integrator == Integrator::leapfrog && count > 0) {
        half = parameters;
    }
    steps += count;
    if (steps - looked_at >= kStepsBetweenLooks) {
        look();
    }
}

template <class T>
void ExplicitDynamics<T>::Implementation::look() const {
    looked_at = steps;
    const bool finite = seat.taken ? seat.row->finite(*body, seat.lane)
                                   : body->finite(state.displacement) && body->finite(state.velocity);
    if (not_finite_at == 0 && !finite) {
        not_finite_at = std::max(steps, 1L);
    }
}

template <class T>
auto ExplicitDynamics<T>::Home::operator->() const -> Implementation* {
    if (held_->seat.taken) {
        held_->come_home();
    }
    return held_.get();
}

template <class T>
bool ExplicitDynamics<T>::finite() const {
    return not_finite_at() == 0;
}

template <class T>
long ExplicitDynamics<T>::not_finite_at() const {
    const Implementation& i = *implementation_;
    if (i.looked_at != i.steps) {
        i.look();
    }
    return i.not_finite_at;
}

template <class T>
PlanDescription ExplicitDynamics<T>::describe() const {
    PlanDescription description = implementation_->planned.describe();
    description.bytes += implementation_->state.bytes();
    if (const auto& row = implementation_->seat.row) {
        description.bytes += row->state.bytes() / row->state.bodies;
    }
    for (const auto& component : implementation_->whole_velocity) {
        description.bytes += component.bytes();
    }
    description.bytes += implementation_->prescribed.size() * sizeof(PrescribedComponent<T>);
    description.bytes += implementation_->loaded.size() * sizeof(LoadedComponent<T>);
    for (const auto& effect : implementation_->effects) {
        description.bytes += effect->bytes();
    }
    return description;
}

template <class T>
void ExplicitDynamics<T>::Implementation::check_cut(const Lattice& lattice, std::span<const std::uint32_t> cells) {
    if (const std::string layout = body->describe().layout; !can_be_cut(layout)) {
        throw std::invalid_argument("layout \"" + layout +
                                    "\" cannot be cut while it moves: " + layouts_that_can_be_cut() + " can");
    }
    for (const std::uint32_t cell : cells) {
        if (cell >= lattice.cell_scales().size()) {
            throw std::invalid_argument("cell " + std::to_string(cell) + ": the lattice has " +
                                        std::to_string(lattice.cell_scales().size()));
        }
    }
    if (lattice.cell_size() != body->length_unit()) {
        throw std::invalid_argument("the lattice has cells of " + std::to_string(lattice.cell_size()) +
                                    " m, the body of " + std::to_string(body->length_unit()) + " m");
    }
    if (!numbers) {
        if (const std::size_t cells_here = body->describe().cells; cells_here != lattice.cell_count()) {
            throw std::invalid_argument("the lattice has " + std::to_string(lattice.cell_count()) +
                                        " cells, the body made from it " + std::to_string(cells_here));
        }
        numbers.emplace(lattice, body->node_count());
        grid = lattice.cells();
    }
    if (grid != lattice.cells()) {
        throw std::invalid_argument("the lattice has another grid than the one that the body was made from");
    }
}

template <class T>
bool ExplicitDynamics<T>::can_remove_cells() const {
    return can_be_cut(implementation_->body->describe().layout);
}

template <class T>
std::size_t ExplicitDynamics<T>::remove_cells(Lattice& lattice, std::span<const std::uint32_t> cells) {
    Implementation& i = *implementation_;
    i.check_cut(lattice, cells);
    i.complete();
    const auto nx = static_cast<std::size_t>(lattice.cells()[0]), ny = static_cast<std::size_t>(lattice.cells()[1]);
    std::vector<CutNode> nodes;
    std::size_t removed = 0;
    for (const std::uint32_t cell : cells) {
        const std::size_t x = cell % nx, y = cell / nx % ny, z = cell / nx / ny;
        const int at[3] = {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
        if (!(lattice.cell_scale(at[0], at[1], at[2]) > 0)) {
            continue;
        }
        lattice.set_cell_scale(at[0], at[1], at[2], 0);
        ++removed;
        for (std::size_t corner = 0; corner < 8; ++corner) {
            const std::array<std::size_t, 3> place = {x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)};
            nodes.push_back({i.numbers->of(place[0] + (nx + 1) * (place[1] + (ny + 1) * place[2])), place});
        }
    }
    i.planned.body->take_over(lattice, nodes, removed);
    ++i.cuts;
    for (const CutNode& node : nodes) {
        if (i.body->masses()[node.node] == 0) { // nothing would slow it down
            for (std::size_t c = 0; c < 3; ++c) {
                const Component<T> v = component(i.state.velocity, c);
                v.first[static_cast<std::ptrdiff_t>(i.body->index_of(node.node)) * v.stride] = 0;
            }
        }
    }
    for (const auto& effect : i.effects) {
        effect->body_was_cut(*i.body, lattice, *i.numbers, nodes);
    }
    if (!i.loads.empty()) { // the same forces on other masses
        load(std::vector<NodalLoad>(i.loads));
    }
    return removed;
}

template class ExplicitDynamics<float>;
template class ExplicitDynamics<double>;

} // namespace hybmss
