#pragma once

#include <cstddef>
#include <cstdint>

namespace hybmss {

/// The items of a block: the widest vector's lanes in float; narrower vectors take it in parts.
inline constexpr int kBlockItems = 16;

/// Sixteen springs. `a` and `b` are the nodes' first elements in a packed array: 4 times their place.
template <class T>
struct alignas(64) SpringBlock {
    std::int32_t a[kBlockItems], b[kBlockItems];
    T rest[3][kBlockItems]; ///< X_b - X_a
    T stiffness[kBlockItems];
    T inverse_length2[kBlockItems]; ///< 1 / l^2
};

/// Sixteen hexahedral cells; row c of `node` is corner c.
template <class T>
struct alignas(64) CellBlock {
    std::int32_t node[8][kBlockItems];
    T rest_edge[9][kBlockItems]; ///< a0, b0, c0: the means of four parallel edges at rest, x y z each
    T kappa[kBlockItems];
    T inverse_volume[kBlockItems]; ///< 1 / V0
};

/// Sixteen cells with springs on means, cubes. Nodes as in CellBlock; of separate arrays, their places.
template <class T>
struct alignas(64) MeanBlock {
    std::int32_t node[8][kBlockItems];
    T stiffness[kBlockItems];    ///< k_c h of the cube diagonals, N; 0: no cell
    T inverse_edge[kBlockItems]; ///< 1 / h
    T volume_ratio[kBlockItems]; ///< kappa h^2 / (32 k_c h)
};

/// Sixteen polyhedra of one shape. Nodes as in MeanBlock, the first 4, 5 or 6 rows; of a prism all vectors
/// (network_geometry.hpp), of others three. Rows that a shape has not are never read.
template <class T>
struct alignas(64) PolyhedronBlock {
    std::int32_t node[6][kBlockItems];
    T rest[15][kBlockItems];       ///< a, b, c, d, e, x y z each
    T kappa[kBlockItems];          ///< 0: no cell
    T inverse_volume[kBlockItems]; ///< 1 / V0
};

/// Which node of a run stands at `position` in the rows of a run. Vectors of nodes in a row, transposed within groups
/// of four lanes, do not come out in the order of the nodes: with four vectors of `groups` quads each, lane 4 g + j is
/// node groups j + g.
constexpr std::size_t lane_of_row(std::size_t position, int vector_lanes) {
    const auto lanes = static_cast<std::size_t>(vector_lanes), groups = lanes / 4;
    if (groups < 2) {
        return position;
    }
    const std::size_t within = position % lanes;
    return position - within + groups * (within % 4) + within / 4;
}

/// Sixteen numbers, one a lane.
template <class T>
struct alignas(64) LaneValues {
    T lane[kBlockItems];
};

/// The rest vectors of a run's springs, as in SpringBlock; a lane without a spring repeats that of another.
template <class T>
struct alignas(64) SpringRunShape {
    T rest[3][kBlockItems];
    T inverse_length2[kBlockItems];
};

/// Springs between sixteen nodes in a row and sixteen others in a row: from the i-th of the ones to the i-th of the
/// others. `low` and `high` are the first nodes' first elements; shape and stiffness lie in arrays of their own, since
/// many runs have the same.
struct SpringRun {
    std::int32_t low, high;
    std::uint32_t shape;     ///< which SpringRunShape
    std::uint32_t stiffness; ///< which LaneValues: k, 0 where there is no spring
};

/// The rest shapes of a run's cells, as in CellBlock.
template <class T>
struct alignas(64) CellRunShape {
    T rest_edge[9][kBlockItems];
    T inverse_volume[kBlockItems];
};

/// Cells likewise: corner c of the i-th cell is the i-th node after node[c].
struct CellRun {
    std::int32_t node[8];
    std::uint32_t shape;   ///< which CellRunShape, or MeanRunShape
    std::uint32_t weights; ///< which LaneValues: kappa, or the stiffness of springs on means; 0 where there is no cell
};

/// The shapes of a run of cells with springs on means, as in MeanBlock.
template <class T>
struct alignas(64) MeanRunShape {
    T inverse_edge[kBlockItems];
    T volume_ratio[kBlockItems];
};

/// A bundle of springs and cells, by their positions in the arrays of a layout: blocks, and runs.
struct NetworkTile {
    std::size_t spring_begin, spring_end;
    std::size_t cell_begin, cell_end;
    std::size_t spring_run_begin = 0, spring_run_end = 0;
    std::size_t cell_run_begin = 0, cell_run_end = 0;
    std::size_t mean_begin = 0, mean_end = 0;
    std::size_t mean_run_begin = 0, mean_run_end = 0;
    std::size_t polyhedron_begin[3] = {}, polyhedron_end[3] = {}; ///< by shape
};

} // namespace hybmss
