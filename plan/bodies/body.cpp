#include "plan/bodies/body.hpp"

#include "layouts/interleaved.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

// What for_each_component does with a component of the caller's and one of the body's, or with whole nodes of a caller
// whose components are interleaved.
template <class T>
struct Write {
    T scale;
    void operator()(const T& source, T& target) const { target = scale * source; }
    void interleaved(const T* source, T* x, T* y, T* z, std::size_t nodes) const {
        scale_from_interleaved(source, scale, x, y, z, nodes);
    }
};
template <class T>
struct Read {
    T scale;
    void operator()(T& target, const T& source) const { target = scale * source; }
    void interleaved(T* target, const T* x, const T* y, const T* z, std::size_t nodes) const {
        scale_to_interleaved<false>(x, y, z, scale, target, nodes);
    }
};
template <class T>
struct Add {
    void operator()(T& target, const T& source) const { target += source; }
    void interleaved(T* target, const T* x, const T* y, const T* z, std::size_t nodes) const {
        scale_to_interleaved<true>(x, y, z, T(1), target, nodes);
    }
};

} // namespace

template <class T>
std::size_t State<T>::bytes() const {
    std::size_t sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        sum += displacement[c].bytes() + velocity[c].bytes() + force[c].bytes() + direction[c].bytes() +
               stiffening[c].bytes();
    }
    for (const auto& buffer : buffers) {
        sum += buffer.bytes();
    }
    return sum;
}

template <class T>
void Body<T>::check_size(std::size_t size) const {
    if (size != node_count()) {
        throw std::invalid_argument("vector field of " + std::to_string(size) + " nodes given: the body has " +
                                    std::to_string(node_count()));
    }
}

template <class T>
template <class Visit>
void Body<T>::for_each_run(const Visit& visit) const {
    // A voxel body has a run a row of cells: hand them out in bundles.
    constexpr std::size_t kBundle = 64;
    const std::span<const NodeRun> all = runs();
    const std::size_t bundle = all.size() > 64 * kBundle ? kBundle : 1;
    const auto piece = [&](std::size_t index, std::size_t) {
        for (std::size_t r = index * bundle; r < std::min((index + 1) * bundle, all.size()); ++r) {
            visit(all[r]);
        }
    };
    workers_.run((all.size() + bundle - 1) / bundle, piece);
}

template <class T>
template <class Outer, class Inner, class Move>
void Body<T>::for_each_component(Outer* const (&outer)[3], std::ptrdiff_t outer_stride,
                                 const Component<Inner> (&inner)[3], const Move& move) const {
    if (node_count() == 0) {
        return; // the caller's pointers may be null, and so are ours
    }
    const std::ptrdiff_t inner_stride = inner[0].stride;
    if (const std::span<const std::uint32_t> all = order(); !all.empty()) {
        // Node by node: the caller's components of a node may share a cache line, and no neighbour will be near it.
        constexpr std::size_t kPiece = 4096;
        workers_.run((all.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
            const std::size_t end = std::min((piece + 1) * kPiece, all.size());
            for (std::size_t i = piece * kPiece; i < end; ++i) {
                for (std::size_t c = 0; c < 3; ++c) {
                    move(outer[c][static_cast<std::ptrdiff_t>(all[i]) * outer_stride],
                         inner[c].first[static_cast<std::ptrdiff_t>(i) * inner_stride]);
                }
            }
        });
        return;
    }
    const bool interleaved =
        outer_stride == 3 && inner_stride == 1 && outer[1] == outer[0] + 1 && outer[2] == outer[0] + 2;
    for_each_run([&](const NodeRun& run) {
        if (interleaved) {
            move.interleaved(outer[0] + 3 * run.node, inner[0].first + run.index, inner[1].first + run.index,
                             inner[2].first + run.index, run.length);
            return;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            Outer* theirs = outer[c] + static_cast<std::ptrdiff_t>(run.node) * outer_stride;
            Inner* ours = inner[c].first + static_cast<std::ptrdiff_t>(run.index) * inner_stride;
            if (outer_stride == 1 && inner_stride == 1) {
                for (std::size_t n = 0; n < run.length; ++n) {
                    move(theirs[n], ours[n]);
                }
            } else {
                for (std::size_t n = 0; n < run.length; ++n, theirs += outer_stride, ours += inner_stride) {
                    move(*theirs, *ours);
                }
            }
        }
    });
}

template <class T>
void Body<T>::write(VectorField<const T> in, double factor, NodeField<T>& field) const {
    check_size(in.size);
    const T* const from[3] = {in.x, in.y, in.z};
    const Component<T> to[3] = {component(field, 0), component(field, 1), component(field, 2)};
    const T scale = static_cast<T>(factor);
    for_each_component(from, in.stride, to, Write<T>{scale});
}

template <class T>
void Body<T>::read(const NodeField<T>& field, double factor, VectorField<T> out) const {
    check_size(out.size);
    T* const to[3] = {out.x, out.y, out.z};
    const Component<const T> from[3] = {component(field, 0), component(field, 1), component(field, 2)};
    const T scale = static_cast<T>(factor);
    for_each_component(to, out.stride, from, Read<T>{scale});
}

template <class T>
void Body<T>::add(const NodeField<T>& field, VectorField<T> out) const {
    check_size(out.size);
    T* const to[3] = {out.x, out.y, out.z};
    const Component<const T> from[3] = {component(field, 0), component(field, 1), component(field, 2)};
    for_each_component(to, out.stride, from, Add<T>{});
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
void Body<T>::clear_blocks(std::size_t size, AlignedArray<T> (&blocks)[6]) {
    for (AlignedArray<T>& entry : blocks) {
        if (entry.size() != size) {
            entry = AlignedArray<T>(size);
        } else {
            std::fill_n(entry.data(), size, T(0));
        }
    }
}

template <class T>
double Body<T>::kinetic_energy(const State<T>& state) const {
    const std::span<const double> mass = masses();
    double twice = 0;
    const auto add_node = [&](std::size_t node, std::size_t index) {
        double square = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const Component<const T> v = component(state.velocity, c);
            const auto speed = static_cast<double>(v.first[static_cast<std::ptrdiff_t>(index) * v.stride]);
            square += speed * speed;
        }
        twice += mass[node] * square;
    };
    const std::span<const std::uint32_t> all = order();
    for (std::size_t i = 0; i < all.size(); ++i) {
        add_node(all[i], i);
    }
    for (const NodeRun& run : all.empty() ? runs() : std::span<const NodeRun>()) {
        for (std::size_t n = 0; n < run.length; ++n) {
            add_node(run.node + n, run.index + n);
        }
    }
    return 0.5 * twice * length_unit() * length_unit();
}

template <class T>
void Body<T>::add_kick_stages(NodeField<T>& velocity, NodeField<T>& product, double time_step, double* taken,
                              std::vector<Stage>& stages) const {
    // Pieces of each component, or of the packed array; their sums meet in this order.
    constexpr std::size_t kElements = 4096;
    const std::size_t size = velocity[0].size(), components = velocity[1].size() > 0 ? 3 : 1;
    const std::size_t pieces = (size + kElements - 1) / kElements;
    const auto sums = std::make_shared<std::vector<double>>(taken ? components * pieces : 0);
    stages.push_back({components * pieces, [=, &velocity, &product, kick = kernel_table().network_effects->kick,
                                            inverse_mass = inverse_masses().data(),
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
