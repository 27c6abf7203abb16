#include "layouts/network/colored_soa.hpp"

#include "layouts/coloring.hpp"
#include "layouts/network/item_groups.hpp"
#include "layouts/network/network_geometry.hpp"
#include "layouts/network/packed_sources.hpp"

#include <algorithm>
#include <numeric>
#include <span>

namespace hybmss {
namespace {

/// Of what is gathered, in a piece of work.
constexpr std::size_t kPieceBlocks = 128;

/// Where each colour starts once it is padded to whole vectors.
std::vector<std::size_t> padded_begins(const Coloring& coloring) {
    std::vector<std::size_t> begins = {0};
    for (std::size_t c = 0; c < coloring.colors(); ++c) {
        begins.push_back(begins.back() + padded(coloring.begin[c + 1] - coloring.begin[c]));
    }
    return begins;
}

/// Calls place(slot, item) for every item.
template <class Place>
void for_each_slot(const Coloring& coloring, const std::vector<std::size_t>& begins, const Place& place) {
    for (std::size_t c = 0; c < coloring.colors(); ++c) {
        for (std::size_t i = coloring.begin[c]; i < coloring.begin[c + 1]; ++i) {
            place(begins[c] + i - coloring.begin[c], coloring.order[i]);
        }
    }
}

/// Items (springs, cells) in blocks, and those in colours.
class Blocks {
public:
    /// \param nodes `per_item` an item, all below `node_count`
    Blocks(std::span<const std::int32_t> nodes, std::size_t per_item, std::size_t node_count)
        : per_item_(per_item), node_count_(node_count) {
        const std::size_t tile_nodes = std::clamp(padded(node_count / kTiles), kLeastTile, kMostTile);
        const TiledItems all = tile_items(nodes, per_item, tile_nodes, (node_count + tile_nodes - 1) / tile_nodes);
        add_runs(all.runs);
        std::vector<std::uint32_t> singles;
        for (const auto& tile : all.singles) {
            singles.insert(singles.end(), tile.begin(), tile.end());
        }
        add_singles(singles, nodes);
    }

    std::vector<std::uint32_t> item;   ///< kNoItem in gaps and padding
    std::vector<std::int32_t> node[8]; ///< of each end
    std::vector<std::uint8_t> in_row;  ///< one a block
    std::vector<std::size_t> color_begin = {0}, piece_begin = {0};

    /// Takes over the nodes of an end.
    AlignedArray<std::int32_t> nodes_of(std::size_t end) const { return copied(node[end]); }
    AlignedArray<std::uint8_t> rows() const { return copied(in_row); }

private:
    /// Of the body's nodes; a tile's runs are done one after the other, while its nodes are in the first caches.
    static constexpr std::size_t kTiles = 32, kLeastTile = 128, kMostTile = 4096;

    template <class Value>
    static AlignedArray<Value> copied(const std::vector<Value>& values) {
        AlignedArray<Value> array(values.size());
        std::copy(values.begin(), values.end(), array.data());
        return array;
    }

    void add_block(bool row) {
        for (std::size_t lane = 0; lane < kPadding; ++lane) {
            item.push_back(kNoItem);
            for (std::size_t c = 0; c < per_item_; ++c) {
                node[c].push_back(static_cast<std::int32_t>(node_count_ + lane));
            }
        }
        in_row.push_back(row);
    }

    /// A piece a tile. What stands in a run's gaps is written too.
    void add_runs(const std::vector<std::vector<ItemRun>>& tiles) {
        std::vector<std::vector<std::int32_t>> touched(tiles.size());
        for (std::size_t t = 0; t < tiles.size(); ++t) {
            for (const ItemRun& run : tiles[t]) {
                for (std::size_t c = 0; c < per_item_; ++c) {
                    for (std::int32_t lane = 0; lane < static_cast<std::int32_t>(kPadding); ++lane) {
                        touched[t].push_back(run.node[c] + lane);
                    }
                }
            }
        }
        const Coloring coloring = color_tiles(touched, node_count_ + kPadding);
        for (std::size_t color = 0; color < coloring.colors(); ++color) {
            for (std::size_t i = coloring.begin[color]; i < coloring.begin[color + 1]; ++i) {
                for (const ItemRun& run : tiles[coloring.order[i]]) {
                    add_run(run);
                }
                end_piece();
            }
            end_color();
        }
    }

    void add_run(const ItemRun& run) {
        const auto first = static_cast<std::ptrdiff_t>(item.size());
        add_block(true);
        std::copy(run.item.begin(), run.item.end(), item.begin() + first);
        for (std::size_t c = 0; c < per_item_; ++c) {
            std::iota(node[c].begin() + first, node[c].end(), run.node[c]);
        }
    }

    void end_piece() {
        if (piece_begin.back() != item.size()) {
            piece_begin.push_back(item.size());
        }
    }
    void end_color() {
        end_piece();
        if (color_begin.back() != item.size()) {
            color_begin.push_back(item.size());
        }
    }

    void add_singles(const std::vector<std::uint32_t>& singles, std::span<const std::int32_t> nodes) {
        std::vector<std::int32_t> own;
        for (const std::uint32_t single : singles) {
            const auto ends = nodes.subspan(single * per_item_, per_item_);
            own.insert(own.end(), ends.begin(), ends.end());
        }
        const Coloring coloring = color_greedily(own, per_item_, node_count_);
        for (std::size_t color = 0; color < coloring.colors(); ++color) {
            std::size_t slot = item.size();
            for (std::size_t i = coloring.begin[color]; i < coloring.begin[color + 1]; ++i, ++slot) {
                if (slot == item.size()) {
                    if (slot - piece_begin.back() >= kPieceBlocks * kPadding) {
                        end_piece();
                    }
                    add_block(false);
                }
                item[slot] = singles[coloring.order[i]];
                for (std::size_t c = 0; c < per_item_; ++c) {
                    node[c][slot] = own[coloring.order[i] * per_item_ + c];
                }
            }
            end_color();
        }
    }

    std::size_t per_item_, node_count_;
};

/// Of padding; its square and the inverse of that are floats.
constexpr double kFar = 0x1p40;

template <class T>
AlignedArray<T> filled(std::size_t size, T value) {
    AlignedArray<T> array(size);
    std::fill_n(array.data(), size, value);
    return array;
}

template <class T>
void fill(const Network& network, const std::vector<const Network::Cell*>& all, const Blocks& blocks,
          typename ColoredSoa<T>::Cells& cells) {
    cells.color_begin = blocks.color_begin;
    cells.piece_begin = blocks.piece_begin;
    cells.in_row = blocks.rows();
    const std::size_t slots = blocks.item.size();
    for (std::size_t corner = 0; corner < 8; ++corner) {
        cells.node[corner] = blocks.nodes_of(corner);
    }
    for (std::size_t e = 0; e < 9; ++e) {
        cells.rest_edge[e] = filled(slots, T(e % 4 == 0 ? 1 : 0));
    }
    cells.kappa = AlignedArray<T>(slots);
    cells.inverse_volume = filled(slots, T(1));
    for (std::size_t slot = 0; slot < slots; ++slot) {
        if (blocks.item[slot] == kNoItem) {
            continue;
        }
        const Network::Cell& c = *all[blocks.item[slot]];
        const RestShape rest = rest_shape(network, c);
        for (std::size_t e = 0; e < 9; ++e) {
            cells.rest_edge[e][slot] = static_cast<T>(rest.edges[e]);
        }
        cells.kappa[slot] = static_cast<T>(c.kappa);
        cells.inverse_volume[slot] = static_cast<T>(1 / rest.volume);
    }
}

/// Colours in slots become colours and pieces in blocks.
void divide(std::vector<std::size_t>& color_begin, std::vector<std::size_t>& piece_begin) {
    piece_begin = {0};
    for (std::size_t& begin : color_begin) {
        begin /= kBlockItems;
        while (piece_begin.back() < begin) {
            piece_begin.push_back(std::min(piece_begin.back() + kPieceBlocks, begin));
        }
    }
}

/// Polyhedra of one shape.
template <class Source, class Polyhedra>
void fill(const Source& source, std::size_t node_count, Polyhedra& polyhedra) {
    const Coloring coloring = color_greedily(source.nodes(), source.kNodes, node_count);
    polyhedra.color_begin = padded_begins(coloring);
    polyhedra.blocks = AlignedArray<typename Source::Block>(polyhedra.color_begin.back() / kBlockItems);
    std::int32_t own[Source::kNodes];
    for (std::size_t slot = 0; slot < polyhedra.color_begin.back(); ++slot) {
        typename Source::Block& block = polyhedra.blocks[slot / kBlockItems];
        std::fill_n(own, Source::kNodes, static_cast<std::int32_t>(node_count + slot % kBlockItems));
        source.set(block, slot % kBlockItems, own, 0);
        source.set_gap(block, slot % kBlockItems);
    }
    for_each_slot(coloring, polyhedra.color_begin, [&](std::size_t slot, std::size_t item) {
        typename Source::Block& block = polyhedra.blocks[slot / kBlockItems];
        std::copy_n(source.nodes().begin() + static_cast<std::ptrdiff_t>(item * Source::kNodes), Source::kNodes, own);
        source.set(block, slot % kBlockItems, own, source.weight(item));
        source.set_shape(item, block, slot % kBlockItems);
    });
    divide(polyhedra.color_begin, polyhedra.piece_begin);
}

} // namespace

template <class T>
ColoredSoa<T>::ColoredSoa(const Network& network)
    : masses(network.masses), inverse_mass(padded(network.masses.size() + kPadding)), node_count(network.masses.size()),
      spring_count(network.springs.size()), cell_count(network.cells.size() + network.polyhedra.size()) {
    for (std::size_t n = 0; n < node_count; ++n) {
        inverse_mass[n] = static_cast<T>(1 / masses[n]);
    }

    std::vector<std::int32_t> nodes;
    for (const Network::Spring& s : network.springs) {
        nodes.insert(nodes.end(), {s.a, s.b});
    }
    const Blocks blocks(nodes, 2, node_count);
    springs.color_begin = blocks.color_begin;
    springs.piece_begin = blocks.piece_begin;
    springs.in_row = blocks.rows();
    springs.a = blocks.nodes_of(0);
    springs.b = blocks.nodes_of(1);
    const std::size_t slots = blocks.item.size();
    springs.rest[0] = filled(slots, static_cast<T>(kFar));
    springs.rest[1] = AlignedArray<T>(slots);
    springs.rest[2] = AlignedArray<T>(slots);
    springs.stiffness = AlignedArray<T>(slots);
    springs.inverse_length2 = filled(slots, static_cast<T>(1 / (kFar * kFar)));
    for (std::size_t slot = 0; slot < slots; ++slot) {
        if (blocks.item[slot] == kNoItem) {
            continue;
        }
        const Network::Spring& s = network.springs[blocks.item[slot]];
        springs.stiffness[slot] = static_cast<T>(s.stiffness);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            springs.rest[axis][slot] = static_cast<T>(s.rest_vector[axis]);
        }
        springs.inverse_length2[slot] = static_cast<T>(1 / rest_length2(s));
    }

    const auto list_nodes = [&](const std::vector<const Network::Cell*>& all) {
        nodes.clear();
        for (const Network::Cell* c : all) {
            nodes.insert(nodes.end(), c->nodes.begin(), c->nodes.end());
        }
    };
    const std::vector<const Network::Cell*> with_volume = cells_of(network, false);
    list_nodes(with_volume);
    fill<T>(network, with_volume, Blocks(nodes, 8, node_count), cells);

    const std::vector<const Network::Cell*> with_means = cells_of(network, true);
    list_nodes(with_means);
    const Coloring coloring = color_greedily(nodes, 8, node_count);
    means.color_begin = padded_begins(coloring);
    means.blocks = AlignedArray<MeanBlock<T>>(means.color_begin.back() / kBlockItems);
    for (std::size_t slot = 0; slot < means.color_begin.back(); ++slot) {
        MeanBlock<T>& block = means.blocks[slot / kBlockItems];
        const std::size_t lane = slot % kBlockItems;
        for (auto& corner : block.node) {
            corner[lane] = static_cast<std::int32_t>(node_count + lane);
        }
        block.inverse_edge[lane] = 1;
    }
    for_each_slot(coloring, means.color_begin, [&](std::size_t slot, std::size_t item) {
        MeanBlock<T>& block = means.blocks[slot / kBlockItems];
        const std::size_t lane = slot % kBlockItems;
        const MeanCell cell = mean_cell(network, *with_means[item]);
        for (std::size_t corner = 0; corner < 8; ++corner) {
            block.node[corner][lane] = with_means[item]->nodes[corner];
        }
        block.stiffness[lane] = static_cast<T>(cell.stiffness);
        block.inverse_edge[lane] = static_cast<T>(cell.inverse_edge);
        block.volume_ratio[lane] = static_cast<T>(cell.volume_ratio);
    });
    divide(means.color_begin, means.piece_begin);
    fill(PolyhedronSource<T, CellShape::tetrahedron>(network, {}), node_count, polyhedra[0]);
    fill(PolyhedronSource<T, CellShape::pyramid>(network, {}), node_count, polyhedra[1]);
    fill(PolyhedronSource<T, CellShape::prism>(network, {}), node_count, polyhedra[2]);
}

template <class T>
std::size_t ColoredSoa<T>::bytes() const {
    const std::size_t spring_slots = springs.color_begin.back(), cell_slots = cells.color_begin.back();
    return spring_slots * (2 * sizeof(std::int32_t) + 5 * sizeof(T)) +
           cell_slots * (8 * sizeof(std::int32_t) + 11 * sizeof(T)) + (spring_slots + cell_slots) / kPadding +
           means.blocks.bytes() + polyhedra[0].blocks.bytes() + polyhedra[1].blocks.bytes() +
           polyhedra[2].blocks.bytes() + size() * sizeof(T) + node_count * sizeof(double);
}

template struct ColoredSoa<float>;
template struct ColoredSoa<double>;

} // namespace hybmss
