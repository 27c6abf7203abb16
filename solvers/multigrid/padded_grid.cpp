#include "solvers/multigrid/padded_grid.hpp"

#include <algorithm>

namespace hybmss {
namespace {

/// to += weight from
void add_row(float weight, const float* from, float* to, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] += weight * from[i];
    }
}

/// What the coarse place `at` along an axis collects of `count` fine rows of `length`, `distance` apart:
/// to = row 2 at + (row 2 at - 1 + row 2 at + 1) / 2 where the axis is merged, else row `at`.
void collect_rows(bool merged, int at, int count, const float* rows, std::size_t distance, float* to,
                  std::size_t length) {
    std::fill_n(to, length, 0.0f);
    const int center = merged ? 2 * at : at;
    for (int row = std::max(center - (merged ? 1 : 0), 0); row <= std::min(center + (merged ? 1 : 0), count - 1);
         ++row) {
        add_row(row == center ? 1.0f : 0.5f, rows + static_cast<std::size_t>(row) * distance, to, length);
    }
}

/// What the fine place `at` along an axis is between coarse rows.
void interpolate_rows(bool merged, int at, const float* rows, std::size_t distance, float* to, std::size_t length) {
    const float* low = rows + static_cast<std::size_t>(merged ? at / 2 : at) * distance;
    if (merged && at % 2 == 1) {
        for (std::size_t i = 0; i < length; ++i) {
            to[i] = 0.5f * (low[i] + low[distance + i]);
        }
    } else {
        std::copy_n(low, length, to);
    }
}

/// Of every thread, `size` values.
float* scratch(std::size_t size) {
    thread_local std::vector<float> values;
    if (values.size() < size) {
        values.resize(size);
    }
    return values.data();
}

std::array<bool, 3> merged_axes(const PaddedGrid& fine, const PaddedGrid& coarse) {
    return {fine.cells[0] != coarse.cells[0], fine.cells[1] != coarse.cells[1], fine.cells[2] != coarse.cells[2]};
}

} // namespace

PaddedGrid coarsened(const PaddedGrid& fine) {
    PaddedGrid coarse = fine;
    for (int& n : coarse.cells) {
        n = (n + 1) / 2;
    }
    return coarse;
}

// One axis after the other: planes, then rows, then along them.
void restrict_to(const PaddedGrid& fine_grid, const GridVector& fine, const PaddedGrid& coarse_grid, GridVector& coarse,
                 const Workers& workers) {
    const std::array<bool, 3> merged = merged_axes(fine_grid, coarse_grid);
    const int nx = fine_grid.cells[0] + 1, ny = fine_grid.cells[1] + 1, nz = fine_grid.cells[2] + 1;
    const std::size_t row = fine_grid.row(), length = row * static_cast<std::size_t>(ny);
    workers.run(static_cast<std::size_t>(coarse_grid.cells[2] + 1), [&](std::size_t piece, std::size_t) {
        const int k = static_cast<int>(piece);
        float* const plane = scratch(length + row + 2);
        float* const line = plane + length;
        line[0] = 0; // before the first node
        for (std::size_t c = 0; c < 3; ++c) {
            collect_rows(merged[2], k, nz, fine.c[c].data() + fine_grid.index(0, 0, 0), fine_grid.plane(), plane,
                         length);
            for (int j = 0; j <= coarse_grid.cells[1]; ++j) {
                float* const along = line + 1;
                collect_rows(merged[1], j, ny, plane, row, along, static_cast<std::size_t>(nx));
                float* const to = coarse.c[c].data() + coarse_grid.index(0, j, k);
                if (!merged[0]) {
                    std::copy_n(along, nx, to);
                    continue;
                }
                along[nx] = along[nx + 1] = 0; // behind the last
                for (int i = 0; i <= coarse_grid.cells[0]; ++i) {
                    to[i] = along[2 * i] + 0.5f * (along[2 * i - 1] + along[2 * i + 1]);
                }
            }
        }
    });
}

void add_prolonged(const PaddedGrid& coarse_grid, const GridVector& coarse, const PaddedGrid& fine_grid,
                   GridVector& fine, const Workers& workers) {
    const std::array<bool, 3> merged = merged_axes(fine_grid, coarse_grid);
    const int nx = fine_grid.cells[0] + 1;
    const std::size_t row = coarse_grid.row(), length = row * static_cast<std::size_t>(coarse_grid.cells[1] + 1);
    const auto nodes = static_cast<std::size_t>(coarse_grid.cells[0] + 1);
    workers.run(static_cast<std::size_t>(fine_grid.cells[2] + 1), [&](std::size_t piece, std::size_t) {
        const int k = static_cast<int>(piece);
        float* const plane = scratch(length + row);
        float* const along = plane + length;
        for (std::size_t c = 0; c < 3; ++c) {
            interpolate_rows(merged[2], k, coarse.c[c].data() + coarse_grid.index(0, 0, 0), coarse_grid.plane(), plane,
                             length);
            for (int j = 0; j <= fine_grid.cells[1]; ++j) {
                interpolate_rows(merged[1], j, plane, row, along, nodes);
                float* const to = fine.c[c].data() + fine_grid.index(0, j, k);
                if (!merged[0]) {
                    add_row(1, along, to, nodes);
                    continue;
                }
                for (int i = 0; i < nx / 2; ++i) {
                    to[2 * i] += along[i];
                    to[2 * i + 1] += 0.5f * (along[i] + along[i + 1]);
                }
                if (nx % 2 == 1) {
                    to[nx - 1] += along[nx / 2];
                }
            }
        }
    });
}

} // namespace hybmss
