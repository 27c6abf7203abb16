#pragma once

#include "hybmss/equilibrium.hpp"
#include "hybmss/lattice.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// A lattice's cells merged two by two along every axis, as a body of its own: its equilibrium is near that of the fine
/// one, in an eighth of the time.
///
/// A merged cell has the mean of the scales of its eight. Its corners lie on nodes of the fine grid, if not all on
/// nodes of the fine body.
class CoarserMesh {
public:
    /// Whether cells can be merged so, and are many enough for that to pay.
    static bool pays(const Lattice& fine);

    explicit CoarserMesh(const Lattice& fine);

    const Lattice& lattice() const { return lattice_; }
    /// The same supports and loads. A node in the place of a held one is held as it; one in a place where the fine body
    /// has none, as the mean of those held beside it. Forces go where interpolation comes from, weight with them:
    /// `masses` are those of the fine nodes.
    Loading restricted(const Loading& loading, std::span<const double> masses) const;
    /// Displacements of the coarse nodes, x y z each, from those of the fine ones in the same places.
    std::vector<double> injected(std::span<const double> fine) const;
    /// Those of the fine nodes, by linear interpolation within merged cells.
    std::vector<double> interpolated(std::span<const double> coarse) const;

private:
    /// visit(coarse node, weight) for those that the value at a fine node comes from: one, two, four or eight.
    template <class Visit>
    void for_each_source(std::size_t fine_node, const Visit& visit) const;

    std::array<int, 3> fine_cells_;
    std::vector<std::uint32_t> fine_nodes_; ///< grid indices
    std::vector<std::int32_t> fine_number_; ///< of each grid node; -1: none
    Lattice lattice_;
    std::vector<std::uint32_t> nodes_;
    std::vector<std::int32_t> number_;
};

} // namespace hybmss
