#include "layouts/packed_xyzw.hpp"

#include "layouts/conflict_free_blocks.hpp"
#include "layouts/rest_shape.hpp"
#include "layouts/row_order.hpp"
#include "layouts/tile_coloring.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

constexpr std::size_t kItems = kBlockItems;

/// Nodes a tile owns: enough tiles for many threads, but no more of them than keep the blocks full.
std::size_t nodes_per_tile(std::size_t nodes) {
    return std::clamp<std::size_t>(nodes / 64, 128, 512);
}

/// The items (springs, cells) sorted by their lowest node, then by the next; and where each tile's begin.
struct TiledItems {
    std::vector<std::uint32_t> items;
    std::vector<std::size_t> begin;
};

TiledItems tiled_items(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t tile_nodes,
                       std::size_t tiles) {
    const std::size_t count = nodes.size() / nodes_per_item;
    std::vector<std::uint64_t> key(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto own = nodes.subspan(i * nodes_per_item, nodes_per_item);
        const auto [low, high] = std::minmax_element(own.begin(), own.end());
        key[i] = static_cast<std::uint64_t>(*low) << 32 | static_cast<std::uint64_t>(*high);
    }
    TiledItems tiled{std::vector<std::uint32_t>(count), std::vector<std::size_t>(tiles + 1, 0)};
    std::iota(tiled.items.begin(), tiled.items.end(), 0u);
    std::stable_sort(tiled.items.begin(), tiled.items.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return key[a] < key[b]; });
    for (std::uint64_t k : key) {
        ++tiled.begin[(k >> 32) / tile_nodes + 1];
    }
    std::partial_sum(tiled.begin.begin(), tiled.begin.end(), tiled.begin.begin());
    return tiled;
}

/// Whether the caller's numbering is one in space already: the springs of a lattice numbered row by row span as many
/// places as two planes have nodes, those of a random numbering a good part of all.
bool well_ordered(const Network& network) {
    double span = 0;
    for (const Network::Spring& s : network.springs) {
        span += std::abs(static_cast<double>(s.a) - static_cast<double>(s.b));
    }
    const auto nodes = static_cast<double>(network.masses.size());
    return span <= 0.05 * nodes * static_cast<double>(network.springs.size());
}

/// How far neighbours are apart: nine of ten springs are at least as long. 1 m where there are none.
double node_spacing(const Network& network) {
    std::vector<double> lengths;
    lengths.reserve(network.springs.size());
    for (const Network::Spring& s : network.springs) {
        lengths.push_back(std::sqrt(rest_length2(s)));
    }
    if (lengths.empty()) {
        return 1;
    }
    const auto tenth = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 10);
    std::nth_element(lengths.begin(), tenth, lengths.end());
    return *tenth;
}

template <class T>
void fill(SpringBlock<T>& block, std::int32_t dummy) {
    std::fill_n(block.a, kItems, dummy);
    std::fill_n(block.b, kItems, dummy);
    std::fill_n(block.rest[0], kItems, T(1));
    std::fill_n(block.inverse_length2, kItems, T(1));
}

template <class T>
void fill(CellBlock<T>& block, std::int32_t dummy) {
    for (auto& node : block.node) {
        std::fill_n(node, kItems, dummy);
    }
    for (std::size_t e = 0; e < 9; e += 4) {
        std::fill_n(block.rest_edge[e], kItems, T(1));
    }
    std::fill_n(block.inverse_volume, kItems, T(1));
}

template <class T>
void set(SpringBlock<T>& block, std::size_t lane, const Network&, const Network::Spring& spring,
         const std::int32_t* nodes) {
    block.a[lane] = 4 * nodes[0];
    block.b[lane] = 4 * nodes[1];
    for (std::size_t axis = 0; axis < 3; ++axis) {
        block.rest[axis][lane] = static_cast<T>(spring.rest_vector[axis]);
    }
    block.stiffness[lane] = static_cast<T>(spring.stiffness);
    block.inverse_length2[lane] = static_cast<T>(1 / rest_length2(spring));
}

template <class T>
void set(CellBlock<T>& block, std::size_t lane, const Network& network, const Network::Cell& cell,
         const std::int32_t* nodes) {
    const RestShape shape = rest_shape(network, cell);
    for (std::size_t corner = 0; corner < 8; ++corner) {
        block.node[corner][lane] = 4 * nodes[corner];
    }
    for (std::size_t e = 0; e < 9; ++e) {
        block.rest_edge[e][lane] = static_cast<T>(shape.edges[e]);
    }
    block.kappa[lane] = static_cast<T>(cell.kappa);
    block.inverse_volume[lane] = static_cast<T>(1 / shape.volume);
}

/// The blocks of all tiles, colour after colour; begin[t] is where the t-th tile of that order starts.
template <class Block, class Item>
AlignedArray<Block> make_blocks(const Network& network, const std::vector<Item>& items,
                                std::span<const std::int32_t> nodes, std::size_t nodes_per_item,
                                const TiledItems& tiled, const Coloring& coloring, std::size_t node_count,
                                std::vector<std::size_t>& begin) {
    ConflictFreeBlocks packing(node_count, nodes_per_item, kItems);
    std::vector<std::uint32_t> slots;
    begin = {0};
    for (std::uint32_t tile : coloring.order) {
        packing.append(std::span(tiled.items).subspan(tiled.begin[tile], tiled.begin[tile + 1] - tiled.begin[tile]),
                       nodes, slots);
        begin.push_back(slots.size() / kItems);
    }
    AlignedArray<Block> blocks(slots.size() / kItems);
    for (std::size_t t = 0; t < coloring.order.size(); ++t) {
        const auto dummy = static_cast<std::int32_t>(4 * (node_count + t));
        for (std::size_t b = begin[t]; b < begin[t + 1]; ++b) {
            fill(blocks[b], dummy);
            for (std::size_t lane = 0; lane < kItems; ++lane) {
                if (const std::uint32_t item = slots[b * kItems + lane]; item != kNoItem) {
                    set(blocks[b], lane, network, items[item], nodes.data() + item * nodes_per_item);
                }
            }
        }
    }
    return blocks;
}

} // namespace

template <class T>
PackedXyzw<T>::PackedXyzw(const Network& network)
    : masses(network.masses), node_count(network.masses.size()), spring_count(network.springs.size()),
      cell_count(network.cells.size()) {
    if (!well_ordered(network)) {
        order = row_order(network.rest_positions, node_spacing(network));
        place.resize(node_count);
        for (std::size_t i = 0; i < node_count; ++i) {
            place[order[i]] = static_cast<std::uint32_t>(i);
        }
    }
    const auto placed = [&](std::int32_t node) {
        return place.empty() ? node : static_cast<std::int32_t>(place[static_cast<std::size_t>(node)]);
    };
    std::vector<std::int32_t> spring_nodes, cell_nodes;
    spring_nodes.reserve(2 * spring_count);
    for (const Network::Spring& s : network.springs) {
        spring_nodes.push_back(placed(s.a));
        spring_nodes.push_back(placed(s.b));
    }
    cell_nodes.reserve(8 * cell_count);
    for (const Network::Cell& c : network.cells) {
        for (std::int32_t n : c.nodes) {
            cell_nodes.push_back(placed(n));
        }
    }

    const std::size_t tile_nodes = nodes_per_tile(node_count);
    const std::size_t tile_count = (node_count + tile_nodes - 1) / tile_nodes;
    const TiledItems tiled_springs = tiled_items(spring_nodes, 2, tile_nodes, tile_count);
    const TiledItems tiled_cells = tiled_items(cell_nodes, 8, tile_nodes, tile_count);
    std::vector<std::vector<std::int32_t>> touched(tile_count);
    const auto touch = [&](const TiledItems& tiled, const std::vector<std::int32_t>& nodes, std::size_t per_item) {
        for (std::size_t t = 0; t < tile_count; ++t) {
            for (std::size_t i = tiled.begin[t]; i < tiled.begin[t + 1]; ++i) {
                const auto first = nodes.begin() + static_cast<std::ptrdiff_t>(tiled.items[i] * per_item);
                touched[t].insert(touched[t].end(), first, first + static_cast<std::ptrdiff_t>(per_item));
            }
            std::sort(touched[t].begin(), touched[t].end());
            touched[t].erase(std::unique(touched[t].begin(), touched[t].end()), touched[t].end());
        }
    };
    touch(tiled_springs, spring_nodes, 2);
    touch(tiled_cells, cell_nodes, 8);
    const Coloring coloring = color_tiles(touched, node_count);
    color_begin = coloring.begin;

    std::vector<std::size_t> spring_begin, cell_begin;
    springs = make_blocks<SpringBlock<T>>(network, network.springs, spring_nodes, 2, tiled_springs, coloring,
                                          node_count, spring_begin);
    cells =
        make_blocks<CellBlock<T>>(network, network.cells, cell_nodes, 8, tiled_cells, coloring, node_count, cell_begin);
    for (std::size_t t = 0; t < tile_count; ++t) {
        tiles.push_back({spring_begin[t], spring_begin[t + 1], cell_begin[t], cell_begin[t + 1]});
    }

    inverse_mass = AlignedArray<T>(4 * padded(node_count + tile_count));
    for (std::size_t i = 0; i < node_count; ++i) {
        std::fill_n(inverse_mass.data() + 4 * i, 3, static_cast<T>(1 / masses[order.empty() ? i : order[i]]));
    }
}

template <class T>
std::size_t PackedXyzw<T>::bytes() const {
    return springs.bytes() + cells.bytes() + inverse_mass.bytes() + masses.size() * sizeof(double) +
           (order.size() + place.size()) * sizeof(std::uint32_t) + tiles.size() * sizeof(NetworkTile);
}

template struct PackedXyzw<float>;
template struct PackedXyzw<double>;

} // namespace hybmss
