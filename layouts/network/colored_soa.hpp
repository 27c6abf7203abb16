#pragma once

#include "hybmss/network.hpp"
#include "layouts/aligned_array.hpp"
#include "layouts/network/network_blocks.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hybmss {

/// The layout "coloured-soa" of a network: structures of arrays, springs and cells in blocks of sixteen, the blocks
/// sorted by colour.
///
///     springs: | colour 0: piece: block, block, ... | piece | ... | colour 1: piece | ...    no node in two pieces of
///     a colour nodes:   | 0 ... N - 1 | 16 dummies, one a lane, where padding begins and ends |
///
/// A block is either a run, whose nodes lie in rows (see ItemRun), so that whole vectors are loaded and stored; or its
/// lanes are gathered and scattered, and no node occurs in two of them, nor in two blocks of the colour. A piece of
/// runs is those of a tile of nodes, one after the other; in a run the rows of two ends may overlap: they are added to
/// one after the other too.
///
/// Padding has stiffness zero, and a rest length that nothing comes near, so that kernels neither branch nor divide by
/// zero.
template <class T>
struct ColoredSoa {
    explicit ColoredSoa(const Network& network);

    struct Springs {
        AlignedArray<std::int32_t> a, b;
        AlignedArray<T> rest[3], stiffness, inverse_length2;
        AlignedArray<std::uint8_t> in_row;    ///< one a block: whether it is a run
        std::vector<std::size_t> color_begin; ///< multiples of kPadding, one more entry at the end
        std::vector<std::size_t> piece_begin; ///< likewise; has all of those
    } springs;
    struct Cells {
        AlignedArray<std::int32_t> node[8];
        AlignedArray<T> rest_edge[9], kappa, inverse_volume;
        AlignedArray<std::uint8_t> in_row;
        std::vector<std::size_t> color_begin, piece_begin;
    } cells;
    /// Those cells that have springs on their means.
    struct Means {
        AlignedArray<MeanBlock<T>> blocks;
        std::vector<std::size_t> color_begin, piece_begin; ///< in blocks
    } means;
    struct Polyhedra {
        AlignedArray<PolyhedronBlock<T>> blocks;
        std::vector<std::size_t> color_begin, piece_begin; ///< in blocks
    } polyhedra[3];                                        ///< by shape, as in kPolyhedronShapes
    std::vector<double> masses;                            ///< kg
    AlignedArray<T> inverse_mass;                          ///< 1 / m; zero at the dummies
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
