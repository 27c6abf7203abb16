#include "solvers/multigrid/cell_rotations.hpp"

#include "solvers/newton/preconditioner.hpp"

namespace hybmss {

CellRotations::CellRotations(const CellGradients& gradients) : gradients_(&gradients) {
    for (auto& entries : inverse_) {
        entries.assign(gradients.grid().size(), 0.0f);
    }
}

void CellRotations::invert(std::size_t cell, std::size_t count, const Lanes (&stiffness)[6], double smallest) {
    for (std::size_t lane = 0; lane < count; ++lane) {
        std::array<double, 6> entries;
        for (std::size_t e = 0; e < 6; ++e) {
            entries[e] = static_cast<double>(stiffness[e][lane]);
        }
        const std::array<double, 6> inverse = bounded_pseudoinverse(entries, smallest);
        for (std::size_t e = 0; e < 6; ++e) {
            inverse_[e][cell + lane] = static_cast<float>(inverse[e]);
        }
    }
}

// C^T r = sum over corners of s_a x (F^T r_a) = (T_y z - T_z y, ...),  T_e = F^T sum s_a[e] r_a
void CellRotations::add_correction(const GridVector& r, GridVector& z, const Workers& workers) const {
    const PaddedGrid& grid = gradients_->grid();
    const std::size_t length = grid.index(grid.cells[0], grid.cells[1], 0) - grid.index(-1, -1, 0) + 1;
    const auto layer = [&](int k, std::vector<float>& scratch) {
        const std::size_t first = grid.index(-1, -1, k);
        scratch.resize(9 * length);
        float* out[9];
        for (std::size_t e = 0; e < 9; ++e) {
            out[e] = scratch.data() + e * length;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            const float* at[8];
            for (std::size_t corner = 0; corner < 8; ++corner) {
                at[corner] = r.c[c].data() + first + grid.corner_offset(corner);
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
            F[e] = gradients_->entries()[e].data() + first;
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
                float* to = z.c[c].data() + first + grid.corner_offset(corner);
                const float *x = out[c], *y = out[3 + c], *w = out[6 + c];
                for (std::size_t n = 0; n < length; ++n) {
                    to[n] += sx * x[n] + sy * y[n] + sz * w[n];
                }
            }
        }
    };
    // A layer of cells writes two planes of nodes: every other layer at a time.
    const auto layers = static_cast<std::size_t>(grid.cells[2] + 2);
    for (std::size_t parity = 0; parity < 2; ++parity) {
        workers.run((layers + 1 - parity) / 2, [&](std::size_t piece, std::size_t) {
            thread_local std::vector<float> scratch;
            layer(static_cast<int>(2 * piece + parity) - 1, scratch);
        });
    }
}

} // namespace hybmss
