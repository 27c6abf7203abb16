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

/// One spring as a struct, as people write it first; `a` and `b` as above.
template <class T>
struct SpringRecord {
    std::int32_t a, b;
    T rest[3];
    T stiffness;
    T inverse_length2;
};

/// One hexahedral cell as a struct.
template <class T>
struct CellRecord {
    std::int32_t node[8];
    T rest_edge[9];
    T kappa;
    T inverse_volume;
};

/// A bundle of springs and cells, by their positions in the arrays of a layout: blocks or single ones.
struct NetworkTile {
    std::size_t spring_begin, spring_end;
    std::size_t cell_begin, cell_end;
};

} // namespace hybmss
