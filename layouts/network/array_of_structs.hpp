#pragma once

#include "hybmss/network.hpp"
#include "layouts/aligned_array.hpp"
#include "layouts/network/network_blocks.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hybmss {

/// The layout "aos" of a network: what people write first, the baseline that the others must beat.
///
///     nodes:   | x y z 0 | x y z 0 | ...              in the caller's order
///     springs: | a b r k 1/l^2 | a b r k 1/l^2 | ...   in the caller's order, one struct each; cells likewise
///
/// Scalar loops go over them one after the other: one tile, so one thread.
template <class T>
struct ArrayOfStructs {
    explicit ArrayOfStructs(const Network& network);

    std::vector<std::uint32_t> order, place; ///< empty: the caller's order
    AlignedArray<SpringRecord<T>> springs;
    AlignedArray<CellRecord<T>> cells;
    std::vector<NetworkTile> tiles;       ///< one with everything
    std::vector<std::size_t> color_begin; ///< one colour
    std::vector<double> masses;           ///< kg
    AlignedArray<T> inverse_mass;         ///< 1 / m three times and 0 for each node
    std::size_t node_count;
    std::size_t spring_count;
    std::size_t cell_count;

    /// Nodes in an array, padding included; a multiple of kPadding.
    std::size_t size() const { return inverse_mass.size() / 4; }
    std::size_t bytes() const;
};

extern template struct ArrayOfStructs<float>;
extern template struct ArrayOfStructs<double>;

} // namespace hybmss
