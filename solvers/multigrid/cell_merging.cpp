#include "solvers/multigrid/cell_merging.hpp"

namespace hybmss {

void spread_half(CellMatrix& matrix, unsigned axis, bool high) {
    const std::size_t bit = std::size_t{1} << axis;
    // The corner whose value is spread in halves over both, and the one that keeps its own.
    const auto spread = [bit, high](std::size_t corner) { return high ? corner & ~bit : corner | bit; };
    for (std::size_t corner = 0; corner < 8; ++corner) {
        if (corner & bit) {
            continue;
        }
        const std::size_t s = spread(corner), keep = s ^ bit;
        float* from = &matrix.block[s][0][0];
        float* to = &matrix.block[keep][0][0];
        for (std::size_t i = 0; i < 72; ++i) {
            from[i] *= 0.5f;
            to[i] += from[i];
        }
    }
    for (auto& row : matrix.block) {
        for (std::size_t corner = 0; corner < 8; ++corner) {
            if (corner & bit) {
                continue;
            }
            const std::size_t s = spread(corner), keep = s ^ bit;
            for (std::size_t i = 0; i < 9; ++i) {
                row[s][i] *= 0.5f;
                row[keep][i] += row[s][i];
            }
        }
    }
}

void add(const CellMatrix& term, CellMatrix& sum) {
    const float* from = &term.block[0][0][0];
    float* to = &sum.block[0][0][0];
    for (std::size_t i = 0; i < 576; ++i) {
        to[i] += from[i];
    }
}

} // namespace hybmss
