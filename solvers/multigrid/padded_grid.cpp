#include "solvers/multigrid/padded_grid.hpp"

namespace hybmss {
namespace {

/// Where a fine node lies between coarse ones: index of the first, and whether half-way to the next.
struct Between {
    int low;
    bool half;
};
Between between(int fine, bool merged) {
    return merged ? Between{fine / 2, fine % 2 == 1} : Between{fine, false};
}

} // namespace

PaddedGrid coarsened(const PaddedGrid& fine) {
    PaddedGrid coarse = fine;
    for (int& n : coarse.cells) {
        n = (n + 1) / 2;
    }
    return coarse;
}

void restrict_to(const PaddedGrid& fine_grid, const GridVector& fine, const PaddedGrid& coarse_grid, GridVector& coarse,
                 const Workers& workers) {
    bool merged[3];
    for (std::size_t c = 0; c < 3; ++c) {
        merged[c] = coarse_grid.cells[c] != fine_grid.cells[c];
    }
    // Every coarse node collects from the fine ones around it; those that do not exist are padding, or outside.
    workers.run(static_cast<std::size_t>(coarse_grid.cells[2] + 1), [&](std::size_t plane, std::size_t) {
        const int k = static_cast<int>(plane);
        for_each_place({0, 0, k}, {coarse_grid.cells[0], coarse_grid.cells[1], k}, [&](int i, int j, int) {
            const int at[3] = {i, j, k};
            int center[3], reach[3];
            for (std::size_t c = 0; c < 3; ++c) {
                center[c] = merged[c] ? 2 * at[c] : at[c];
                reach[c] = merged[c] ? 1 : 0;
            }
            float sum[3] = {};
            for (int z = -reach[2]; z <= reach[2]; ++z) {
                for (int y = -reach[1]; y <= reach[1]; ++y) {
                    for (int x = -reach[0]; x <= reach[0]; ++x) {
                        const int f[3] = {center[0] + x, center[1] + y, center[2] + z};
                        if (f[0] > fine_grid.cells[0] || f[1] > fine_grid.cells[1] || f[2] > fine_grid.cells[2] ||
                            f[0] < 0 || f[1] < 0 || f[2] < 0) {
                            continue;
                        }
                        const std::size_t n = fine_grid.index(f[0], f[1], f[2]);
                        const float weight = (x ? 0.5f : 1.0f) * (y ? 0.5f : 1.0f) * (z ? 0.5f : 1.0f);
                        for (std::size_t c = 0; c < 3; ++c) {
                            sum[c] += weight * fine.c[c][n];
                        }
                    }
                }
            }
            const std::size_t n = coarse_grid.index(i, j, k);
            for (std::size_t c = 0; c < 3; ++c) {
                coarse.c[c][n] = sum[c];
            }
        });
    });
}

void add_prolonged(const PaddedGrid& coarse_grid, const GridVector& coarse, const PaddedGrid& fine_grid,
                   GridVector& fine, const Workers& workers) {
    bool merged[3];
    for (std::size_t c = 0; c < 3; ++c) {
        merged[c] = coarse_grid.cells[c] != fine_grid.cells[c];
    }
    workers.run(static_cast<std::size_t>(fine_grid.cells[2] + 1), [&](std::size_t plane, std::size_t) {
        const int k = static_cast<int>(plane);
        const Between z = between(k, merged[2]);
        for_each_place({0, 0, k}, {fine_grid.cells[0], fine_grid.cells[1], k}, [&](int i, int j, int) {
            const Between x = between(i, merged[0]), y = between(j, merged[1]);
            const std::size_t low = coarse_grid.index(x.low, y.low, z.low), n = fine_grid.index(i, j, k);
            const float weight = (x.half ? 0.5f : 1.0f) * (y.half ? 0.5f : 1.0f) * (z.half ? 0.5f : 1.0f);
            float sum[3] = {};
            for (std::size_t dz = 0; dz <= (z.half ? 1u : 0u); ++dz) {
                for (std::size_t dy = 0; dy <= (y.half ? 1u : 0u); ++dy) {
                    for (std::size_t dx = 0; dx <= (x.half ? 1u : 0u); ++dx) {
                        const std::size_t at = low + dx + dy * coarse_grid.row() + dz * coarse_grid.plane();
                        for (std::size_t c = 0; c < 3; ++c) {
                            sum[c] += coarse.c[c][at];
                        }
                    }
                }
            }
            for (std::size_t c = 0; c < 3; ++c) {
                fine.c[c][n] += weight * sum[c];
            }
        });
    });
}

} // namespace hybmss
