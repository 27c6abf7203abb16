#include "layouts/network/packed_xyzw.hpp"

#include "layouts/coloring.hpp"
#include "layouts/network/item_groups.hpp"
#include "layouts/network/network_geometry.hpp"
#include "layouts/network/packed_sources.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

/// Nodes a tile owns. Tiles are swept in the order of their nodes, so a large one keeps what it shares with its
/// neighbours in the cache: large enough that a tile meets few others, yet enough tiles for many threads.
std::size_t nodes_per_tile(std::size_t nodes) {
    return padded(std::clamp<std::size_t>(nodes / 32, 128, 16384));
}

/// Whether the caller's numbering is one in space already: the springs of a lattice numbered row by row span as many
/// places as two planes have nodes, those of a random numbering a good part of all.
bool well_ordered(const Network& network) {
    double span = 0, springs = 0;
    for_each_spring(network, [&](std::int32_t a, std::int32_t b, double, double) {
        span += std::abs(static_cast<double>(a) - static_cast<double>(b));
        ++springs;
    });
    return span <= 0.05 * static_cast<double>(network.masses.size()) * springs;
}

/// How far neighbours are apart: nine of ten springs are at least as long. 1 m where there are none.
double node_spacing(const Network& network) {
    std::vector<double> lengths;
    for_each_spring(network, [&](std::int32_t, std::int32_t, double, double length) { lengths.push_back(length); });
    if (lengths.empty()) {
        return 1;
    }
    const auto tenth = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 10);
    std::nth_element(lengths.begin(), tenth, lengths.end());
    return *tenth;
}

/// The blocks of all tiles, colour after colour; begin[t] is where the t-th tile of that order starts.
template <class Source>
auto make_blocks(const Source& source, const TiledItems& tiled, const Coloring& coloring, std::size_t node_count,
                 std::size_t first_dummy, std::vector<std::size_t>& begin) {
    ConflictFreeBlocks packing(node_count, Source::kNodes, kBlockItems);
    std::vector<std::uint32_t> slots;
    begin = {0};
    for (const std::uint32_t tile : coloring.order) {
        packing.append(tiled.singles[tile], source.nodes(), slots);
        begin.push_back(slots.size() / kBlockItems);
    }
    AlignedArray<typename Source::Block> blocks(slots.size() / kBlockItems);
    for (std::size_t t = 0; t < coloring.order.size(); ++t) {
        for (std::size_t slot = begin[t] * kBlockItems; slot < begin[t + 1] * kBlockItems; ++slot) {
            auto& block = blocks[slot / kBlockItems];
            const std::size_t lane = slot % kBlockItems, item = slots[slot];
            std::int32_t first[Source::kNodes];
            if (item == kNoItem) {
                std::fill_n(first, Source::kNodes, static_cast<std::int32_t>(4 * (first_dummy + t)));
                source.set(block, lane, first, 0);
                source.set_gap(block, lane);
            } else {
                for (std::size_t c = 0; c < Source::kNodes; ++c) {
                    first[c] = 4 * source.nodes()[item * Source::kNodes + c];
                }
                source.set(block, lane, first, source.weight(item));
                source.set_shape(item, block, lane);
            }
        }
    }
    return blocks;
}

template <class T, class Source>
struct Runs {
    AlignedArray<typename Source::Run> runs;
    AlignedArray<typename Source::RunShape> shapes;
    AlignedArray<LaneValues<T>> weights;
    std::vector<std::size_t> begin; ///< where the t-th tile starts
};

/// The runs of all tiles, likewise.
template <class T, class Source>
Runs<T, Source> make_runs(const Source& source, const TiledItems& tiled, const Coloring& coloring, int vector_lanes) {
    DistinctRows<typename Source::RunShape> shapes;
    DistinctRows<LaneValues<T>> weights;
    std::vector<typename Source::Run> runs;
    std::vector<std::size_t> begin = {0};
    for (const std::uint32_t tile : coloring.order) {
        for (const ItemRun& run : tiled.runs[tile]) {
            const std::uint32_t any =
                *std::find_if(run.item.begin(), run.item.end(), [](auto i) { return i != kNoItem; });
            typename Source::RunShape shape{};
            LaneValues<T> weight{};
            for (std::size_t position = 0; position < kBlockItems; ++position) {
                const std::uint32_t item = run.item[lane_of_row(position, vector_lanes)];
                weight.lane[position] = item == kNoItem ? T(0) : source.weight(item);
                source.set_shape(item == kNoItem ? any : item, shape, position);
            }
            std::int32_t first[Source::kNodes];
            std::transform(run.node.begin(), run.node.begin() + Source::kNodes, first,
                           [](std::int32_t n) { return 4 * n; });
            runs.push_back(source.run(first, shapes.number_of(shape), weights.number_of(weight)));
        }
        begin.push_back(runs.size());
    }
    AlignedArray<typename Source::Run> all(runs.size());
    std::copy(runs.begin(), runs.end(), all.data());
    return {std::move(all), shapes.array(), weights.array(), begin};
}

} // namespace

template <class T>
PackedXyzw<T>::PackedXyzw(const Network& network, int vector_lanes, bool one_tile)
    : masses(network.masses), node_count(network.masses.size()), spring_count(network.springs.size()),
      cell_count(network.cells.size() + network.polyhedra.size()) {
    if (!well_ordered(network)) {
        order = row_order(network.rest_positions, node_spacing(network));
        place.resize(node_count);
        for (std::size_t i = 0; i < node_count; ++i) {
            place[order[i]] = static_cast<std::uint32_t>(i);
        }
    }
    const SpringSource<T> spring_source(network, place);
    const CellSource<T> cell_source(network, place);
    const MeanSource<T> mean_source(network, place);
    const std::size_t tile_nodes = one_tile ? padded(std::max<std::size_t>(node_count, 1)) : nodes_per_tile(node_count);
    const std::size_t tile_count = (node_count + tile_nodes - 1) / tile_nodes;
    const TiledItems tiled_springs = tile_items(spring_source.nodes(), 2, tile_nodes, tile_count);
    const TiledItems tiled_cells = tile_items(cell_source.nodes(), 8, tile_nodes, tile_count);
    const TiledItems tiled_means = tile_items(mean_source.nodes(), 8, tile_nodes, tile_count);

    const std::size_t first_dummy = node_count + kBlockItems; // between them: what gaps in runs touch
    std::vector<std::vector<std::int32_t>> touched(tile_count);
    add_touched_nodes(tiled_springs, spring_source.nodes(), 2, touched);
    add_touched_nodes(tiled_cells, cell_source.nodes(), 8, touched);
    add_touched_nodes(tiled_means, mean_source.nodes(), 8, touched);
    const auto on_polyhedra = [&](const auto& visit) {
        visit(0, PolyhedronSource<T, CellShape::tetrahedron>(network, place));
        visit(1, PolyhedronSource<T, CellShape::pyramid>(network, place));
        visit(2, PolyhedronSource<T, CellShape::prism>(network, place));
    };
    TiledItems tiled_polyhedra[3];
    on_polyhedra([&](int shape, const auto& source) {
        TiledItems& tiled = tiled_polyhedra[shape];
        tiled = tile_items(source.nodes(), source.kNodes, tile_nodes, tile_count, kNoRun);
        add_touched_nodes(tiled, source.nodes(), source.kNodes, touched);
    });
    const Coloring coloring = color_tiles(touched, first_dummy);
    color_begin = coloring.begin;

    std::vector<std::size_t> spring_begin, cell_begin, mean_begin;
    springs = make_blocks(spring_source, tiled_springs, coloring, node_count, first_dummy, spring_begin);
    cells = make_blocks(cell_source, tiled_cells, coloring, node_count, first_dummy, cell_begin);
    means.blocks = make_blocks(mean_source, tiled_means, coloring, node_count, first_dummy, mean_begin);
    Runs<T, SpringSource<T>> along_springs = make_runs<T>(spring_source, tiled_springs, coloring, vector_lanes);
    Runs<T, CellSource<T>> along_cells = make_runs<T>(cell_source, tiled_cells, coloring, vector_lanes);
    Runs<T, MeanSource<T>> along_means = make_runs<T>(mean_source, tiled_means, coloring, vector_lanes);
    std::vector<std::size_t> polyhedron_begin[3];
    on_polyhedra([&](int shape, const auto& source) {
        polyhedra[shape] =
            make_blocks(source, tiled_polyhedra[shape], coloring, node_count, first_dummy, polyhedron_begin[shape]);
    });
    for (std::size_t t = 0; t < tile_count; ++t) {
        tiles.push_back({spring_begin[t], spring_begin[t + 1], cell_begin[t], cell_begin[t + 1], along_springs.begin[t],
                         along_springs.begin[t + 1], along_cells.begin[t], along_cells.begin[t + 1], mean_begin[t],
                         mean_begin[t + 1], along_means.begin[t], along_means.begin[t + 1]});
        for (std::size_t shape = 0; shape < 3; ++shape) {
            tiles.back().polyhedron_begin[shape] = polyhedron_begin[shape][t];
            tiles.back().polyhedron_end[shape] = polyhedron_begin[shape][t + 1];
        }
    }
    spring_runs = std::move(along_springs.runs);
    spring_run_shapes = std::move(along_springs.shapes);
    stiffnesses = std::move(along_springs.weights);
    cell_runs = std::move(along_cells.runs);
    cell_run_shapes = std::move(along_cells.shapes);
    kappas = std::move(along_cells.weights);
    means.runs = std::move(along_means.runs);
    means.run_shapes = std::move(along_means.shapes);
    means.stiffnesses = std::move(along_means.weights);

    inverse_mass = AlignedArray<T>(4 * padded(first_dummy + tile_count));
    for (std::size_t i = 0; i < node_count; ++i) {
        std::fill_n(inverse_mass.data() + 4 * i, 3, static_cast<T>(1 / masses[order.empty() ? i : order[i]]));
    }
}

template <class T>
std::size_t PackedXyzw<T>::bytes() const {
    return spring_runs.bytes() + spring_run_shapes.bytes() + stiffnesses.bytes() + cell_runs.bytes() +
           cell_run_shapes.bytes() + kappas.bytes() + springs.bytes() + cells.bytes() + means.runs.bytes() +
           means.run_shapes.bytes() + means.stiffnesses.bytes() + means.blocks.bytes() + polyhedra[0].bytes() +
           polyhedra[1].bytes() + polyhedra[2].bytes() + inverse_mass.bytes() + masses.size() * sizeof(double) +
           (order.size() + place.size()) * sizeof(std::uint32_t) + tiles.size() * sizeof(NetworkTile);
}

template struct PackedXyzw<float>;
template struct PackedXyzw<double>;

} // namespace hybmss
