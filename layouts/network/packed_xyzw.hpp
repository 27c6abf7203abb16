#pragma once

#include "hybmss/network.hpp"
#include "layouts/aligned_array.hpp"
#include "layouts/network/network_blocks.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// The layout "packed-xyzw" of a network: nodes of four components, springs and cells in conflict-free blocks of
/// sixteen, blocks in tiles.
///
///     nodes:   | x y z 0 | x y z 0 | ...  one load and one store a node; a vector of nodes is four loads a quarter
///                                         vector each, transposed in registers to x.., y.., z..
///     runs:    | low, high, shape, stiffness | ...    sixteen springs from nodes in a row to nodes in a row
///     shapes:  | rest x, y, z x16 each | 1/l^2 x16 | ...   stiffnesses: | k x16 | ...   each kept once
///     blocks:  | a x16 | b x16 | rest x, y, z x16 each | k x16 | 1/l^2 x16 | ...   all other springs
///     tiles:   | colour 0: tile 3, tile 7, ... | colour 1: tile 0, ... |
///                           \_ runs and blocks of the tile: springs, cells, cells with springs on means
///
/// Where a mesh is regular, be it only piece by piece, the b - a of neighbouring springs are equal: such a run
/// (item_groups.hpp) is plain loads of whole vectors, and its low nodes are loaded and stored once for all runs from
/// them. A run is sixteen bytes, and nothing else where its shape and stiffnesses are those of others: a byte a spring,
/// where a spring in a block takes seven numbers.
///
/// Nodes keep the caller's numbering where it is one in space; else they are numbered row by row, like a lattice
/// (network_geometry.hpp). A Z curve (Morton order) was tried and lost: tiles touch fewer nodes, but each of them many
/// memory pages and short runs of cache lines. A tile owns a range of nodes and holds the springs and cells whose
/// lowest node is among them, so a tile's nodes stay in the first-level cache while its blocks stream past. Within a
/// block no node occurs twice (item_groups.hpp); tiles of one colour share no node (coloring.hpp). Sizes depend on the
/// body alone.
///
/// Gaps in runs are springs and cells of stiffness zero between the nodes that are there; behind the body's nodes
/// sixteen follow for them that belong to nobody. Gaps in blocks are springs and cells of stiffness zero that begin and
/// end at the tile's own dummy node, which follows these: nobody else touches it, and what is added there is zero.
template <class T>
struct PackedXyzw {
    /// \param vector_lanes of the kernels that will read it; it decides the order of a run's lanes (lane_of_row)
    /// \param one_tile all nodes in one tile
    explicit PackedXyzw(const Network& network, int vector_lanes = 1, bool one_tile = false);

    /// order[i] is the caller's node at place i; empty where the order is the caller's.
    std::vector<std::uint32_t> order;
    std::vector<std::uint32_t> place; ///< the inverse
    AlignedArray<SpringRun> spring_runs;
    AlignedArray<SpringRunShape<T>> spring_run_shapes;
    AlignedArray<LaneValues<T>> stiffnesses;
    AlignedArray<CellRun> cell_runs;
    AlignedArray<CellRunShape<T>> cell_run_shapes;
    AlignedArray<LaneValues<T>> kappas;
    AlignedArray<SpringBlock<T>> springs;
    AlignedArray<CellBlock<T>> cells;
    /// Those cells that have springs on their means, likewise.
    struct Means {
        AlignedArray<CellRun> runs;
        AlignedArray<MeanRunShape<T>> run_shapes;
        AlignedArray<LaneValues<T>> stiffnesses;
        AlignedArray<MeanBlock<T>> blocks;
    } means;
    AlignedArray<PolyhedronBlock<T>> polyhedra[3]; ///< by shape, as in kPolyhedronShapes
    std::vector<NetworkTile> tiles;                ///< colour after colour; in blocks
    std::vector<std::size_t> color_begin;          ///< where each colour starts in `tiles`; one more entry at the end
    std::vector<double> masses;                    ///< kg, in the caller's order
    AlignedArray<T> inverse_mass;                  ///< 1 / m three times and 0 for each node; zero at the dummies
    std::size_t node_count;
    std::size_t spring_count;
    std::size_t cell_count;

    /// Nodes in an array, dummies and padding included; a multiple of kPadding.
    std::size_t size() const { return inverse_mass.size() / 4; }
    std::size_t bytes() const;
};

extern template struct PackedXyzw<float>;
extern template struct PackedXyzw<double>;

} // namespace hybmss
