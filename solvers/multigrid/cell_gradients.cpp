#include "solvers/multigrid/cell_gradients.hpp"

#include "solvers/multigrid/lanes.hpp"

#include <algorithm>

namespace hybmss {

CellGradients::CellGradients(const PaddedGrid& grid) : grid_(grid), present_(grid.size(), 0) {
    for (std::size_t e = 0; e < 9; ++e) {
        entries_[e].assign(grid.size() + kBeyond, e % 4 == 0 ? 1.0f : 0.0f);
    }
}

// F_ce = delta_ce + 1/4 sum over corners of +-u_c, + on the high side of the axis e.
void CellGradients::take(const GridVector& displacement, double unit, const Workers& workers) {
    const auto quarter = static_cast<float>(unit / 4);
    workers.run(static_cast<std::size_t>(grid_.cells[2]), [&](std::size_t layer, std::size_t) {
        const std::size_t first = grid_.index(0, 0, static_cast<int>(layer));
        const std::size_t length = grid_.index(grid_.cells[0], grid_.cells[1] - 1, static_cast<int>(layer)) - first;
        for (std::size_t c = 0; c < 3; ++c) {
            const float* at[8];
            for (std::size_t corner = 0; corner < 8; ++corner) {
                at[corner] = displacement.c[c].data() + first + grid_.corner_offset(corner);
            }
            float* to[3];
            float unity[3];
            for (std::size_t e = 0; e < 3; ++e) {
                to[e] = entries_[3 * c + e].data() + first;
                unity[e] = e == c ? 1.0f : 0.0f;
            }
            for (std::size_t n = 0; n < length; ++n) {
                const float a = at[1][n] - at[0][n], b = at[3][n] - at[2][n], p = at[5][n] - at[4][n],
                            q = at[7][n] - at[6][n];
                const float s = at[1][n] + at[0][n], t = at[3][n] + at[2][n], u = at[5][n] + at[4][n],
                            v = at[7][n] + at[6][n];
                to[0][n] = unity[0] + quarter * ((a + b) + (p + q));
                to[1][n] = unity[1] + quarter * ((t - s) + (v - u));
                to[2][n] = unity[2] + quarter * ((u + v) - (s + t));
            }
        }
    });
}

void CellGradients::merge(const CellGradients& fine) {
    const PaddedGrid& from = fine.grid_;
    int merged[3];
    for (std::size_t c = 0; c < 3; ++c) {
        merged[c] = grid_.cells[c] != from.cells[c];
    }
    for_each_place({0, 0, 0}, {grid_.cells[0] - 1, grid_.cells[1] - 1, grid_.cells[2] - 1}, [&](int i, int j, int k) {
        const std::size_t cell = grid_.index(i, j, k);
        if (!present_[cell]) {
            return;
        }
        float sum[9] = {}, count = 0;
        for_each_place({0, 0, 0}, {merged[0], merged[1], merged[2]}, [&](int x, int y, int z) {
            const std::size_t n = from.index((1 + merged[0]) * i + x, (1 + merged[1]) * j + y, (1 + merged[2]) * k + z);
            if (fine.present_[n]) {
                count += 1;
                for (std::size_t e = 0; e < 9; ++e) {
                    sum[e] += fine.entries_[e][n];
                }
            }
        });
        for (std::size_t e = 0; e < 9; ++e) {
            entries_[e][cell] = sum[e] / count;
        }
    });
}

void CellGradients::spread() {
    for_each_place({-1, -1, -1}, grid_.cells, [&](int i, int j, int k) {
        const std::size_t cell = grid_.index(i, j, k);
        if (present_[cell]) {
            return;
        }
        float sum[9] = {}, count = 0;
        for_each_place(
            {std::max(i - 1, -1), std::max(j - 1, -1), std::max(k - 1, -1)},
            {std::min(i + 1, grid_.cells[0]), std::min(j + 1, grid_.cells[1]), std::min(k + 1, grid_.cells[2])},
            [&](int x, int y, int z) {
                const std::size_t other = grid_.index(x, y, z);
                if (present_[other]) {
                    count += 1;
                    for (std::size_t e = 0; e < 9; ++e) {
                        sum[e] += entries_[e][other];
                    }
                }
            });
        for (std::size_t e = 0; e < 9; ++e) {
            entries_[e][cell] = count > 0 ? sum[e] / count : (e % 4 == 0 ? 1.0f : 0.0f);
        }
    });
}

} // namespace hybmss
