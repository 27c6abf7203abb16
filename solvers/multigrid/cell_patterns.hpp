#pragma once

#include "kernels/grid_arguments.hpp"
#include "kernels/kernel_table.hpp"
#include "solvers/multigrid/cell_stiffness.hpp"
#include "solvers/multigrid/lanes.hpp"

#include <array>
#include <map>
#include <vector>

namespace hybmss {

/// The pairs a <= b of a cell's corners, in rows.
inline constexpr std::size_t kCornerPairs = kernels::kCornerPairs;

/// visit(pair, a, b)
template <class Visit>
void for_each_corner_pair(const Visit& visit) {
    std::size_t pair = 0;
    for (std::size_t a = 0; a < 8; ++a) {
        for (std::size_t b = a; b < 8; ++b) {
            visit(pair++, a, b);
        }
    }
}

/// Cells side by side whose matrices are made at a time.
inline constexpr std::size_t kCellsTogether = kernels::kMaxWidth;

/// Their matrices: of each pair of corners a <= b the 3x3 block by rows.
struct CellMatrices {
    alignas(64) float block[kCornerPairs][9][kCellsTogether];
};

/// CellTangents of as many cells, a few after the other, and what pulls their corners.
struct TangentRow {
    alignas(64) float springs[kSpringDirections][6][kCellsTogether];
    alignas(64) float areas[9][kCellsTogether];
    alignas(64) float volume_stiffness[kCellsTogether];
    alignas(64) float pull[kCellsTogether];
    alignas(64) float patterns[9][9][kCellsTogether];
    alignas(64) float fourth[kCellsTogether];
    bool has_volume = false, has_patterns = false;

    /// Those of kLanes cells from the place `first` on; the first of a row are at 0.
    void set(std::size_t first, const CellTangents& tangents, const Lanes& pull_of_cells);
};

/// What a merged cell's matrix is where all its cells deform alike and are as stiff: with A_d the stiffness of a spring
/// along d, c that of the volume and a_e its area vectors (CellTangents),
///
///     K = sum over d of S_d (x) A_d + c sum over e, f of V_ef (x) a_e a_f^T + pull P (x) 1
///         + sum over i, k of G_ik (x) B_ik + k_4 G_4 (x) 1
///
/// where S, V, P, G say which of its cells there are, which of their nodes are held, and how they were merged; the last
/// line, with B_ik of the patterns i and k of the corners, is of cells with springs on means alone.
struct CellPattern {
    static constexpr std::size_t kVolume = kSpringDirections, kPull = kVolume + 9, kPatterns = kPull + 1,
                                 kFourth = kPatterns + 9, kTerms = kFourth + 1;
    float factor[kCornerPairs][kTerms];

    /// Sets the matrices of the first `count` cells. (Of those up to a whole vector too.)
    void evaluate(const kernels::KernelTable<float>& table, const TangentRow& tangents, std::size_t count,
                  CellMatrices& matrices) const;
};

/// All patterns that the levels of a body have, each once. Cells of the same pattern differ by their deformation alone.
class CellPatterns {
public:
    static constexpr int kNone = -1; ///< for cells that differ in stiffness, or are held along some axes alone
    static constexpr int kVoid = 0;

    explicit CellPatterns(bool on_means = false);
    /// One cell, with these corners held.
    int cell(unsigned held_corners);
    /// Cells merged along some axes (bit 0: x); those of the high side of an axis that is not merged are void. kNone
    /// where one of them is, and where there are so many patterns that they do not pay.
    int merged(unsigned axes, const std::array<int, 8>& cells);
    const CellPattern& operator[](int pattern) const { return patterns_[static_cast<std::size_t>(pattern)]; }

private:
    bool on_means_;
    std::map<std::array<int, 9>, int> numbers_;
    std::vector<CellPattern> patterns_;
};

} // namespace hybmss
