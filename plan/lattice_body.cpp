#include "plan/lattice_body.hpp"

#include "plan/critical_time_step.hpp"
#include "plan/plan_description.hpp"

#include <algorithm>
#include <bit>

namespace hybmss {

using kernels::Finish;
using kernels::StepConstants;

namespace {

/// Slabs of at least three layers, at most sixteen of them: a join costs about a twentieth of a layer, and what crosses
/// from core to core far more; so no more of them either than threads that are of use, but two where there are layers
/// enough. A power of two, so that two, four and eight threads get equal shares.
std::vector<std::size_t> divide_into_slabs(std::size_t layers, std::size_t nodes) {
    const std::size_t of_use = std::clamp<std::size_t>(1 + nodes / kNodesPerThread, 2, 16);
    const std::size_t slabs = std::bit_floor(std::clamp<std::size_t>(layers / 3, 1, of_use));
    std::vector<std::size_t> begin;
    for (std::size_t s = 0; s <= slabs; ++s) {
        begin.push_back(layers * s / slabs);
    }
    return begin;
}

template <class T>
void point_to(T* (&pointers)[3], AlignedArray<T>* arrays, const std::array<std::size_t, 3>& axes, std::size_t offset) {
    for (std::size_t c = 0; c < 3; ++c) {
        pointers[c] = arrays[axes[c]].data() + offset;
    }
}

/// Buffers have the layout's own components.
template <class T>
void point_to(T* (&pointers)[3], AlignedArray<T>* arrays) {
    point_to(pointers, arrays, {0, 1, 2}, 0);
}

} // namespace

template <class T>
LatticeBody<T>::LatticeBody(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : Body<T>(Workers(useful_threads(options.threads, lattice.grid_node_count()))), layout_(lattice, material),
      table_(&kernels::kernel_table<T>(resolve(options.instruction_set))),
      face_diagonals_(material.face_diagonal_ratio > 0), volume_(kernel_volume(resolved_volume_energy(material))),
      accuracy_(options.accuracy), slab_begin_(divide_into_slabs(layout_.planes - 1, lattice.grid_node_count())),
      critical_time_step_(lattice_critical_time_step(lattice, material)),
      springs_(lattice.merged_springs(face_diagonals_).total()), cells_(lattice.cell_count()) {}

template <class T>
State<T> LatticeBody<T>::make_state(bool moving) const {
    State<T> state;
    for (std::size_t c = 0; c < 3; ++c) {
        state.displacement[c] = AlignedArray<T>(layout_.size());
        if (moving) {
            state.velocity[c] = AlignedArray<T>(layout_.size());
        }
    }
    // Three components each: the upper and the lower sum at every join, and two planes a worker that take turns.
    const std::size_t joins = slabs() - 1;
    const std::size_t count = 6 * joins + 6 * static_cast<std::size_t>(this->workers().threads());
    for (std::size_t b = 0; b < count; ++b) {
        state.buffers.emplace_back(layout_.plane);
    }
    return state;
}

template <class T>
auto LatticeBody<T>::layer_at(State<T>& state, std::size_t k) const -> Layer {
    Layer layer{};
    layer.row = static_cast<std::ptrdiff_t>(layout_.row);
    layer.lanes = static_cast<std::ptrdiff_t>(layout_.lanes);
    layer.plane = static_cast<std::ptrdiff_t>(layout_.plane);
    const std::size_t offset = k * layout_.plane;
    // Fields hold the body's components; the kernels' follow the layout's axes.
    for (std::size_t c = 0; c < 3; ++c) {
        auto& displacement = state.displacement[layout_.axes[c]];
        auto& velocity = state.velocity[layout_.axes[c]];
        layer.displacement[c] = displacement.data() + offset;
        layer.velocity[c] = velocity.size() ? velocity.data() + offset : nullptr;
    }
    layer.inverse_mass = layout_.inverse_mass.data() + offset;
    for (std::size_t kind = 0; kind < 7; ++kind) {
        layer.stiffness[kind] = layout_.stiffness[kind].data() + offset;
    }
    layer.volume_ratio = layout_.volume_ratio;
    return layer;
}

template <class T>
void LatticeBody<T>::sweep_slab(State<T>& state, std::size_t slab, std::size_t worker, Finish finish,
                                const StepConstants<T>& step) const {
    const std::size_t first = slab_begin_[slab], end = slab_begin_[slab + 1];
    const bool lowest = slab == 0, highest = slab + 1 == slabs();
    AlignedArray<T>* const joins = state.buffers.data();
    AlignedArray<T>* const own = joins + 6 * (slabs() - 1) + 6 * worker;
    const auto& layers =
        table_->lattice->layer[face_diagonals_][static_cast<int>(volume_)][static_cast<int>(accuracy_)];
    const auto& tops = table_->lattice->top[face_diagonals_][static_cast<int>(accuracy_)];

    Layer layer = layer_at(state, first);
    layer.step = step;
    if (finish == Finish::store) {
        point_to(layer.partial, state.force, layout_.axes, first * layout_.plane);
    } else if (lowest) {
        point_to(layer.partial, own);
    } else {
        point_to(layer.partial, joins + 6 * (slab - 1));
    }
    for (T* partial : layer.partial) {
        std::fill_n(partial, layout_.plane, T(0));
    }
    for (std::size_t k = first; k < end; ++k) {
        if (k + 1 == end && !highest) {
            point_to(layer.above, joins + 6 * slab + 3);
        } else if (finish == Finish::store) {
            point_to(layer.above, state.force, layout_.axes, (k + 1) * layout_.plane);
        } else {
            point_to(layer.above, own + 3 * ((k + 1 - first) % 2));
        }
        const bool joined = k == first && !lowest;
        layers[static_cast<int>(joined ? Finish::store : finish)](layer);

        Layer next = layer_at(state, k + 1);
        next.step = step;
        std::copy_n(layer.above, 3, next.partial);
        layer = next;
    }
    if (highest) {
        tops[static_cast<int>(finish)](layer);
    }
}

template <class T>
void LatticeBody<T>::join(State<T>& state, std::size_t join, Finish finish, const StepConstants<T>& step) const {
    Layer layer = layer_at(state, slab_begin_[join + 1]);
    layer.step = step;
    if (finish == Finish::store) {
        point_to(layer.partial, state.force, layout_.axes, slab_begin_[join + 1] * layout_.plane);
    } else {
        point_to(layer.partial, state.buffers.data() + 6 * join);
    }
    point_to(layer.above, state.buffers.data() + 6 * join + 3);
    table_->lattice->join[static_cast<int>(finish)](layer);
}

template <class T>
std::vector<Stage> LatticeBody<T>::sweep(State<T>& state, Finish finish, const StepConstants<T>& step) const {
    return {{slabs(), [this, &state, &step, finish](
                          std::size_t slab, std::size_t worker) { sweep_slab(state, slab, worker, finish, step); }},
            {slabs() - 1, [this, &state, &step, finish](std::size_t j, std::size_t) { join(state, j, finish, step); }}};
}

template <class T>
void LatticeBody<T>::compute_forces(State<T>& state) const {
    for (auto& force : state.force) {
        if (force.size() == 0) {
            force = AlignedArray<T>(layout_.size());
        }
    }
    const StepConstants<T> none{};
    this->workers().run(sweep(state, Finish::store, none), 1);
}

template <class T>
PotentialEnergy LatticeBody<T>::energy(State<T>& state) const {
    const auto& kernel = table_->lattice->energy[face_diagonals_][static_cast<int>(volume_)];
    std::vector<kernels::LayerEnergy> layers(layout_.planes);
    this->workers().run(layout_.planes, [&](std::size_t k, std::size_t) {
        layers[k] = kernel[k + 1 == layout_.planes](layer_at(state, k));
    });
    // Stiffness is k h and lengths are u / h, so sums are energies divided by h.
    PotentialEnergy sum;
    for (const kernels::LayerEnergy& layer : layers) {
        sum.springs += layout_.cell_size * layer.springs;
        sum.volume += 32 * layout_.cell_size * layer.volume;
    }
    return sum;
}

template <class T>
void LatticeBody<T>::step(State<T>& state, const StepParameters& parameters, const NodeActions<T>& actions,
                          long count) const {
    StepParameters along_axes = parameters;
    for (std::size_t c = 0; c < 3; ++c) {
        along_axes.acceleration[c] = parameters.acceleration[layout_.axes[c]];
    }
    const StepConstants<T> constants = step_constants<T>(along_axes, layout_.cell_size);
    const Finish finish = is_driven(parameters) ? Finish::integrate_driven : Finish::integrate;
    std::vector<Stage> stages = sweep(state, finish, constants);
    Body<T>::add_action_stages(state, parameters, actions, stages);
    this->workers().run(stages, count);
}

template <class T>
PlanDescription LatticeBody<T>::describe() const {
    PlanDescription d;
    d.instruction_set = table_->instruction_set;
    d.layout = "flat-rows";
    d.kernel = "lattice_layer" + kernel_variant(face_diagonals_, volume_, accuracy_);
    d.precision = precision_name<T>();
    d.threads = this->workers().threads();
    d.nodes = layout_.node_count;
    d.springs = springs_;
    d.cells = cells_;
    d.bytes = layout_.bytes();
    d.tiles = slabs();
    return d;
}

template class LatticeBody<float>;
template class LatticeBody<double>;

} // namespace hybmss
