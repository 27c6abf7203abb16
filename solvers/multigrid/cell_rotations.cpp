#include "solvers/multigrid/cell_rotations.hpp"

#include <algorithm>

namespace hybmss {

CellRotations::CellRotations(const PaddedGrid& grid) : grid_(grid), present_(grid.size(), 0) {
    for (std::size_t e = 0; e < 9; ++e) {
        gradient_[e].assign(grid.size(), e % 4 == 0 ? 1.0f : 0.0f);
    }
    for (auto& entries : inverse_) {
        entries.assign(grid.size(), 0.0f);
    }
}

void CellRotations::spread() {
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
                        sum[e] += gradient_[e][other];
                    }
                }
            });
        for (std::size_t e = 0; e < 9; ++e) {
            gradient_[e][cell] = count > 0 ? sum[e] / count : (e % 4 == 0 ? 1.0f : 0.0f);
        }
    });
}

// C^T r = sum over corners of s_a x (F^T r_a) = (T_y z - T_z y, ...),  T_e = F^T sum s_a[e] r_a
void CellRotations::add_correction(const GridVector& r, GridVector& z, const Workers& workers) const {
    const std::size_t length = grid_.index(grid_.cells[0], grid_.cells[1], 0) - grid_.index(-1, -1, 0) + 1;
    const auto layer = [&](int k, std::vector<float>& scratch) {
        const std::size_t first = grid_.index(-1, -1, k);
        scratch.resize(9 * length);
        float* out[9];
        for (std::size_t e = 0; e < 9; ++e) {
            out[e] = scratch.data() + e * length;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            const float* at[8];
            for (std::size_t corner = 0; corner < 8; ++corner) {
                at[corner] = r.c[c].data() + first + grid_.corner_offset(corner);
            }
            float *x = out[c], *y = out[3 + c], *w = out[6 + c];
            for (std::size_t n = 0; n < length; ++n) {
                const float a = at[1][n] - at[0][n], b = at[3][n] - at[2][n], p = at[5][n] - at[4][n],
                            q = at[7][n] - at[6][n];
                const float s = at[1][n] + at[0][n], t = at[3][n] + at[2][n], u = at[5][n] + at[4][n],
                            v = at[7][n] + at[6][n];
                x[n] = (a + b) + (p + q);
                y[n] = (t - s) + (v - u);
                w[n] = (u + v) - (s + t);
            }
        }
        const float *F[9], *G[6];
        for (std::size_t e = 0; e < 9; ++e) {
            F[e] = gradient_[e].data() + first;
        }
        for (std::size_t e = 0; e < 6; ++e) {
            G[e] = inverse_[e].data() + first;
        }
        for (std::size_t n = 0; n < length; ++n) {
            // T_e[c] = F[.][c] . S_e; only the six that the cross products need.
            const auto t = [&](std::size_t e, std::size_t c) {
                return F[c][n] * out[3 * e][n] + F[3 + c][n] * out[3 * e + 1][n] + F[6 + c][n] * out[3 * e + 2][n];
            };
            const float mx = t(1, 2) - t(2, 1), my = t(2, 0) - t(0, 2), mz = t(0, 1) - t(1, 0);
            const float wx = G[0][n] * mx + G[1][n] * my + G[2][n] * mz;
            const float wy = G[1][n] * mx + G[3][n] * my + G[4][n] * mz;
            const float wz = G[2][n] * mx + G[4][n] * my + G[5][n] * mz;
            // F (w x e_x) = F (0, wz, -wy), and so on
            for (std::size_t c = 0; c < 3; ++c) {
                out[c][n] = F[3 * c + 1][n] * wz - F[3 * c + 2][n] * wy;
                out[3 + c][n] = F[3 * c + 2][n] * wx - F[3 * c][n] * wz;
                out[6 + c][n] = F[3 * c][n] * wy - F[3 * c + 1][n] * wx;
            }
        }
        for (std::size_t corner = 0; corner < 8; ++corner) {
            const float sx = corner & 1 ? 1.0f : -1.0f, sy = corner & 2 ? 1.0f : -1.0f, sz = corner & 4 ? 1.0f : -1.0f;
            for (std::size_t c = 0; c < 3; ++c) {
                float* to = z.c[c].data() + first + grid_.corner_offset(corner);
                const float *x = out[c], *y = out[3 + c], *w = out[6 + c];
                for (std::size_t n = 0; n < length; ++n) {
                    to[n] += sx * x[n] + sy * y[n] + sz * w[n];
                }
            }
        }
    };
    // A layer of cells writes two planes of nodes: every other layer at a time.
    const auto layers = static_cast<std::size_t>(grid_.cells[2] + 2);
    for (std::size_t parity = 0; parity < 2; ++parity) {
        workers.run((layers + 1 - parity) / 2, [&](std::size_t piece, std::size_t) {
            thread_local std::vector<float> scratch;
            layer(static_cast<int>(2 * piece + parity) - 1, scratch);
        });
    }
}

} // namespace hybmss
