#include "plan/bodies/body.hpp"

#include "plan/bodies/field_checks.hpp"
#include "plan/bodies/plan_description.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace hybmss {

using kernels::SpringLaw;

namespace {

// What a pass between a caller's memory and the body's does with neighbouring nodes: component by component, where both
// lie side by side; with whole nodes of a caller whose components are interleaved; or with one component of one node.
// No memory overlaps.
template <class T>
struct Write {
    T scale;
    void (*from_interleaved)(const T*, T, T*, T*, T*, kernels::Range);
    void operator()(const T& source, T& target) const { target = scale * source; }
    void side_by_side(const T* __restrict source, T* __restrict target, std::size_t nodes) const {
        for (std::size_t n = 0; n < nodes; ++n) {
            target[n] = scale * source[n];
        }
    }
    void interleaved(const T* source, T* x, T* y, T* z, std::size_t nodes) const {
        from_interleaved(source, scale, x, y, z, static_cast<kernels::Range>(nodes));
    }
};
template <class T>
struct Read {
    T scale;
    void (*to_interleaved)(const T*, const T*, const T*, T, T*, kernels::Range);
    void operator()(T& target, const T& source) const { target = scale * source; }
    void side_by_side(T* __restrict target, const T* __restrict source, std::size_t nodes) const {
        for (std::size_t n = 0; n < nodes; ++n) {
            target[n] = scale * source[n];
        }
    }
    void interleaved(T* target, const T* x, const T* y, const T* z, std::size_t nodes) const {
        to_interleaved(x, y, z, scale, target, static_cast<kernels::Range>(nodes));
    }
};
template <class T>
struct Add {
    void (*to_interleaved)(const T*, const T*, const T*, T, T*, kernels::Range);
    void operator()(T& target, const T& source) const { target += source; }
    void side_by_side(T* __restrict target, const T* __restrict source, std::size_t nodes) const {
        for (std::size_t n = 0; n < nodes; ++n) {
            target[n] += source[n];
        }
    }
    void interleaved(T* target, const T* x, const T* y, const T* z, std::size_t nodes) const {
        to_interleaved(x, y, z, T(1), target, static_cast<kernels::Range>(nodes));
    }
};

/// visit(array, first entry, one behind the last) in pieces of `arrays` arrays of `size` entries.
template <class Visit>
Stage stage_over_arrays(std::size_t arrays, std::size_t size, const Visit& visit) {
    constexpr std::size_t kPiece = 8192;
    const std::size_t pieces = (size + kPiece - 1) / kPiece;
    return {arrays * pieces, [=](std::size_t i, std::size_t) {
                const std::size_t begin = i % pieces * kPiece;
                visit(i / pieces, begin, std::min(begin + kPiece, size));
            }};
}

} // namespace

template <class T>
std::size_t State<T>::bytes() const {
    std::size_t sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        sum +=
            displacement[c].bytes() + velocity[c].bytes() + force[c].bytes() + direction[c].bytes() + beside[c].bytes();
    }
    for (const auto& buffer : buffers) {
        sum += buffer.bytes();
    }
    return sum;
}

template <class T>
Body<T>::Body(const PlanOptions& options, std::size_t nodes, kernels::Volume volume, const FrequencyBounds& frequencies,
              const SpringStiffening& stiffening, bool crush, bool own_volumes)
    : workers_(useful_threads(options, nodes), options.task_runner,
               options.accuracy == Accuracy::exact ? Underflow::gradual : Underflow::to_zero),
      name_(options.layout), table_(&kernels::kernel_table<T>(resolve(options.instruction_set), options.accuracy)),
      volume_(volume), accuracy_(options.accuracy), frequencies_(frequencies) {
    if (stiffening.any()) {
        beside_.push_back({SpringLaw::stiffening,
                           SpringLaw::stiffening_tangent,
                           {static_cast<T>(stiffening.quadratic), static_cast<T>(stiffening.cubic)}});
    }
    if (crush) {
        beside_.push_back({SpringLaw::crush, SpringLaw::crush_tangent, {}});
    }
    if (own_volumes) {
        beside_.push_back({SpringLaw::own_volume, SpringLaw::own_volume_tangent, {}});
    }
}

template <class T>
State<T> Body<T>::state_of(std::size_t arrays, std::size_t size, bool moving) {
    State<T> state;
    for (std::size_t a = 0; a < arrays; ++a) {
        state.displacement[a] = AlignedArray<T>(size);
        if (moving) {
            state.velocity[a] = AlignedArray<T>(size);
        }
    }
    return state;
}

template <class T>
State<T> Body<T>::make_state(bool moving) const {
    State<T> state = linear_state(moving);
    if (!beside_.empty()) {
        allocate_like(state.displacement, state.beside);
    }
    return state;
}

template <class T>
std::vector<Stage> Body<T>::force_stages(State<T>& state) const {
    std::vector<Stage> stages = linear_force_stages(state);
    for (const Beside& pass : beside_) {
        append(spring_stages(state, {pass.force, pass.stiffening}, nullptr, state.beside), stages);
        stages.push_back(move_into_stage(state.force, state.beside, array_count<T>(state.beside), T(-1)));
    }
    return stages;
}

template <class T>
PotentialEnergy Body<T>::energy(State<T>& state) const {
    PotentialEnergy energy = linear_energy(state);
    for (const Beside& pass : beside_) {
        if (pass.force == SpringLaw::stiffening) {
            energy.springs += stiffening_energy(state, pass.stiffening);
        } else {
            energy.volume += cell_energy(state, pass.force);
        }
    }
    return energy;
}

template <class T>
void Body<T>::hessian_product(State<T>& state, const NodeField<T>& direction, NodeField<T>& product,
                              Curvature curvature) const {
    linear_product(state, SpringPass<T>{SpringLaw::elastic}.with(curvature), direction, product);
    for (const Beside& beside : beside_) {
        const SpringPass<T> pass{beside.tangent, beside.stiffening};
        std::vector<Stage> stages = spring_stages(state, pass.with(curvature), &direction, state.beside);
        stages.push_back(move_into_stage(product, state.beside, array_count<T>(product), T(1)));
        workers_.run(stages, 1);
    }
}

template <class T>
void Body<T>::linear_product(State<T>& state, const SpringPass<T>& pass, const NodeField<T>& direction,
                             NodeField<T>& product) const {
    clear_like(state.displacement, product);
    workers_.run(spring_stages(state, pass, &direction, product), 1);
}

template <class T>
void Body<T>::hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6], Curvature curvature) const {
    spring_diagonal(state, SpringPass<T>{SpringLaw::elastic}.with(curvature), blocks);
    for (const Beside& pass : beside_) {
        AlignedArray<T> more[6];
        spring_diagonal(state, {pass.tangent, pass.stiffening}, more);
        const Stage stage = move_into_stage(blocks, more, 6, T(1));
        workers_.run({&stage, 1}, 1);
    }
}

template <class T>
double Body<T>::cell_energy(State<T>&, SpringLaw) const {
    return 0;
}

template <class T>
std::vector<Stage> Body<T>::step_stages(State<T>& state, const StepFactors& factors) const {
    std::vector<Stage> stages;
    for (const Beside& pass : beside_) {
        append(spring_stages(state, {pass.force, pass.stiffening}, nullptr, state.beside), stages);
        add_kick_stages(state.velocity, state.beside, factors.kick, nullptr, stages);
    }
    append(linear_step_stages(state, factors), stages);
    return stages;
}

template <class T>
PlanDescription Body<T>::describe() const {
    PlanDescription d;
    describe_layout(d);
    for (const Beside& pass : beside_) {
        d.kernel += pass.force == SpringLaw::crush        ? " + crush resistance"
                    : pass.force == SpringLaw::own_volume ? " + volumes of tissues"
                                                          : " + stiffening springs";
    }
    d.instruction_set = table_->instruction_set;
    d.layout = name_;
    d.precision = precision_name<T>();
    d.threads = workers_.threads();
    d.nodes = node_count();
    return d;
}

template <class T>
kernels::DiagonalBlocks<T> Body<T>::cleared_blocks(std::size_t size, const SpringPass<T>& pass,
                                                   AlignedArray<T> (&blocks)[6]) {
    kernels::DiagonalBlocks<T> sums{};
    for (std::size_t e = 0; e < 6; ++e) {
        clear(size, blocks[e]);
        sums.entry[e] = blocks[e].data();
    }
    sums.stiffening = pass.stiffening;
    return sums;
}

template <class T>
void Body<T>::check(const VectorField<const T>& in) const {
    check_field(in, node_count(), "nodes", "the body");
}

template <class T>
void Body<T>::check(const VectorField<T>& out) const {
    check_field(out, node_count(), "nodes", "the body");
}

template <class T>
void Body<T>::check(const VectorField<T>& out, std::initializer_list<VectorField<const T>> in) const {
    check(out);
    for (const VectorField<const T>& read : in) {
        check(read);
        check_apart(out, read);
    }
}

template <class T>
template <class Outer, class Inner, class Move>
void Body<T>::move_nodes(std::size_t begin, std::size_t end, const VectorField<Outer>& outer,
                         const Component<Inner> (&inner)[3], const Move& move) const {
    Outer* const theirs[3] = {outer.x, outer.y, outer.z};
    const std::ptrdiff_t stride = outer.stride, inner_stride = inner[0].stride;
    if (const std::span<const std::uint32_t> all = order(); !all.empty()) {
        // Node by node: the caller's components of a node may share a cache line, and no neighbour will be near it.
        for (std::size_t i = begin; i < end; ++i) {
            for (std::size_t c = 0; c < 3; ++c) {
                move(theirs[c][static_cast<std::ptrdiff_t>(all[i]) * stride],
                     inner[c].first[static_cast<std::ptrdiff_t>(i) * inner_stride]);
            }
        }
        return;
    }
    const bool interleaved = stride == 3 && theirs[1] == theirs[0] + 1 && theirs[2] == theirs[0] + 2;
    const std::span<const NodeRun> all = runs();
    auto run = std::upper_bound(all.begin(), all.end(), begin,
                                [](std::size_t node, const NodeRun& r) { return node < r.node; });
    for (--run; begin < end; ++run) {
        const std::size_t index = run->index + (begin - run->node) * run->stride;
        const std::ptrdiff_t step = inner_stride * static_cast<std::ptrdiff_t>(run->stride);
        const std::size_t length = std::min(run->node + run->length, end) - begin;
        if (interleaved && step == 1) {
            move.interleaved(theirs[0] + 3 * begin, inner[0].first + index, inner[1].first + index,
                             inner[2].first + index, length);
        } else if (stride == 1 && step == 1) {
            for (std::size_t c = 0; c < 3; ++c) {
                move.side_by_side(theirs[c] + begin, inner[c].first + index, length);
            }
        } else {
            // Whole nodes: the caller's components of one may share a cache line.
            const auto first = static_cast<std::ptrdiff_t>(begin), place = static_cast<std::ptrdiff_t>(index);
            Outer *const x = theirs[0] + first * stride, *const y = theirs[1] + first * stride,
                         *const z = theirs[2] + first * stride;
            Inner *const u = inner[0].first + place * inner_stride, *const v = inner[1].first + place * inner_stride,
                         *const w = inner[2].first + place * inner_stride;
            for (std::ptrdiff_t n = 0; n < static_cast<std::ptrdiff_t>(length); ++n) {
                move(x[n * stride], u[n * step]);
                move(y[n * stride], v[n * step]);
                move(z[n * stride], w[n * step]);
            }
        }
        begin += length;
    }
}

template <class T>
template <class Outer, class Field, class Move>
Stage Body<T>::move_stage(const VectorField<Outer>& outer, Field& field, const Move& move) const {
    // Large enough that handing them out costs nothing; with one thread they follow each other.
    constexpr std::size_t kPiece = 4096;
    return {(node_count() + kPiece - 1) / kPiece, [this, &outer, &field, move](std::size_t piece, std::size_t) {
                const auto x = component(field, 0), y = component(field, 1), z = component(field, 2);
                const std::remove_const_t<decltype(x)> inner[3] = {x, y, z};
                move_nodes(piece * kPiece, std::min((piece + 1) * kPiece, node_count()), outer, inner, move);
            }};
}

template <class T>
Stage Body<T>::write_stage(const VectorField<const T>& in, double factor, NodeField<T>& field) const {
    return move_stage(in, field, Write<T>{static_cast<T>(factor), table_->from_interleaved()});
}

template <class T>
Stage Body<T>::add_stage(const NodeField<T>& field, const VectorField<T>& out) const {
    return move_stage(out, field, Add<T>{table_->to_interleaved(true)});
}

template <class T>
void Body<T>::write(VectorField<const T> in, double factor, NodeField<T>& field) const {
    check(in);
    const Stage stage = write_stage(in, factor, field);
    workers_.run({&stage, 1}, 1);
}

template <class T>
void Body<T>::read(const NodeField<T>& field, double factor, VectorField<T> out) const {
    check(out);
    const Stage stage = move_stage(out, field, Read<T>{static_cast<T>(factor), table_->to_interleaved(false)});
    workers_.run({&stage, 1}, 1);
}

template <class T>
void Body<T>::read_blocks(const AlignedArray<T> (&blocks)[6], double factor, std::span<T> out) const {
    if (out.size() != 6 * node_count()) {
        throw std::invalid_argument("diagonal blocks of " + std::to_string(out.size()) + " values given: the body's " +
                                    std::to_string(node_count()) + " nodes have six each");
    }
    const T scale = static_cast<T>(factor);
    for (std::size_t node = 0; node < node_count(); ++node) {
        const std::size_t index = index_of(node);
        for (std::size_t entry = 0; entry < 6; ++entry) {
            out[6 * node + entry] = scale * blocks[entry][index];
        }
    }
}

template <class T>
void Body<T>::allocate_like(const NodeField<T>& like, NodeField<T>& field) {
    for (std::size_t c = 0; c < 3; ++c) {
        if (field[c].size() != like[c].size()) {
            field[c] = AlignedArray<T>(like[c].size());
        }
    }
}

template <class T>
Stage Body<T>::clear_stage(NodeField<T>& field) {
    return stage_over_arrays(array_count(field), field[0].size(),
                             [&field](std::size_t a, std::size_t begin, std::size_t end) {
                                 std::fill(field[a].data() + begin, field[a].data() + end, T(0));
                             });
}

template <class T>
Stage Body<T>::move_into_stage(AlignedArray<T>* sum, AlignedArray<T>* more, std::size_t arrays, T sign) const {
    const auto move = kernel_table().move_into();
    return stage_over_arrays(arrays, more[0].size(), [=](std::size_t a, std::size_t begin, std::size_t end) {
        move(sum[a].data(), more[a].data(), sign, static_cast<std::ptrdiff_t>(begin), static_cast<std::ptrdiff_t>(end));
    });
}

template <class T>
void Body<T>::clear(std::size_t size, AlignedArray<T>& array) {
    if (array.size() != size) {
        array = AlignedArray<T>(size);
    } else {
        std::fill_n(array.data(), size, T(0));
    }
}

template <class T>
void Body<T>::clear_like(const NodeField<T>& like, NodeField<T>& field) {
    for (std::size_t c = 0; c < 3; ++c) {
        clear(like[c].size(), field[c]);
    }
}

template <class T>
double Body<T>::kinetic_energy(const State<T>& state) const {
    const std::span<const double> mass = masses();
    double sum = 0;
    const auto add_node = [&](std::size_t node, std::size_t index) {
        double square = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const Component<const T> v = component(state.velocity, c);
            const auto speed = static_cast<double>(v.first[static_cast<std::ptrdiff_t>(index) * v.stride]);
            square += speed * speed;
        }
        sum += mass[node] * square;
    };
    const std::span<const std::uint32_t> all = order();
    for (std::size_t i = 0; i < all.size(); ++i) {
        add_node(all[i], i);
    }
    for (const NodeRun& run : all.empty() ? runs() : std::span<const NodeRun>()) {
        for (std::size_t n = 0; n < run.length; ++n) {
            add_node(run.node + n, run.index + n * run.stride);
        }
    }
    return 0.5 * sum * length_unit() * length_unit();
}

template <class T>
bool Body<T>::finite(const NodeField<T>& field) const {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    std::atomic<bool> all = true;
    const Stage stage =
        stage_over_arrays(array_count(field), field[0].size(), [&](std::size_t a, std::size_t begin, std::size_t end) {
            const T* const values = field[a].data();
            Bits bad = 0; // x - x is 0 with no bit set, or NaN: compilers make whole vectors of this
            for (std::size_t n = begin; n < end; ++n) {
                const T difference = values[n] - values[n];
                Bits bits;
                std::memcpy(&bits, &difference, sizeof bits);
                bad |= bits;
            }
            if (bad != 0) {
                all.store(false, std::memory_order_relaxed);
            }
        });
    workers_.run({&stage, 1}, 1);
    return all;
}

template <class T>
void Body<T>::add_kick_stages(NodeField<T>& velocity, NodeField<T>& product, double time_step, double* taken,
                              std::vector<Stage>& stages) const {
    // Pieces of each component, or of the packed array; their sums meet in this order.
    constexpr std::size_t kElements = 4096;
    const std::size_t size = velocity[0].size(), components = array_count<T>(velocity);
    const std::size_t pieces = (size + kElements - 1) / kElements;
    const auto sums = std::make_shared<std::vector<double>>(taken ? components * pieces : 0);
    stages.push_back({components * pieces,
                      [=, &velocity, &product, kick = kernel_table().kick(), inverse_mass = inverse_masses().data(),
                       factor = static_cast<T>(time_step)](std::size_t i, std::size_t) {
                          const std::size_t c = i / pieces, begin = i % pieces * kElements;
                          const double out = kick(velocity[c].data(), product[c].data(), inverse_mass, factor,
                                                  static_cast<std::ptrdiff_t>(begin),
                                                  static_cast<std::ptrdiff_t>(std::min(begin + kElements, size)));
                          if (taken) {
                              (*sums)[i] = out;
                          }
                      }});
    if (taken) {
        stages.push_back({1, [taken, sums, unit = length_unit()](std::size_t, std::size_t) {
                              double sum = 0;
                              for (double out : *sums) {
                                  sum += out;
                              }
                              *taken += unit * sum;
                          }});
    }
}

template <class T>
void Body<T>::take_over(const Lattice&, std::span<const CutNode>, std::size_t) {
    throw std::logic_error("this layout cannot be cut");
}

template struct State<float>;
template struct State<double>;
template class Body<float>;
template class Body<double>;

} // namespace hybmss
