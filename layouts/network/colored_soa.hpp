#pragma once

#include "hybmss/network.hpp"
#include "layouts/aligned_array.hpp"
#include "layouts/network/network_blocks.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hybmss {

/// The layout "coloured-soa" of a network: structures of arrays, springs and cells sorted by colour, each colour padded
/// to whole vectors.
///
///     springs: | colour 0 ........ pad | colour 1 .... pad | ...     no node twice within a colour
///     nodes:   | 0 ... N - 1 | 16 dummies, one a lane, where the padding springs and cells begin and end |
///
/// Padding has stiffness zero and a rest shape of one, so that kernels neither branch nor divide by zero.
template <class T>
struct ColoredSoa {
    explicit ColoredSoa(const Network& network);

    struct Springs {
        AlignedArray<std::int32_t> a, b;
        AlignedArray<T> rest[3], stiffness, inverse_length2;
        std::vector<std::size_t> color_begin; ///< multiples of kPadding, one more entry at the end
    } springs;
    struct Cells {
        AlignedArray<std::int32_t> node[8];
        AlignedArray<T> rest_edge[9], kappa, inverse_volume;
        std::vector<std::size_t> color_begin;
    } cells;
    /// Those cells that have springs on their means.
    struct Means {
        AlignedArray<MeanBlock<T>> blocks;
        std::vector<std::size_t> color_begin; ///< in blocks
    } means;
    std::vector<double> masses;   ///< kg
    AlignedArray<T> inverse_mass; ///< 1 / m; zero at the dummies
    std::size_t node_count;
    std::size_t spring_count;
    std::size_t cell_count;

    /// Elements of a node array, dummies included; a multiple of kPadding.
    std::size_t size() const { return inverse_mass.size(); }
    std::size_t bytes() const;
};

extern template struct ColoredSoa<float>;
extern template struct ColoredSoa<double>;

} // namespace hybmss
