#include "solvers/multigrid/cell_rotations.hpp"

#include "solvers/newton/preconditioner.hpp"

#include <utility>

namespace hybmss {

CellRotations::CellRotations(const CellGradients& gradients) : gradients_(&gradients) {
    for (auto& entries : inverse_) {
        entries.assign(gradients.grid().size() + kLanes, 0.0f);
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
//
// A cell gives sx X + sy Y + sz Z to its corners. A node takes that of the two cells along x first, then of those along
// y, then adds it to its plane and to the one above.
void CellRotations::add_correction(const GridVector& r, GridVector& z, const Workers& workers) const {
    const PaddedGrid& grid = gradients_->grid();
    const auto [nx, ny, nz] = grid.cells;
    const auto nodes = static_cast<std::size_t>(nx + 1);
    const std::size_t width = nodes + 1 + kLanes;
    const auto turn_row = [&](std::size_t first, float* const(&of_cells)[9]) {
        for (std::size_t i = 0; i < nodes + 1; i += kLanes) {
            const std::size_t cell = first + i;
            Lanes S[3][3]; // by corner sign, by component
            for (std::size_t c = 0; c < 3; ++c) {
                Lanes at[8];
                for (std::size_t corner = 0; corner < 8; ++corner) {
                    at[corner] = load_lanes_at(r.c[c].data() + cell + grid.corner_offset(corner));
                }
                const Lanes a = at[1] - at[0], b = at[3] - at[2], p = at[5] - at[4], q = at[7] - at[6];
                const Lanes s = at[1] + at[0], t = at[3] + at[2], u = at[5] + at[4], v = at[7] + at[6];
                S[0][c] = (a + b) + (p + q);
                S[1][c] = (t - s) + (v - u);
                S[2][c] = (u + v) - (s + t);
            }
            Lanes F[9], G[6];
            for (std::size_t e = 0; e < 9; ++e) {
                F[e] = load_lanes_at(gradients_->entries()[e].data() + cell);
            }
            for (std::size_t e = 0; e < 6; ++e) {
                G[e] = load_lanes_at(inverse_[e].data() + cell);
            }
            // T_e[c] = F[.][c] . S_e; only the six that the cross products need.
            const auto t = [&](std::size_t e, std::size_t c) {
                return F[c] * S[e][0] + F[3 + c] * S[e][1] + F[6 + c] * S[e][2];
            };
            const Lanes mx = t(1, 2) - t(2, 1), my = t(2, 0) - t(0, 2), mz = t(0, 1) - t(1, 0);
            const Lanes wx = G[0] * mx + G[1] * my + G[2] * mz;
            const Lanes wy = G[1] * mx + G[3] * my + G[4] * mz;
            const Lanes wz = G[2] * mx + G[4] * my + G[5] * mz;
            // F (w x e_x) = F (0, wz, -wy), and so on
            for (std::size_t c = 0; c < 3; ++c) {
                store_lanes_at(F[3 * c + 1] * wz - F[3 * c + 2] * wy, of_cells[c] + i);
                store_lanes_at(F[3 * c + 2] * wx - F[3 * c] * wz, of_cells[3 + c] + i);
                store_lanes_at(F[3 * c] * wy - F[3 * c + 1] * wx, of_cells[6 + c] + i);
            }
        }
    };
    const auto layer = [&, ny = ny, nz = nz](int k, std::vector<float>& scratch) {
        scratch.resize(27 * width);
        float *of_cells[9], *before[9], *now[9];
        for (std::size_t e = 0; e < 9; ++e) {
            of_cells[e] = scratch.data() + e * width;
            before[e] = of_cells[e] + 9 * width;
            now[e] = of_cells[e] + 18 * width;
        }
        for (int j = -1; j <= ny; ++j) {
            turn_row(grid.index(-1, j, k), of_cells);
            for (std::size_t c = 0; c < 3; ++c) {
                const float *X = of_cells[c], *Y = of_cells[3 + c], *Z = of_cells[6 + c];
                for (std::size_t i = 0; i < nodes; ++i) {
                    now[c][i] = X[i] - X[i + 1];
                    now[3 + c][i] = Y[i] + Y[i + 1];
                    now[6 + c][i] = Z[i] + Z[i + 1];
                }
                if (j >= 0) {
                    const std::size_t node = grid.index(0, j, k);
                    float* below = k >= 0 ? z.c[c].data() + node : nullptr;
                    float* above = k < nz ? z.c[c].data() + node + grid.plane() : nullptr;
                    const float *p = before[c], *q = before[3 + c], *w = before[6 + c];
                    for (std::size_t i = 0; below && i < nodes; ++i) {
                        below[i] += (p[i] + now[c][i]) + (q[i] - now[3 + c][i]) - (w[i] + now[6 + c][i]);
                    }
                    for (std::size_t i = 0; above && i < nodes; ++i) {
                        above[i] += (p[i] + now[c][i]) + (q[i] - now[3 + c][i]) + (w[i] + now[6 + c][i]);
                    }
                }
            }
            std::swap(before, now);
        }
    };
    // A layer of cells writes two planes of nodes: every other layer at a time.
    const auto layers = static_cast<std::size_t>(nz + 2);
    for (std::size_t parity = 0; parity < 2; ++parity) {
        workers.run((layers + 1 - parity) / 2, [&](std::size_t piece, std::size_t) {
            thread_local std::vector<float> scratch;
            layer(static_cast<int>(2 * piece + parity) - 1, scratch);
        });
    }
}

} // namespace hybmss
