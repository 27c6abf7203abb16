#include "simulation/geometry/cells.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace hybmss {
namespace {

/// Filled cells begin <= i < end of one row along x; `parent` leads towards the first run of its part.
struct Run {
    int begin, end;
    std::size_t parent;
};

std::size_t root_of(std::vector<Run>& runs, std::size_t run) {
    while (runs[run].parent != run) {
        runs[run].parent = runs[runs[run].parent].parent;
        run = runs[run].parent;
    }
    return run;
}

/// Joins the runs of two rows, given as ranges of run numbers, where they overlap.
void join(std::vector<Run>& runs, std::size_t a, std::size_t a_end, std::size_t b, std::size_t b_end) {
    while (a < a_end && b < b_end) {
        if (runs[a].begin < runs[b].end && runs[b].begin < runs[a].end) {
            const std::size_t root_a = root_of(runs, a), root_b = root_of(runs, b);
            runs[std::max(root_a, root_b)].parent = std::min(root_a, root_b);
        }
        ++(runs[a].end < runs[b].end ? a : b);
    }
}

} // namespace

double volume_ratio_minus_one(std::span<const std::array<double, 3>> displacement,
                              const std::array<std::uint32_t, 8>& corners, double cell_size) {
    double H[3][3] = {}; // H[i][j] = d u_i / d X_j
    for (std::size_t corner = 0; corner < 8; ++corner) {
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                const double u = displacement[corners[corner]][i] / (4 * cell_size);
                H[i][j] += corner >> j & 1 ? u : -u;
            }
        }
    }
    const double trace = H[0][0] + H[1][1] + H[2][2];
    const double second = H[0][0] * H[1][1] - H[0][1] * H[1][0] + H[1][1] * H[2][2] - H[1][2] * H[2][1] +
                          H[2][2] * H[0][0] - H[2][0] * H[0][2];
    const double determinant = H[0][0] * (H[1][1] * H[2][2] - H[1][2] * H[2][1]) -
                               H[0][1] * (H[1][0] * H[2][2] - H[1][2] * H[2][0]) +
                               H[0][2] * (H[1][0] * H[2][1] - H[1][1] * H[2][0]);
    return trace + second + determinant;
}

VolumeChange measure_volume_change(std::span<const std::array<double, 3>> displacement,
                                   std::span<const std::array<std::uint32_t, 8>> cells, double cell_size,
                                   std::span<const float> fills) {
    double sum = 0, volume = 0, low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t n = 0; n < cells.size(); ++n) {
        const double change = volume_ratio_minus_one(displacement, cells[n], cell_size);
        const double fill = fills.empty() ? 1.0 : static_cast<double>(fills[n]);
        sum += fill * change;
        volume += fill;
        low = std::min(low, change);
        high = std::max(high, change);
    }
    if (cells.empty()) {
        return {};
    }
    return {std::abs(sum) / volume, 1 + low, 1 + high};
}

std::vector<std::size_t> cell_parts(const Lattice& lattice) {
    const auto [nx, ny, nz] = lattice.cells();
    const auto rows_a_layer = static_cast<std::size_t>(ny);
    std::vector<Run> runs;
    std::vector<std::size_t> first = {0}; // of each row's runs, and one past the last row's
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                if (!(lattice.cell_scale(i, j, k) > 0)) {
                    continue;
                }
                const int begin = i;
                while (i < nx && lattice.cell_scale(i, j, k) > 0) {
                    ++i;
                }
                runs.push_back({begin, i, runs.size()});
            }
            first.push_back(runs.size());
            const std::size_t row = first.size() - 2;
            if (j > 0) {
                join(runs, first[row - 1], first[row], first[row], first[row + 1]);
            }
            if (k > 0) {
                const std::size_t below = row - rows_a_layer;
                join(runs, first[below], first[below + 1], first[row], first[row + 1]);
            }
        }
    }
    std::vector<std::size_t> cells(runs.size(), 0);
    for (std::size_t run = 0; run < runs.size(); ++run) {
        cells[root_of(runs, run)] += static_cast<std::size_t>(runs[run].end - runs[run].begin);
    }
    std::erase(cells, 0u);
    std::sort(cells.begin(), cells.end(), std::greater<>());
    return cells;
}

} // namespace hybmss
