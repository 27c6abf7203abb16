#include "solvers/newton/potential.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss {
template <class T>
Potential<T>::Potential(const Body<T>& body, const BodyScales& scales, const SolidCells& solid, Sections sections)
    : body_(&body), space_(body), volumes_(body, solid), turning_(body, std::move(sections)),
      force_floor_(1e-9 * scales.spring_force), length_(scales.spring_length / body.length_unit()),
      extent_(scales.extent / body.length_unit()), free_(space_.make()), load_(space_.make()) {
    places_.resize(body.node_count());
    for (std::size_t n = 0; n < places_.size(); ++n) {
        places_[n] = static_cast<std::uint32_t>(body.index_of(n));
    }
    prescribe({});
}

template <class T>
void Potential<T>::share(const Lattice& lattice, const Ranks& ranks) {
    shared_ = std::make_unique<SharedNodes<T>>(*body_, lattice, ranks);
    space_.share(shared_.get());
}

template <class T>
std::size_t Potential<T>::flat_index(std::size_t node, std::size_t axis, std::size_t& array) const {
    const Component<const T> all = component(free_.field, axis);
    array = all.stride == 1 ? axis : 0;
    return static_cast<std::size_t>(all.first - free_.field[array].data()) +
           places_[node] * static_cast<std::size_t>(all.stride);
}

template <class T>
void Potential<T>::prescribe(std::span<const PrescribedNode> nodes) {
    held_.assign(body_->node_count(), 0);
    turning_holds_ = false;
    prescribed_.clear();
    space_.clear(free_);
    for (const PrescribedNode& p : nodes) {
        if (p.node >= held_.size()) {
            throw std::invalid_argument("prescribed node " + std::to_string(p.node) + ": the body has " +
                                        std::to_string(held_.size()) + " nodes");
        }
        for (std::size_t c = 0; c < 3; ++c) {
            if (p.axes >> c & 1) {
                if (held_[p.node] >> c & 1) {
                    throw std::invalid_argument("prescribed node " + std::to_string(p.node) + ": given twice along " +
                                                "xyz"[c] + "; each axis of a node may be given once");
                }
                const auto displacement = static_cast<T>(p.displacement[c] / body_->length_unit());
                if (!std::isfinite(displacement)) {
                    throw std::invalid_argument("prescribed displacement of node " + std::to_string(p.node) +
                                                ": it must be finite" +
                                                (std::isfinite(p.displacement[c]) ? " in the body's precision" : ""));
                }
                std::size_t array = 0;
                const std::size_t index = flat_index(p.node, c, array);
                prescribed_.push_back({array, index, displacement});
            }
        }
        held_[p.node] = static_cast<std::uint8_t>(held_[p.node] | (p.axes & 7u));
    }
    free_count_ = 0;
    for (std::size_t n = 0; n < held_.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            if ((held_[n] >> c & 1) == 0) {
                std::size_t array = 0;
                const std::size_t index = flat_index(n, c, array);
                free_.field[array][index] = 1;
                ++free_count_;
            }
        }
    }
}

template <class T>
void Potential<T>::load(std::span<const std::array<double, 3>> forces, const std::array<double, 3>& acceleration) {
    const std::span<const double> masses = body_->masses();
    if (!forces.empty() && forces.size() != masses.size()) {
        throw std::invalid_argument(std::to_string(forces.size()) + " nodal loads given: the body has " +
                                    std::to_string(masses.size()) + " nodes");
    }
    largest_load_ = 0;
    resultant_ = load_size_ = {0, 0, 0};
    for (std::size_t n = 0; n < masses.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double force = masses[n] * acceleration[c] + (forces.empty() ? 0 : forces[n][c]);
            if (!std::isfinite(static_cast<T>(force))) {
                throw std::invalid_argument("load on node " + std::to_string(n) + ": it must be finite" +
                                            (std::isfinite(force) ? " in the body's precision" : ""));
            }
            largest_load_ = std::max(largest_load_, std::abs(force));
            resultant_[c] += force;
            load_size_[c] += std::abs(force);
            std::size_t array = 0;
            const std::size_t index = flat_index(n, c, array);
            load_.field[array][index] = static_cast<T>(force);
        }
    }
    if (shared_) {
        add_up(load_);
        largest_load_ = space_.largest_component(load_);
        shared_->ranks().sum(resultant_);
        shared_->ranks().sum(load_size_);
    }
    loaded_ = largest_load_ > 0;
}

template <class T>
void Potential<T>::press(std::span<const SurfaceFace> faces, std::span<const double> pressures) {
    auto pressure = faces.empty() ? nullptr : std::make_unique<PressurePotential<T>>(*body_, faces);
    if (pressure) {
        pressure->set(pressures);
    } else {
        check_pressures(pressures, 0);
    }
    pressure_ = std::move(pressure);
}

template <class T>
void Potential<T>::set_pressures(std::span<const double> pressures, std::span<const PrescribedNode> held) {
    if (pressure_) {
        pressure_->set(pressures, held);
    } else {
        check_pressures(pressures, 0);
    }
}

template <class T>
void Potential<T>::actuate(std::unique_ptr<ActuatedBody<T>> actuation) {
    actuation_ = std::move(actuation);
    if (actuation_) {
        set_rest_stretches(actuation_->stretches());
    }
}

template <class T>
void Potential<T>::set_rest_stretches(std::span<const RestStretch> stretches) {
    if (!actuation_) {
        throw std::invalid_argument(std::to_string(stretches.size()) + " stretches given: the body has no cells of "
                                                                       "another size at rest");
    }
    actuation_->set(std::vector<RestStretch>(stretches.begin(), stretches.end()));
    NodeVector<T> forces = space_.make();
    actuation_->add_forces(*body_, body_->make_state(false), 1, forces.field);
    largest_actuation_ = space_.largest_component(forces);
}

template <class T>
void Potential<T>::set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles) {
    contact_ = obstacles.empty() ? nullptr : std::make_unique<ContactPotential<T>>(*body_, surface, obstacles);
    touched_.clear();
}

template <class T>
void Potential<T>::move_obstacles(std::span<const RigidPose> poses) {
    if (contact_ && !poses.empty()) {
        contact_->move(poses);
    } else if (!poses.empty()) {
        throw std::invalid_argument(std::to_string(poses.size()) + " poses given: the body has no obstacles");
    }
}

template <class T>
void Potential<T>::touch(std::span<const TouchedNode> nodes, double factor) {
    touched_.assign(nodes.begin(), nodes.end());
    for (TouchedNode& touched : touched_) {
        for (std::size_t e = 0; e < 6; ++e) {
            touched.along[e] *= factor;
            touched.whole[e] *= factor;
        }
    }
}

template <class T>
void Potential<T>::linearise(State<T>& state, bool contact) {
    linearised_ = &state;
    if (contact_) {
        touched_ = contact ? contact_->second_derivatives(state) : std::vector<TouchedNode>();
    }
}

template <class T>
double Potential<T>::expect(std::vector<ComingTouch> touches, NodeVector<T>& gradient) {
    const std::vector<ComingTouch> coming =
        touches.empty() ? std::move(touches) : contact_->coming(std::move(touches), *linearised_);
    if (coming.empty()) {
        return -1;
    }
    double stored = 0;
    for (const ComingTouch& touch : coming) {
        TouchedNode& touched = touched_.emplace_back(TouchedNode{touch.node, {}, {}});
        add_square(touch.stiffness, touch.normal, touched.along);
        touched.whole = touched.along;
        stored += 0.5 * touch.stiffness * touch.gap * touch.gap;
        for (std::size_t a = 0; a < 3; ++a) {
            if ((held_[touch.node] >> a & 1) == 0) {
                const Component<T> g = component(gradient.field, a);
                g.first[static_cast<std::ptrdiff_t>(places_[touch.node]) * g.stride] +=
                    static_cast<T>(touch.stiffness * touch.gap * touch.normal[a]);
            }
        }
    }
    return stored;
}

template <class T>
void Potential<T>::pull(double strength, VectorField<const T> towards) {
    if (!(strength >= 0 && std::isfinite(strength))) {
        throw std::invalid_argument("strength of the pull = " + std::to_string(strength) +
                                    ": it must be finite and at least 0");
    }
    if (pull_target_.field[0].size() == 0) { // static solves do without
        pull_target_ = space_.make();
        pull_weight_ = space_.make();
    }
    body_->write(towards, 1 / body_->length_unit(), pull_target_.field);
    if (strength == pull_strength_) {
        return;
    }
    pull_strength_ = strength;
    const std::span<const double> masses = body_->masses();
    pull_stiffness_.resize(masses.size());
    for (std::size_t n = 0; n < masses.size(); ++n) {
        pull_stiffness_[n] = strength * masses[n] * body_->length_unit();
        for (std::size_t c = 0; c < 3; ++c) {
            std::size_t array = 0;
            const std::size_t index = flat_index(n, c, array);
            pull_weight_.field[array][index] = static_cast<T>(pull_stiffness_[n]);
        }
    }
}

template <class T>
void Potential<T>::damp(double strength, VectorField<const T> from) {
    if (strength == 0) {
        damping_.reset();
        return;
    }
    if (!damping_) {
        damping_ = std::make_unique<Damping>(Damping{0, body_->make_state(false), space_.make(), space_.make()});
    }
    damping_->strength = strength;
    body_->write(from, 1 / body_->length_unit(), damping_->from.displacement);
}

template <class T>
void Potential<T>::apply_damping(const NodeField<T>& p) const {
    space_.clear(damping_->product);
    body_->workers().run(
        body_->spring_stages(damping_->from, {kernels::SpringLaw::damping}, &p, damping_->product.field), 1);
}

template <class T>
void Potential<T>::apply_damping(const State<T>& state) const {
    const FieldView<T> u{state.displacement}, from{damping_->from.displacement};
    space_.for_each([](const T& q, const T& q_n, T& away) { away = q - q_n; }, u, from, damping_->away);
    apply_damping(damping_->away.field);
}

template <class T>
double Potential<T>::dissipation(State<T>& state) const {
    if (!damping_) {
        return 0;
    }
    apply_damping(state);
    return damping_->strength * body_->length_unit() * space_.dot(damping_->away, damping_->product);
}

template <class T>
void Potential<T>::impose(State<T>& state) const {
    for (const Held& held : prescribed_) {
        state.displacement[held.array][held.index] = held.displacement;
    }
}

template <class T>
bool Potential<T>::prescribed_to_move(const State<T>& state) const {
    return std::any_of(prescribed_.begin(), prescribed_.end(), [&](const Held& held) {
        return state.displacement[held.array][held.index] != held.displacement;
    });
}

template <class T>
unsigned Potential<T>::held_axes() const {
    unsigned held = 0;
    for (const std::uint8_t axes : held_) {
        held |= axes;
    }
    for (unsigned c = 0; shared_ && c < 3; ++c) {
        held |= shared_->ranks().largest(held >> c & 1u) > 0 ? 1u << c : 0u;
    }
    return held;
}

template <class T>
void Potential<T>::balance_as_a_whole(const NodeVector<T>& gradient, State<T>& state) const {
    for (std::size_t c = 0; c < 3; ++c) {
        if (held_axes() >> c & 1u) {
            continue;
        }
        double force = 0, stiffness = 0;
        std::size_t array = 0;
        for (std::size_t n = 0; n < places_.size(); ++n) {
            const std::size_t i = flat_index(n, c, array);
            force += static_cast<double>(gradient.field[array][i]);
            stiffness += pull_stiffness_[n];
        }
        for (std::size_t n = 0; n < places_.size(); ++n) {
            T& u = state.displacement[array][flat_index(n, c, array)];
            u = static_cast<T>(static_cast<double>(u) - force / stiffness);
        }
    }
}

template <class T>
void Potential<T>::prescribed_step(const State<T>& state, NodeVector<T>& step) const {
    space_.clear(step);
    for (const Held& held : prescribed_) {
        step.field[held.array][held.index] = held.displacement - state.displacement[held.array][held.index];
    }
}

template <class T>
Turning<T>* Potential<T>::turning() {
    if (pull_strength_ > 0 || shared_) { // of a part's sections nobody knows how the others turn
        return nullptr;
    }
    if (!turning_holds_) {
        turning_.hold(held_);
        turning_holds_ = true;
    }
    return turning_.pays() ? &turning_ : nullptr;
}

template <class T>
int Potential<T>::falling_axis() const {
    for (std::size_t c = 0; c < 3 && pull_strength_ == 0 && !contact_; ++c) {
        const bool falls = std::abs(resultant_[c]) > 1e-9 * load_size_[c];
        if (falls && (held_axes() >> c & 1u) == 0) {
            return static_cast<int>(c);
        }
    }
    return -1;
}

template <class T>
VolumeRatios Potential<T>::volume_ratios(const State<T>& state) const {
    VolumeRatios ratios = volumes_.ratios(state);
    if (shared_) {
        ratios = {-shared_->ranks().largest(-ratios.min), shared_->ranks().largest(ratios.max)};
    }
    return ratios;
}

template <class T>
auto Potential<T>::value(State<T>& state) const -> Value {
    PotentialEnergy energy = body_->energy(state);
    if (shared_) {
        energy = {shared_->ranks().sum(energy.springs), shared_->ranks().sum(energy.volume)};
    }
    Value value;
    value.total = energy.total() / body_->length_unit();
    value.size = (std::abs(energy.springs) + std::abs(energy.volume)) / body_->length_unit();
    const FieldView<T> u{state.displacement};
    if (loaded_) {
        const double work = space_.sum(
            [](const T& f, const T& q) { return static_cast<double>(f) * static_cast<double>(q); }, load_, u);
        value.total -= work;
        value.size += std::abs(work);
    }
    if (pressure_ && pressure_->acts()) {
        double size = 0;
        value.total += pressure_->value(state, &size) / body_->length_unit();
        value.size += size / body_->length_unit();
    }
    if (actuation_) {
        const double actuation = actuation_->energy(state) / body_->length_unit();
        value.total += actuation;
        value.size += std::abs(actuation);
    }
    if (contact_) {
        const double contact = contact_->value(state) / body_->length_unit();
        value.total += contact;
        value.size += contact;
    }
    if (pull_strength_ > 0) {
        const double pull = space_.sum(
            [](const T& q, const T& target, const T& weight) {
                const double away = static_cast<double>(q) - static_cast<double>(target);
                return 0.5 * static_cast<double>(weight) * away * away;
            },
            u, pull_target_, pull_weight_);
        value.total += pull;
        value.size += pull;
    }
    if (damping_) {
        apply_damping(state);
        const double damping = 0.5 * damping_->strength * space_.dot(damping_->away, damping_->product);
        value.total += damping;
        value.size += damping;
    }
    return value;
}

template <class T>
Balance Potential<T>::gradient(State<T>& state, NodeVector<T>& gradient) const {
    body_->compute_forces(state);
    if (actuation_) {
        actuation_->add_forces(*body_, state, 1, state.force);
    }
    if (shared_) {
        shared_->add_up(state.force);
    }
    const FieldView<T> force{state.force}, u{state.displacement};
    if (pull_strength_ > 0) {
        space_.for_each([](const T& f, const T& load, const T& q, const T& target, const T& weight,
                           T& g) { g = weight * (q - target) - (f + load); },
                        force, load_, u, pull_target_, pull_weight_, gradient);
    } else {
        space_.for_each([](const T& f, const T& load, T& g) { g = -(f + load); }, force, load_, gradient);
    }
    if (damping_) {
        apply_damping(state);
        space_.add_multiple(damping_->strength, damping_->product, gradient);
    }
    Balance balance;
    balance.load = actuation_ ? std::max(largest_load_, largest_actuation_) : largest_load_;
    if (contact_) {
        balance.support = contact_->add_gradient(state, gradient.field);
    }
    for (const Held& held : prescribed_) {
        balance.support =
            std::max(balance.support, std::abs(static_cast<double>(gradient.field[held.array][held.index])));
        gradient.field[held.array][held.index] = 0;
    }
    if (shared_) {
        balance.support = shared_->ranks().largest(balance.support);
    }
    if (pressure_ && pressure_->acts()) { // on what is free alone, as the next line sees to
        balance.load = std::max(balance.load, pressure_->largest_force());
        pressure_->add_gradient(state, gradient.field);
    }
    // Whatever the kernels left in the padding is no force.
    space_.for_each([](const T& free, T& g) { g = free != 0 ? g : T(0); }, free_, gradient);
    balance.unbalanced = space_.largest_component(gradient);
    return balance;
}

template <class T>
void Potential<T>::multiply_body(const NodeVector<T>& p, NodeVector<T>& out, Curvature curvature) const {
    body_->hessian_product(*linearised_, p.field, out.field, curvature);
    add_up(out);
    if (damping_) {
        apply_damping(p.field);
        space_.add_multiple(damping_->strength, damping_->product, out);
    }
    if (pressure_ && pressure_->acts() && curvature == Curvature::whole) {
        pressure_->add_product(*linearised_, p.field, out.field);
    }
    if (actuation_) {
        actuation_->add_product(*body_, *linearised_, p.field, out.field);
    }
    if (!touched_.empty()) {
        constexpr std::size_t kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        const Component<const T> from[3] = {component(p.field, 0), component(p.field, 1), component(p.field, 2)};
        const Component<T> to[3] = {component(out.field, 0), component(out.field, 1), component(out.field, 2)};
        const std::ptrdiff_t stride = to[0].stride;
        for (const TouchedNode& touched : touched_) {
            const Symmetric& block = curvature == Curvature::whole ? touched.whole : touched.along;
            const std::ptrdiff_t at = stride * static_cast<std::ptrdiff_t>(places_[touched.node]);
            for (std::size_t i = 0; i < 3; ++i) {
                double sum = 0;
                for (std::size_t j = 0; j < 3; ++j) {
                    sum += block[kEntry[i][j]] * static_cast<double>(from[j].first[at]);
                }
                to[i].first[at] += static_cast<T>(sum);
            }
        }
    }
}

template <class T>
void Potential<T>::multiply(const NodeVector<T>& p, NodeVector<T>& out, Curvature curvature) const {
    multiply_body(p, out, curvature);
    if (pull_strength_ > 0) {
        space_.for_each([](const T& weight, const T& x, const T& free, T& y) { y = free * (y + weight * x); },
                        pull_weight_, p, free_, out);
    } else {
        space_.for_each([](const T& free, T& y) { y *= free; }, free_, out);
    }
}

template <class T>
void Potential<T>::diagonal(AlignedArray<T> (&blocks)[6], Curvature curvature) const {
    body_->hessian_diagonal(*linearised_, blocks, curvature);
    if (shared_) {
        shared_->add_up(blocks);
    }
    if (damping_) {
        AlignedArray<T> more[6];
        body_->spring_diagonal(damping_->from, {kernels::SpringLaw::damping}, more);
        const T strength = static_cast<T>(damping_->strength);
        for (std::size_t e = 0; e < 6; ++e) {
            for (std::size_t n = 0; n < more[e].size(); ++n) {
                blocks[e][n] += strength * more[e][n];
            }
        }
    }
    if (actuation_) {
        actuation_->add_diagonal(*body_, *linearised_, blocks);
    }
    for (const TouchedNode& touched : touched_) {
        constexpr std::size_t kOrder[6] = {0, 3, 4, 1, 5, 2}; // xx, xy, xz, yy, yz, zz
        const Symmetric& block = curvature == Curvature::whole ? touched.whole : touched.along;
        for (std::size_t e = 0; e < 6; ++e) {
            blocks[kOrder[e]][places_[touched.node]] += static_cast<T>(block[e]);
        }
    }
}

template class Potential<float>;
template class Potential<double>;

} // namespace hybmss
