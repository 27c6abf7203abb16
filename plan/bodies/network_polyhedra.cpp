#include "plan/bodies/network_polyhedra.hpp"

#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <unordered_map>

namespace hybmss {
namespace {

/// Elements in a piece of work.
constexpr std::size_t kPieceElements = 2048;

/// The state's own arrays.
enum Buffer : std::size_t { kDilation, kDilationChange, kPressure, kPressureChange, kBuffers };

constexpr int nodes_of(std::size_t shape) {
    return static_cast<int>(kPolyhedronShapes[shape]);
}

kernels::Pressure own_pressure(kernels::Volume volume) {
    return volume == kernels::Volume::quadratic ? kernels::Pressure::quadratic : kernels::Pressure::mean_stretch;
}

} // namespace

template <class T>
NetworkPolyhedra<T>::NetworkPolyhedra(const Network& network, const kernels::KernelTable<T>& table,
                                      kernels::Volume volume, std::size_t elements,
                                      const std::function<std::size_t(std::size_t node)>& first)
    : table_(&table), volume_(volume), any_(!network.polyhedra.empty() && volume != kernels::Volume::none) {
    if (!any_ || !network.nodal_volumes) {
        return;
    }
    kappa_ = AlignedArray<T>(elements);
    inverse_volume_ = AlignedArray<T>(elements);
    std::fill_n(inverse_volume_.data(), elements, T(1));
    const NodalVolumes nodal = nodal_volumes(network);
    for (std::size_t n = 0; n < nodal.volumes.size(); ++n) {
        if (nodal.volumes[n] > 0) {
            kappa_[first(n)] = static_cast<T>(nodal.kappas[n]);
            inverse_volume_[first(n)] = static_cast<T>(1 / nodal.volumes[n]);
        }
    }
    std::unordered_map<std::uint64_t, std::uint32_t> known;
    for (Network::Polyhedron polyhedron : network.polyhedra) {
        std::array<double, 18> rest{};
        for (std::size_t c = 0; c < polyhedron.node_count(); ++c) {
            const auto node = static_cast<std::size_t>(polyhedron.nodes[c]);
            std::copy_n(network.rest_positions[node].begin(), 3, rest.begin() + static_cast<std::ptrdiff_t>(3 * c));
            polyhedron.nodes[c] = static_cast<std::int32_t>(first(node));
        }
        for (std::size_t a = 0; a < 6; ++a) {
            for (std::size_t b = 0; b < 6; ++b) {
                std::uint32_t number = 0;
                if (std::max(a, b) < polyhedron.node_count()) {
                    const std::array<std::uint32_t, 2> pair = {static_cast<std::uint32_t>(polyhedron.nodes[a]),
                                                               static_cast<std::uint32_t>(polyhedron.nodes[b])};
                    const auto [found, is_new] = known.try_emplace(std::uint64_t{pair[0]} << 32 | pair[1],
                                                                   static_cast<std::uint32_t>(neighbors_.pairs.size()));
                    if (is_new) {
                        neighbors_.pairs.push_back(pair);
                    }
                    number = found->second;
                }
                neighbors_.pair.push_back(number);
            }
        }
        neighbors_.rest.push_back(rest);
        neighbors_.polyhedra.push_back(polyhedron);
    }
}

template <class T>
std::string NetworkPolyhedra<T>::kernels(kernels::Volume volume) const {
    if (!any_) {
        return "";
    }
    return std::string(" + polyhedra<") + (of_nodes() ? "volumes of nodes, " : "") +
           (volume == kernels::Volume::quadratic ? "quadratic>" : "mean_stretch>");
}

template <class T>
void NetworkPolyhedra<T>::prepare(State<T>& state) const {
    for (std::size_t b = 0; of_nodes() && b < kBuffers; ++b) {
        state.buffers.emplace_back(kappa_.size());
    }
}

template <class T>
kernels::NodalVolumeArrays<T> NetworkPolyhedra<T>::arrays(State<T>& state) const {
    if (!of_nodes()) {
        return {};
    }
    return {state.buffers[kDilation].data(),
            state.buffers[kDilationChange].data(),
            state.buffers[kPressure].data(),
            state.buffers[kPressureChange].data(),
            kappa_.data(),
            inverse_volume_.data()};
}

template <class T>
auto NetworkPolyhedra<T>::forces(State<T>& state, const kernels::HessianArrays<T>& fields) const -> Visit {
    const kernels::Pressure pressure = of_nodes() ? kernels::Pressure::of_nodes : own_pressure(volume_);
    return [table = table_, pressure, nodal = arrays(state), fields](std::size_t shape, const Block* blocks,
                                                                     kernels::Range begin, kernels::Range end) {
        table->polyhedra(nodes_of(shape), pressure)(blocks, nodal, fields, begin, end);
    };
}

template <class T>
auto NetworkPolyhedra<T>::product(State<T>& state, const kernels::HessianArrays<T>& fields) const -> Visit {
    const kernels::Pressure pressure = of_nodes() ? kernels::Pressure::of_nodes : own_pressure(volume_);
    return [table = table_, pressure, nodal = arrays(state), fields](std::size_t shape, const Block* blocks,
                                                                     kernels::Range begin, kernels::Range end) {
        table->polyhedron_product(nodes_of(shape), pressure)(blocks, nodal, fields, begin, end);
    };
}

template <class T>
auto NetworkPolyhedra<T>::dilations(State<T>& state, const kernels::HessianArrays<T>& fields) const -> Visit {
    const bool directed = fields.direction[0] != nullptr;
    return [table = table_, directed, nodal = arrays(state), fields](std::size_t shape, const Block* blocks,
                                                                     kernels::Range begin, kernels::Range end) {
        table->nodal_dilations(nodes_of(shape), directed)(blocks, nodal, fields, begin, end);
    };
}

template <class T>
Stage NetworkPolyhedra<T>::clear_stage(State<T>& state) const {
    const std::size_t size = kappa_.size(), pieces = (size + kPieceElements - 1) / kPieceElements;
    return {2 * pieces, [nodal = arrays(state), size, pieces](std::size_t i, std::size_t) {
                T* const array = i < pieces ? nodal.dilation : nodal.dilation_change;
                const std::size_t begin = i % pieces * kPieceElements;
                std::fill(array + begin, array + std::min(begin + kPieceElements, size), T(0));
            }};
}

template <class T>
Stage NetworkPolyhedra<T>::pressure_stage(State<T>& state, bool directed) const {
    const std::size_t size = kappa_.size();
    return {(size + kPieceElements - 1) / kPieceElements, [pressures = table_->nodal_pressures(volume_, directed),
                                                           nodal = arrays(state), size](std::size_t i, std::size_t) {
                pressures(nodal, static_cast<kernels::Range>(i * kPieceElements),
                          static_cast<kernels::Range>(std::min((i + 1) * kPieceElements, size)));
            }};
}

template <class T>
double NetworkPolyhedra<T>::energy(std::size_t shape, const Block* blocks, const kernels::HessianArrays<T>& fields,
                                   kernels::Range begin, kernels::Range end) const {
    return any_ && !of_nodes() ? table_->polyhedron_energy(nodes_of(shape), volume_)(blocks, fields, begin, end) : 0;
}

template <class T>
double NetworkPolyhedra<T>::nodal_energy(State<T>& state) const {
    double sum = 0;
    for (std::size_t begin = 0; begin < kappa_.size(); begin += kPieceElements) {
        sum +=
            table_->nodal_energy(volume_)(arrays(state), static_cast<kernels::Range>(begin),
                                          static_cast<kernels::Range>(std::min(begin + kPieceElements, kappa_.size())));
    }
    return sum;
}

template <class T>
auto NetworkPolyhedra<T>::diagonal(const kernels::HessianArrays<T>& fields,
                                   const kernels::DiagonalBlocks<T>& sums) const -> Visit {
    if (of_nodes()) {
        return [](std::size_t, const Block*, kernels::Range, kernels::Range) {};
    }
    return [table = table_, volume = volume_, fields, sums](std::size_t shape, const Block* blocks,
                                                            kernels::Range begin, kernels::Range end) {
        table->polyhedron_diagonal(nodes_of(shape), volume)(blocks, fields, sums, begin, end);
    };
}

// Of each node's volume a: kappa phi''(J_a) / V_a g g^T, g = dV_a / dx_i = sum over the polyhedra that have a and i of
// dV' / dx_i / nodes.
template <class T>
void NetworkPolyhedra<T>::add_nodal_diagonal(State<T>& state, const kernels::DiagonalBlocks<T>& sums) const {
    if (!of_nodes()) {
        return;
    }
    const bool packed = state.displacement[1].size() == 0;
    const Component<T> u[3] = {component(state.displacement, 0), component(state.displacement, 1),
                               component(state.displacement, 2)};
    std::vector<std::array<double, 3>> gradients(neighbors_.pairs.size());
    std::array<std::array<double, 3>, 6> corners{};
    for (std::size_t p = 0; p < neighbors_.polyhedra.size(); ++p) {
        const Network::Polyhedron& polyhedron = neighbors_.polyhedra[p];
        const std::size_t nodes = polyhedron.node_count();
        for (std::size_t c = 0; c < nodes; ++c) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                // Nodes are first elements: of a packed node, or of a component.
                corners[c][axis] =
                    neighbors_.rest[p][3 * c + axis] + static_cast<double>(u[axis].first[polyhedron.nodes[c]]);
            }
        }
        const std::array<std::array<double, 3>, 6> by = volume_gradient(polyhedron.shape, corners);
        for (std::size_t a = 0; a < nodes; ++a) {
            for (std::size_t i = 0; i < nodes; ++i) {
                std::array<double, 3>& sum = gradients[neighbors_.pair[36 * p + 6 * a + i]];
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    sum[axis] += by[i][axis] / static_cast<double>(nodes);
                }
            }
        }
    }
    // phi'' by a direction that changes every J by 1.
    kernels::NodalVolumeArrays<T> nodal = arrays(state);
    std::fill_n(nodal.dilation_change, kappa_.size(), T(1));
    table_->nodal_pressures(volume_, true)(nodal, 0, static_cast<kernels::Range>(kappa_.size()));
    for (std::size_t k = 0; k < neighbors_.pairs.size(); ++k) {
        const auto [volume, moved] = neighbors_.pairs[k];
        const double scale = static_cast<double>(nodal.pressure_change[volume]);
        const std::array<double, 3>& g = gradients[k];
        const double block[6] = {g[0] * g[0], g[1] * g[1], g[2] * g[2], g[0] * g[1], g[0] * g[2], g[1] * g[2]};
        for (std::size_t e = 0; e < 6; ++e) {
            sums.entry[e][packed ? moved / 4 : moved] += static_cast<T>(scale * block[e]);
        }
    }
}

template class NetworkPolyhedra<float>;
template class NetworkPolyhedra<double>;

} // namespace hybmss
