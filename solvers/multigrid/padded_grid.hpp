#pragma once

#include "kernels/arguments.hpp"
#include "plan/threads/workers.hpp"
#include "solvers/multigrid/lanes.hpp"
#include "solvers/newton/ranks.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace hybmss {

/// The nodes of a grid of cells with a layer of nodes around them that belongs to nobody, x fastest, then y, then z: so
/// every node has all its neighbours, and a loop over neighbours needs no bounds. Nodes and cells count from -1; a cell
/// has the index of its low corner.
struct PaddedGrid {
    std::array<int, 3> cells;

    std::size_t row() const { return static_cast<std::size_t>(cells[0] + 3); }
    std::size_t plane() const { return row() * static_cast<std::size_t>(cells[1] + 3); }
    std::size_t size() const { return plane() * static_cast<std::size_t>(cells[2] + 3); }
    std::size_t index(int i, int j, int k) const {
        return static_cast<std::size_t>(i + 1) + row() * static_cast<std::size_t>(j + 1) +
               plane() * static_cast<std::size_t>(k + 1);
    }
    std::size_t corner_offset(std::size_t corner) const {
        return (corner & 1) + (corner >> 1 & 1 ? row() : 0) + (corner >> 2 ? plane() : 0);
    }
    std::size_t node_count() const {
        return static_cast<std::size_t>(cells[0] + 1) * static_cast<std::size_t>(cells[1] + 1) *
               static_cast<std::size_t>(cells[2] + 1);
    }
};

/// What arrays over a grid have beyond it: whole vectors are read and written.
inline constexpr std::size_t kBeyond = kernels::kMaxWidth;

/// Three values a node of a padded grid; zero where there is no node.
struct GridVector {
    explicit GridVector(const PaddedGrid& grid) {
        for (auto& array : c) {
            array.resize(grid.size() + kBeyond);
        }
    }
    std::array<std::vector<float>, 3> c;

    void clear() {
        for (auto& array : c) {
            array.assign(array.size(), 0.0f);
        }
    }
};

/// The nodes of a rank's padded grid that are on other ranks' too.
class SharedGrid {
public:
    /// has(index): whether the rank's body has the node.
    template <class Has>
    SharedGrid(const PaddedGrid& grid, const Ranks& ranks, const Has& has) : grid_(grid), border_(ranks, grid.cells) {
        for (const auto& [i, j, k] : border_.nodes()) {
            indices_.push_back(grid.index(i, j, k));
        }
        elsewhere_ = border_.counted_elsewhere([&](std::size_t n) { return has(indices_[n]); });
    }

    /// `arrays`: of some values a node each.
    template <std::size_t count>
    void add_up(std::array<std::vector<float>, count>& arrays) const {
        border_.add_up(count, [&](std::size_t n, std::size_t e) { return arrays[e].data() + indices_[n]; });
    }
    /// What a sum over the ranks counts once: zero where another one counts the node.
    void clear_counted_elsewhere(GridVector& vector) const {
        for (const std::uint32_t n : elsewhere_) {
            for (auto& array : vector.c) {
                array[indices_[n]] = 0;
            }
        }
    }

    /// Six values a cell, with those around the grid: what this rank has of cells of others is added to theirs, and
    /// zero here.
    void give_back(std::array<std::vector<float>, 6>& cells) const;

private:
    PaddedGrid grid_;
    RankBorder border_;
    std::vector<std::size_t> indices_;
    std::vector<std::uint32_t> elsewhere_;
};

/// visit(i, j, k) in index order, both ends included.
template <class Visit>
void for_each_place(const std::array<int, 3>& first, const std::array<int, 3>& last, const Visit& visit) {
    for (int k = first[2]; k <= last[2]; ++k) {
        for (int j = first[1]; j <= last[1]; ++j) {
            for (int i = first[0]; i <= last[0]; ++i) {
                visit(i, j, k);
            }
        }
    }
}

/// The grid of cells merged two by two along every axis with more than one; the last one of an odd number stays alone,
/// as the low half of a merged cell.
PaddedGrid coarsened(const PaddedGrid& fine);

/// coarse = P^T fine: P interpolates linearly along each axis that was merged.
void restrict_to(const PaddedGrid& fine_grid, const GridVector& fine, const PaddedGrid& coarse_grid, GridVector& coarse,
                 const Workers& workers);

/// fine += P coarse
void add_prolonged(const PaddedGrid& coarse_grid, const GridVector& coarse, const PaddedGrid& fine_grid,
                   GridVector& fine, const Workers& workers);

} // namespace hybmss
