#include "hybmss/explicit_dynamics.hpp"

#include "layouts/node_numbers.hpp"
#include "plan/contact.hpp"
#include "plan/critical_time_step.hpp"
#include "plan/planned_body.hpp"
#include "plan/spring_damping.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

[[noreturn]] void refuse(const char* what, std::size_t node, double value) {
    throw std::invalid_argument(std::string(what) + " of node " + std::to_string(node) + " = " + std::to_string(value) +
                                " is not allowed: it must be finite");
}

/// A motion would carry one bad number to every node, and tell of it only much later.
template <class T>
void check_finite(const VectorField<const T>& in, const char* what) {
    for (const T* component : {in.x, in.y, in.z}) {
        for (std::size_t n = 0; n < in.size; ++n) {
            if (const T value = component[static_cast<std::ptrdiff_t>(n) * in.stride]; !std::isfinite(value)) {
                refuse(what, n, static_cast<double>(value));
            }
        }
    }
}

double longest_spring(const Network& network) {
    double longest = 0;
    for (const Network::Spring& spring : network.springs) {
        const auto& r = spring.rest_vector;
        longest = std::max(longest, std::hypot(r[0], r[1], r[2]));
    }
    return longest;
}

} // namespace

template <class T>
struct ExplicitDynamics<T>::Implementation {
    Implementation(PlannedBody<T> made, double longest_edge)
        : planned(std::move(made)), body(planned.body.get()), state(body->make_state(true)),
          wave_speed(longest_edge / body->critical_time_step()) {}

    /// The padding too: a motion that ended in NaN has reached it, and the next one must start clean.
    void set(VectorField<const T> in, NodeField<T>& field, double factor) {
        for (auto& component : field) {
            std::fill_n(component.data(), component.size(), T(0));
        }
        for (auto& buffer : state.buffers) {
            std::fill_n(buffer.data(), buffer.size(), T(0));
        }
        body->write(in, factor, field);
        for (const auto& effect : effects) {
            effect->state_was_set();
        }
    }

    void check_cut(const Lattice& lattice, std::span<const std::uint32_t> cells) {
        if (!body->can_be_cut()) {
            throw std::invalid_argument("layout \"" + body->describe().layout +
                                        "\" cannot be cut while it moves: flat-rows, active-rows and gather-rows can");
        }
        for (const std::uint32_t cell : cells) {
            if (cell >= lattice.cell_scales().size()) {
                throw std::invalid_argument("cell " + std::to_string(cell) + ": the lattice has " +
                                            std::to_string(lattice.cell_scales().size()));
            }
        }
        if (!numbers) {
            numbers.emplace(lattice, body->node_count());
            grid = lattice.cells();
        }
        if (grid != lattice.cells()) {
            throw std::invalid_argument("the lattice has another grid than the one that the body was made from");
        }
    }

    PlannedBody<T> planned;
    const Body<T>* body;
    mutable State<T> state; ///< forces are scratch: computed on demand by calls that leave the motion as it is
    double wave_speed;      ///< m/s, at most: no wave passes an edge in less than the critical time step
    std::vector<std::unique_ptr<StepEffect<T>>> effects;
    Contact<T>* contact = nullptr;       ///< one of the effects; nullptr without obstacles
    std::optional<SurfaceNode> touching; ///< one of those that may touch, if there are any
    SpringDamping<T>* damping = nullptr; ///< one of them, or none
    std::vector<PrescribedComponent<T>> prescribed;
    std::vector<LoadedComponent<T>> loaded;
    std::vector<NodalLoad> loads;        ///< that `loaded` comes from
    std::optional<NodeNumbers> numbers;  ///< from the first cut on
    std::array<int, 3> grid = {0, 0, 0}; ///< likewise
};

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
    const double scale = 1 / body.length_unit();
    std::vector<PrescribedComponent<T>> components;
    for (const PrescribedNode& p : nodes) {
        if (p.node >= body.node_count()) {
            throw std::invalid_argument("prescribed node " + std::to_string(p.node) + ": the body has " +
                                        std::to_string(body.node_count()) + " nodes");
        }
        const std::size_t index = body.index_of(p.node);
        for (std::size_t c = 0; c < 3; ++c) {
            if (p.axes >> c & 1) {
                if (!std::isfinite(p.displacement[c])) {
                    refuse("prescribed displacement", p.node, p.displacement[c]);
                }
                if (!std::isfinite(p.velocity[c])) {
                    refuse("prescribed velocity", p.node, p.velocity[c]);
                }
                components.push_back({index, static_cast<int>(c), static_cast<T>(p.displacement[c] * scale),
                                      static_cast<T>(p.velocity[c] * scale)});
            }
        }
    }
    implementation_->prescribed = std::move(components);
    for (const auto& effect : implementation_->effects) {
        effect->set_prescribed(implementation_->prescribed);
    }
    Body<T>::set_prescribed(implementation_->state, implementation_->prescribed);
}

template <class T>
void ExplicitDynamics<T>::load(std::span<const NodalLoad> loads) {
    const Body<T>& body = *implementation_->body;
    std::map<std::uint32_t, std::array<double, 3>> forces;
    for (const NodalLoad& load : loads) {
        if (load.node >= body.node_count()) {
            throw std::invalid_argument("loaded node " + std::to_string(load.node) + ": the body has " +
                                        std::to_string(body.node_count()) + " nodes");
        }
        for (std::size_t c = 0; c < 3; ++c) {
            if (!std::isfinite(load.force[c])) {
                throw std::invalid_argument("load on node " + std::to_string(load.node) + ": the force along " +
                                            "xyz"[c] + " is not finite");
            }
            forces[load.node][c] += load.force[c];
        }
    }
    std::vector<LoadedComponent<T>> components;
    for (const auto& [node, force] : forces) {
        for (std::size_t c = 0; c < 3; ++c) {
            if (force[c] != 0 && body.masses()[node] > 0) { // not where all cells have been cut away
                const double acceleration = force[c] / (body.masses()[node] * body.length_unit());
                components.push_back({body.index_of(node), static_cast<int>(c), static_cast<T>(acceleration)});
            }
        }
    }
    implementation_->loaded = std::move(components);
    implementation_->loads.clear();
    for (const auto& [node, force] : forces) {
        if (force != std::array<double, 3>{0, 0, 0}) {
            implementation_->loads.push_back({node, force});
        }
    }
}

template <class T>
bool ExplicitDynamics<T>::can_remove_cells() const {
    return implementation_->body->can_be_cut();
}

template <class T>
std::size_t ExplicitDynamics<T>::remove_cells(Lattice& lattice, std::span<const std::uint32_t> cells) {
    Implementation& i = *implementation_;
    i.check_cut(lattice, cells);
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
    for (const CutNode& node : nodes) {
        if (i.body->masses()[node.node] == 0) { // nothing would slow it down
            for (std::size_t c = 0; c < 3; ++c) {
                const Component<T> v = component(i.state.velocity, c);
                v.first[static_cast<std::ptrdiff_t>(i.body->index_of(node.node)) * v.stride] = 0;
            }
        }
    }
    if (i.touching) {
        const std::array<double, 3> low = lattice.rest_position(i.numbers->grid_node(i.touching->node));
        std::vector<SurfaceNode> around;
        for (const CutNode& node : nodes) {
            SurfaceNode& bared = around.emplace_back(SurfaceNode{node.node, i.touching->rest_position});
            for (std::size_t a = 0; a < 3; ++a) {
                bared.rest_position[a] += lattice.cell_size() * static_cast<double>(node.place[a]) - low[a];
            }
        }
        i.contact->surface_was_cut(*i.body, around);
    }
    if (!i.loads.empty()) { // the same forces on other masses
        load(std::vector<NodalLoad>(i.loads));
    }
    return removed;
}

template <class T>
void ExplicitDynamics<T>::set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles) {
    Implementation& all = *implementation_;
    auto made =
        obstacles.empty() ? nullptr : std::make_unique<Contact<T>>(*all.body, all.wave_speed, surface, obstacles);
    std::erase_if(all.effects, [&](const auto& effect) { return effect.get() == all.contact; });
    all.contact = made.get();
    all.touching.reset();
    if (made) {
        if (!surface.empty()) {
            all.touching = surface.front();
        }
        all.effects.push_back(std::move(made));
    }
}

template <class T>
void ExplicitDynamics<T>::damp_springs(double stiffness_damping) {
    if (!(stiffness_damping >= 0) || !std::isfinite(stiffness_damping)) {
        throw std::invalid_argument("stiffness_damping = " + std::to_string(stiffness_damping) +
                                    " is not allowed: it must be finite and at least 0 s");
    }
    Implementation& i = *implementation_;
    std::erase_if(i.effects, [&](const auto& effect) { return effect.get() == i.damping; });
    i.damping = nullptr;
    if (stiffness_damping > 0) {
        auto damping = std::make_unique<SpringDamping<T>>(stiffness_damping);
        damping->set_prescribed(i.prescribed);
        i.damping = damping.get();
        i.effects.push_back(std::move(damping));
    }
}

template <class T>
void ExplicitDynamics<T>::move_obstacles(std::span<const RigidPose> poses) {
    if (!implementation_->contact) {
        if (!poses.empty()) {
            throw std::invalid_argument(std::to_string(poses.size()) + " poses given: the body has no obstacles");
        }
        return;
    }
    implementation_->contact->move(poses);
}

template <class T>
std::vector<ObstacleReading> ExplicitDynamics<T>::obstacle_readings() const {
    const Implementation& all = *implementation_;
    return all.contact ? all.contact->readings(*all.body, all.state) : std::vector<ObstacleReading>();
}

template <class T>
void ExplicitDynamics<T>::step(const StepParameters& parameters, long count) {
    implementation_->body->step(implementation_->state, parameters,
                                {implementation_->effects, implementation_->prescribed, implementation_->loaded},
                                count);
}

template <class T>
void ExplicitDynamics<T>::get_displacements(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    body.read(implementation_->state.displacement, body.length_unit(), out);
}
template <class T>
void ExplicitDynamics<T>::get_velocities(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    body.read(implementation_->state.velocity, body.length_unit(), out);
}
template <class T>
void ExplicitDynamics<T>::set_displacements(VectorField<const T> in) {
    check_finite(in, "displacement");
    implementation_->set(in, implementation_->state.displacement, 1 / implementation_->body->length_unit());
}
template <class T>
void ExplicitDynamics<T>::set_velocities(VectorField<const T> in) {
    check_finite(in, "velocity");
    implementation_->set(in, implementation_->state.velocity, 1 / implementation_->body->length_unit());
}
template <class T>
std::vector<T> ExplicitDynamics<T>::exact_state() const {
    const Body<T>& body = *implementation_->body;
    std::vector<T> values(6 * body.node_count());
    body.read(implementation_->state.displacement, 1, VectorField<T>::aos(values.data(), body.node_count(), 6));
    body.read(implementation_->state.velocity, 1, VectorField<T>::aos(values.data() + 3, body.node_count(), 6));
    return values;
}
template <class T>
void ExplicitDynamics<T>::set_exact_state(std::span<const T> values) {
    const std::size_t nodes = implementation_->body->node_count();
    if (values.size() != 6 * nodes) {
        throw std::invalid_argument("state of " + std::to_string(values.size()) + " values given: the body's " +
                                    std::to_string(nodes) + " nodes have six each");
    }
    implementation_->set(VectorField<const T>::aos(values.data(), nodes, 6), implementation_->state.displacement, 1);
    implementation_->set(VectorField<const T>::aos(values.data() + 3, nodes, 6), implementation_->state.velocity, 1);
}
template <class T>
void ExplicitDynamics<T>::get_forces(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    body.compute_forces(implementation_->state);
    body.read(implementation_->state.force, 1, out);
}

template <class T>
void ExplicitDynamics<T>::get_effect_forces(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    State<T>& state = implementation_->state;
    NodeField<T> force;
    Body<T>::allocate_like(state.velocity, force);
    for (const auto& effect : implementation_->effects) {
        effect->add_forces(body, state, force);
    }
    body.read(force, 1, out);
}

template <class T>
std::vector<EffectEnergy> ExplicitDynamics<T>::effect_energies() const {
    const Body<T>& body = *implementation_->body;
    State<T>& state = implementation_->state;
    std::vector<EffectEnergy> energies;
    for (const auto& effect : implementation_->effects) {
        energies.push_back({std::string(effect->name()), effect->energy(body, state), effect->dissipated(body, state)});
    }
    return energies;
}

template <class T>
std::vector<double> ExplicitDynamics<T>::effect_memory() const {
    std::vector<double> memory;
    for (const auto& effect : implementation_->effects) {
        const std::vector<double> part = effect->memory();
        memory.insert(memory.end(), part.begin(), part.end());
    }
    return memory;
}

template <class T>
void ExplicitDynamics<T>::set_effect_memory(std::span<const double> memory) {
    std::size_t wanted = 0;
    for (const auto& effect : implementation_->effects) {
        wanted += effect->memory_size();
    }
    if (memory.size() != wanted) {
        throw std::invalid_argument("effect memory of " + std::to_string(memory.size()) +
                                    " numbers given: the body's effects have " + std::to_string(wanted));
    }
    for (const auto& effect : implementation_->effects) {
        effect->set_memory(memory.first(effect->memory_size()));
        memory = memory.subspan(effect->memory_size());
    }
}

template <class T>
std::span<const double> ExplicitDynamics<T>::masses() const {
    return implementation_->body->masses();
}
template <class T>
PotentialEnergy ExplicitDynamics<T>::potential_energy() const {
    return implementation_->body->energy(implementation_->state);
}
template <class T>
double ExplicitDynamics<T>::kinetic_energy() const {
    return implementation_->body->kinetic_energy(implementation_->state);
}
template <class T>
double ExplicitDynamics<T>::critical_time_step() const {
    const Implementation& all = *implementation_;
    const FrequencyBounds bounds =
        all.contact ? all.body->frequencies().with(all.contact->obstacles()) : all.body->frequencies();
    return bounds.critical_time_step(all.damping ? all.damping->seconds() : 0);
}
template <class T>
PlanDescription ExplicitDynamics<T>::describe() const {
    PlanDescription description = implementation_->planned.describe();
    description.bytes += implementation_->state.bytes();
    description.bytes += implementation_->prescribed.size() * sizeof(PrescribedComponent<T>);
    description.bytes += implementation_->loaded.size() * sizeof(LoadedComponent<T>);
    for (const auto& effect : implementation_->effects) {
        description.bytes += effect->bytes();
    }
    return description;
}

template class ExplicitDynamics<float>;
template class ExplicitDynamics<double>;

} // namespace hybmss
