#include "plan/bodies/lattice_body.hpp"

#include "layouts/lattice/lattice_arrays.hpp"
#include "plan/bodies/critical_time_step.hpp"
#include "plan/bodies/plan_description.hpp"

#include <algorithm>
#include <bit>

namespace hybmss {

using kernels::Finish;
using kernels::StepConstants;

namespace {

/// Slabs of at least three layers, at most sixteen of them: a join costs about a tenth of a layer, and what crosses
/// from core to core far more; so no more of them either than threads that are of use, but two where there are layers
/// enough. A power of two, so that two, four and eight threads get equal shares: of the lanes that the layers sweep, as
/// near as layers allow.
template <class T>
std::vector<std::size_t> divide_into_slabs(const LatticeArrays<T>& layout, std::size_t grid_nodes,
                                           const PlanOptions& options) {
    const std::size_t layers = layout.planes - 1;
    // Those that are swept; but at `exact` slabs, and so the order of sums, must not hang on a vector's width.
    const bool exact = options.accuracy == Accuracy::exact;
    const std::size_t nodes = layout.neighbors.empty() ? grid_nodes : exact ? layout.masses.size() : layout.size();
    const std::size_t of_use = std::clamp<std::size_t>(1 + nodes / kNodesPerThread, 2, 16);
    const std::size_t slabs = options.one_tile ? 1 : std::bit_floor(std::clamp<std::size_t>(layers / 3, 1, of_use));
    const std::size_t all = layout.begin[layers] - layout.begin[0];
    std::vector<std::size_t> begin = {0};
    for (std::size_t s = 1; s < slabs; ++s) {
        const auto share =
            std::upper_bound(layout.begin.begin(), layout.begin.end(), layout.begin[0] + all * s / slabs);
        const auto layer = exact ? layers * s / slabs : static_cast<std::size_t>(share - layout.begin.begin()) - 1;
        begin.push_back(std::clamp(layer, begin.back() + 1, layers - (slabs - s)));
    }
    begin.push_back(layers);
    return begin;
}

/// Buffers have the layout's own components, and begin where their plane does.
template <class T>
void point_to(T* (&pointers)[3], AlignedArray<T>* arrays, const LatticeAxes& axes = {0, 1, 2}, std::size_t offset = 0) {
    for (std::size_t c = 0; c < 3; ++c) {
        pointers[c] = arrays[axes[c]].data() + offset;
    }
}

} // namespace

template <class T>
LatticeBody<T>::LatticeBody(const Lattice& lattice, const Material& material, const PlanOptions& options,
                            const LatticeRows& rows)
    : Body<T>(options, lattice.grid_node_count(), kernel_volume(lattice, material),
              lattice_frequencies(lattice, material), material.stiffening, material.crush.any(),
              has_own_volumes(lattice, material)),
      // At `exact` the axes, and so the order of sums, must not hang on the instruction set.
      layout_(rows.active
                  ? active_rows<T>(lattice, material, kernel_table().width,
                                   options.accuracy == Accuracy::exact ? static_cast<int>(kernels::kMaxWidth) : 0)
                  : flat_rows<T>(lattice, material, rows.axes)),
      material_(material), active_(rows.active), means_(material.springs == SpringForm::means),
      face_diagonals_(material.face_diagonal_ratio > 0),
      mean_constants_(mean_constants<T>(spring_constants(material, lattice.cell_size()),
                                        pattern_constants(material, lattice.cell_size()))),
      slab_begin_(divide_into_slabs(layout_, lattice.grid_node_count(), options)),
      springs_(springs_of(lattice, material).total()), cells_(lattice.cell_count()) {}

/// In flat rows; active ones are padded to vectors, and have hardly a node to leave out where bodies are small.
template <class T>
std::size_t LatticeBody<T>::linear_abreast() const {
    return active_ || means_ ? 1 : static_cast<std::size_t>(kernel_table().width);
}

template <class T>
bool LatticeBody<T>::steps_like(const Body<T>& other) const {
    const auto* const that = dynamic_cast<const LatticeBody*>(&other);
    if (!that || this->abreast() == 1 || this->abreast() != that->abreast() ||
        &kernel_table() != &that->kernel_table() || accuracy() != that->accuracy() || volume() != that->volume() ||
        face_diagonals_ != that->face_diagonals_ || slab_begin_ != that->slab_begin_) {
        return false;
    }
    const LatticeArrays<T>&mine = layout_, &theirs = that->layout_;
    const auto same = [](const AlignedArray<T>& a, const AlignedArray<T>& b) {
        return std::equal(a.data(), a.data() + a.size(), b.data(), b.data() + b.size());
    };
    return mine.axes == theirs.axes && mine.row == theirs.row && mine.rows == theirs.rows &&
           mine.begin == theirs.begin && mine.cell_lanes == theirs.cell_lanes &&
           mine.stiffness_begin == theirs.stiffness_begin && mine.cell_size == theirs.cell_size &&
           mine.volume_ratio == theirs.volume_ratio &&
           std::equal(mine.stiffness, mine.stiffness + 7, theirs.stiffness, same) &&
           same(mine.inverse_mass, theirs.inverse_mass);
}

template <class T>
State<T> LatticeBody<T>::state_of_bodies(bool moving, std::size_t bodies) const {
    State<T> state = this->state_of(3, bodies * layout_.size(), moving);
    state.bodies = bodies;
    // Three components each: the upper and the lower sum at every join, and two planes a worker that take turns.
    const std::size_t joins = slabs() - 1;
    const std::size_t count = 6 * joins + 6 * static_cast<std::size_t>(this->workers().threads());
    for (std::size_t b = 0; b < count; ++b) {
        state.buffers.emplace_back(bodies * layout_.plane);
    }
    return state;
}

template <class T>
auto LatticeBody<T>::layer_at(State<T>& state, std::size_t k) const -> Layer {
    Layer layer{};
    layer.row = static_cast<std::ptrdiff_t>(state.bodies * layout_.row);
    layer.cell_lanes = static_cast<std::ptrdiff_t>(
        state.bodies * (state.bodies > 1 ? layout_.row * (layout_.rows - 1) : layout_.cell_lanes));
    layer.volume_ratio = layout_.volume_ratio;
    layer.means = mean_constants_;
    lead(layer, state, k);
    return layer;
}

template <class T>
void LatticeBody<T>::lead(Layer& layer, State<T>& state, std::size_t k) const {
    const std::size_t offset = layout_.begin[k], bodies = state.bodies;
    const auto lanes = [bodies](std::size_t nodes) { return static_cast<std::ptrdiff_t>(bodies * nodes); };
    layer.lanes = lanes(bodies > 1 ? layout_.row * layout_.rows : layout_.lanes[k]);
    layer.plane = lanes(layout_.begin[k + 1] - offset);
    if (!layout_.neighbors.empty()) {
        // One a vector, but none for the void one of each plane.
        layer.neighbors = layout_.neighbors.data() + offset / layout_.width - k;
        layer.upper_lanes = static_cast<std::ptrdiff_t>(k + 1 < layout_.planes ? layout_.lanes[k + 1] : 0);
    }
    // Fields hold the body's components; the kernels' follow the layout's axes.
    for (std::size_t c = 0; c < 3; ++c) {
        auto& displacement = state.displacement[layout_.axes[c]];
        auto& velocity = state.velocity[layout_.axes[c]];
        layer.displacement[c] = displacement.data() + bodies * offset;
        layer.velocity[c] = velocity.size() ? velocity.data() + bodies * offset : nullptr;
    }
    layer.inverse_mass = layout_.inverse_mass.data() + offset;
    for (std::size_t kind = 0; kind < 7; ++kind) {
        // Kernels never look at a kind that is not there: any address will do.
        const std::size_t held = layout_.stiffness[kind].size() > 0 ? kind : 6;
        layer.stiffness[kind] = layout_.stiffness[held].data() + layout_.stiffness_begin[k];
    }
}

template <class T>
void LatticeBody<T>::sweep_slab(State<T>& state, std::size_t slab, std::size_t worker, Finish finish,
                                const StepConstants<T>& step, Meetings& meetings) const {
    const std::size_t first = slab_begin_[slab], end = slab_begin_[slab + 1];
    const bool lowest = slab == 0, highest = slab + 1 == slabs();
    AlignedArray<T>* const joins = state.buffers.data();
    AlignedArray<T>* const own = joins + 6 * (slabs() - 1) + 6 * worker;
    const auto& table = kernel_table();
    const bool side_by_side = state.bodies > 1;
    const auto& layers = side_by_side ? table.bodies_layer
                         : means_     ? (active_ ? table.active_mean_layer : table.mean_layer)
                                      : (active_ ? table.active_layer : table.lattice_layer);
    const auto top = means_ ? table.mean_top()
                            : (side_by_side ? table.bodies_top
                               : active_    ? table.active_top
                                            : table.lattice_top)(face_diagonals_, accuracy());

    Layer layer = layer_at(state, first);
    layer.step = step;
    if (finish == Finish::store) {
        point_to(layer.partial, state.force, layout_.axes, layout_.begin[first]);
    } else if (lowest) {
        point_to(layer.partial, own);
    } else {
        point_to(layer.partial, joins + 6 * (slab - 1));
    }
    for (T* partial : layer.partial) {
        std::fill_n(partial, state.bodies * (layout_.begin[first + 1] - layout_.begin[first]), T(0));
    }
    for (std::size_t k = first; k < end; ++k) {
        if (k + 1 == end && !highest) {
            point_to(layer.above, joins + 6 * slab + 3);
        } else if (finish == Finish::store) {
            point_to(layer.above, state.force, layout_.axes, layout_.begin[k + 1]);
        } else {
            point_to(layer.above, own + 3 * ((k + 1 - first) % 2));
        }
        const bool joined = k == first && !lowest;
        layer.finish = joined ? Finish::store : finish;
        layers(face_diagonals_, volume(), accuracy())(layer);
        if (joined && meetings.second_at(slab - 1)) {
            join(state, slab - 1, finish, step);
        }

        lead(layer, state, k + 1);
        std::copy_n(layer.above, 3, layer.partial);
    }
    if (highest) {
        layer.finish = finish;
        top(layer);
    } else if (meetings.second_at(slab)) {
        join(state, slab, finish, step);
    }
}

template <class T>
void LatticeBody<T>::join(State<T>& state, std::size_t join, Finish finish, const StepConstants<T>& step) const {
    Layer layer = layer_at(state, slab_begin_[join + 1]);
    layer.step = step;
    if (finish == Finish::store) {
        point_to(layer.partial, state.force, layout_.axes, layout_.begin[slab_begin_[join + 1]]);
    } else {
        point_to(layer.partial, state.buffers.data() + 6 * join);
    }
    point_to(layer.above, state.buffers.data() + 6 * join + 3);
    layer.finish = finish;
    (state.bodies > 1 ? kernel_table().bodies_join : kernel_table().lattice_join)()(layer);
}

template <class T>
std::vector<Stage> LatticeBody<T>::sweep(State<T>& state, Finish finish, const StepConstants<T>& step) const {
    const auto meetings = std::make_shared<Meetings>(slabs() - 1);
    return {{slabs(), [this, &state, step, finish, meetings](std::size_t slab, std::size_t worker) {
                 sweep_slab(state, slab, worker, finish, step, *meetings);
             }}};
}

template <class T>
std::vector<Stage> LatticeBody<T>::linear_force_stages(State<T>& state) const {
    this->allocate_like(state.displacement, state.force);
    return sweep(state, Finish::store, {});
}

template <class T>
PotentialEnergy LatticeBody<T>::linear_energy(State<T>& state) const {
    const auto& table = kernel_table();
    const auto energy = (means_    ? table.mean_energy
                         : active_ ? table.active_energy
                                   : table.lattice_energy)(face_diagonals_, volume());
    const auto top = means_ ? nullptr : (active_ ? table.active_top_energy : table.lattice_top_energy)(face_diagonals_);
    std::vector<kernels::LayerEnergy> layers(layout_.planes);
    this->workers().run(layout_.planes, [&](std::size_t k, std::size_t) {
        if (const auto sum = k + 1 == layout_.planes ? top : energy) {
            layers[k] = sum(layer_at(state, k));
        }
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
std::vector<Stage> LatticeBody<T>::linear_step_stages(State<T>& state, const StepFactors& factors) const {
    StepFactors along_axes = factors;
    for (std::size_t c = 0; c < 3; ++c) {
        along_axes.gain[c] = factors.gain[layout_.axes[c]];
        along_axes.acceleration[c] = factors.acceleration[layout_.axes[c]];
    }
    return sweep(state, factors.driven ? Finish::integrate_driven : Finish::integrate,
                 step_constants<T>(along_axes, layout_.cell_size));
}

template <class T>
std::size_t LatticeBody<T>::springs_from(std::size_t index) const {
    if (means_) {
        return layout_.stiffness[6][index] > 0 ? springs_of_cell() : 0;
    }
    std::size_t springs = 0;
    for (std::size_t kind = 0; kind < 7; ++kind) {
        const AlignedArray<T>& stiffness = layout_.stiffness[kind];
        if (stiffness.size() > 0 && stiffness[index] > 0) {
            springs += kind < 3 ? 1u : kind < 6 ? 2u : 4u;
        }
    }
    return springs;
}

template <class T>
void LatticeBody<T>::take_over(const Lattice& cut, std::span<const CutNode> nodes, std::size_t removed) {
    layout_.separate_planes();
    const CellShares shares(cut, material_, layout_.axes);
    for (const CutNode& node : nodes) {
        const std::size_t index = index_of(node.node);
        const std::array<std::size_t, 3> along = {node.place[layout_.axes[0]], node.place[layout_.axes[1]],
                                                  node.place[layout_.axes[2]]};
        const CellShares::Node now = shares.at(along);
        springs_ -= springs_from(index);
        layout_.set_node(index, index, now, shares);
        springs_ += springs_from(index);
        layout_.masses[node.node] = shares.mass(now.cells);
    }
    cells_ -= removed;
}

template <class T>
void LatticeBody<T>::describe_layout(PlanDescription& d) const {
    d.kernel = std::string(active_  ? "active_"
                           : means_ ? ""
                                    : "lattice_") +
               (means_ ? "mean_layer" : "layer") + lattice_variant(face_diagonals_, volume(), accuracy());
    d.springs = springs_;
    d.cells = cells_;
    d.bytes = layout_.bytes();
    d.tiles = slabs();
}

template class LatticeBody<float>;
template class LatticeBody<double>;

} // namespace hybmss
