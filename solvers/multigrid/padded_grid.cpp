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

// Axis after axis, so that what lies across an edge or a corner gets there; of a face both ranks add up what they have
// of the cells on its two sides.
void SharedGrid::give_back(std::array<std::vector<float>, 6>& cells) const {
    const Ranks& ranks = border_.ranks();
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t across = a == 0 ? 1 : a == 1 ? grid_.row() : grid_.plane();
        Ranks::Faces faces;
        std::vector<std::array<std::size_t, 2>> sides; ///< of a place on a face: the low and the high cell
        for (std::size_t high = 0; high < 2; ++high) {
            std::array<int, 3> first = {-1, -1, -1}, last = grid_.cells;
            first[a] = last[a] = high == 0 ? -1 : grid_.cells[a] - 1;
            for_each_place(first, last, [&](int i, int j, int k) {
                if (ranks.box().meets[a][high]) {
                    faces[a][high].push_back(static_cast<std::uint32_t>(sides.size()));
                    sides.push_back({grid_.index(i, j, k), grid_.index(i, j, k) + across});
                }
            });
        }
        std::vector<double> own(12 * sides.size());
        for (std::size_t n = 0; n < own.size(); ++n) {
            own[n] = static_cast<double>(cells[n % 6][sides[n / 12][n / 6 % 2]]);
        }
        std::vector<double> all = own;
        ranks.add_up(faces, 12, all);
        for (std::size_t high = 0; high < 2; ++high) {
            for (const std::uint32_t place : faces[a][high]) {
                for (std::size_t e = 0; e < 6; ++e) {
                    const std::size_t inside = 12 * place + 6 * (1 - high) + e;
                    float& value = cells[e][sides[place][1 - high]];
                    value = static_cast<float>(static_cast<double>(value) + (all[inside] - own[inside]));
                    cells[e][sides[place][high]] = 0;
                }
            }
        }
    }
}

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
