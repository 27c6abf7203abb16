#include "solvers/multigrid/cell_patterns.hpp"

#include <algorithm>

namespace hybmss {
namespace {

using CornerMatrix = std::array<std::array<float, 8>, 8>; ///< over corners

/// The same term with rows and columns exchanged: V_ef^T = V_fe, likewise G_ik.
std::size_t transposed(std::size_t term) {
    for (const std::size_t first : {CellPattern::kVolume, CellPattern::kPatterns}) {
        if (term >= first && term < first + 9) {
            const std::size_t e = term - first;
            return first + 3 * (e % 3) + e / 3;
        }
    }
    return term;
}

CornerMatrix unfolded(const CellPattern& pattern, std::size_t term) {
    CornerMatrix matrix;
    for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
        matrix[a][b] = pattern.factor[pair][term];
        matrix[b][a] = pattern.factor[pair][transposed(term)];
    });
    return matrix;
}

/// spread_half() of one number a block.
void spread(CornerMatrix& matrix, std::size_t axis, bool high) {
    const std::size_t bit = std::size_t{1} << axis;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        if (corner & bit) {
            continue;
        }
        const std::size_t from = high ? corner : corner | bit, keep = from ^ bit;
        for (std::size_t i = 0; i < 8; ++i) {
            matrix[from][i] *= 0.5f;
            matrix[keep][i] += matrix[from][i];
        }
        for (std::size_t i = 0; i < 8; ++i) {
            matrix[i][from] *= 0.5f;
            matrix[i][keep] += matrix[i][from];
        }
    }
}

float side(std::size_t corner, std::size_t axis) {
    return corner >> axis & 1 ? 1.0f : -1.0f;
}
/// Of a corner in g_1, g_2, g_3 (PatternConstants).
float pattern_weight(std::size_t corner, std::size_t i) {
    return side(corner, (i + 1) % 3) * side(corner, (i + 2) % 3) / 8;
}

} // namespace

void TangentRow::set(std::size_t first, const CellTangents& tangents, const Lanes& pull_of_cells) {
    has_volume = (first > 0 && has_volume) || tangents.has_volume;
    has_patterns = tangents.has_patterns;
    for (std::size_t d = 0; d < kSpringDirections; ++d) {
        for (std::size_t e = 0; e < 6; ++e) {
            store_lanes_at(tangents.spring[d][e], springs[d][e] + first);
        }
    }
    for (std::size_t e = 0; e < 9; ++e) {
        store_lanes_at(tangents.area[e], areas[e] + first);
    }
    store_lanes_at(tangents.volume_stiffness, volume_stiffness + first);
    store_lanes_at(pull_of_cells, pull + first);
    for (std::size_t e = 0; has_patterns && e < 9; ++e) {
        for (std::size_t i = 0; i < 9; ++i) {
            store_lanes_at(tangents.patterns[e / 3][e % 3][i], patterns[e][i] + first);
        }
    }
    if (has_patterns) {
        store_lanes_at(tangents.fourth, fourth + first);
    }
}

void CellPattern::evaluate(const kernels::KernelTable<float>& table, const TangentRow& tangents, std::size_t count,
                           CellMatrices& matrices) const {
    const kernels::PatternedCells<float> cells{&factor[0][0],
                                               static_cast<int>(kTerms),
                                               &tangents.springs[0][0][0],
                                               &tangents.areas[0][0],
                                               tangents.volume_stiffness,
                                               tangents.pull,
                                               &tangents.patterns[0][0][0],
                                               tangents.fourth,
                                               &matrices.block[0][0][0]};
    table.patterned_cells(tangents.has_volume, tangents.has_patterns)(cells, static_cast<kernels::Range>(count));
}

CellPatterns::CellPatterns(bool on_means) : on_means_(on_means), patterns_(1) {
    std::fill_n(&patterns_[0].factor[0][0], kCornerPairs * CellPattern::kTerms, 0.0f);
}

int CellPatterns::cell(unsigned held_corners) {
    const auto [entry, fresh] = numbers_.try_emplace({-1, static_cast<int>(held_corners)}, 0);
    if (!fresh) {
        return entry->second;
    }
    entry->second = static_cast<int>(patterns_.size());
    CellPattern& pattern = patterns_.emplace_back(patterns_[kVoid]);
    const auto free = [&](std::size_t corner) { return held_corners >> corner & 1u ? 0.0f : 1.0f; };
    for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
        const float both = free(a) * free(b);
        float(&factor)[CellPattern::kTerms] = pattern.factor[pair];
        for (std::size_t c = 0; c < 8; ++c) {
            if (a == b && c != a && !on_means_) {
                factor[spring_direction(a, c)] += both;
            }
        }
        if (a != b && !on_means_) {
            factor[spring_direction(a, b)] = -both;
        }
        for (std::size_t d = 0; on_means_ && d < kSpringDirections; ++d) {
            const std::array<float, 3> signs = spring_signs(d);
            const auto weight = [&](std::size_t corner) {
                return (signs[0] * side(corner, 0) + signs[1] * side(corner, 1) + signs[2] * side(corner, 2)) / 4;
            };
            factor[d] = both * weight(a) * weight(b);
        }
        for (std::size_t e = 0; on_means_ && e < 9; ++e) {
            factor[CellPattern::kPatterns + e] = both * pattern_weight(a, e / 3) * pattern_weight(b, e % 3);
        }
        if (on_means_) {
            const auto fourth = [](std::size_t corner) { return side(corner, 0) * pattern_weight(corner, 0); };
            factor[CellPattern::kFourth] = both * fourth(a) * fourth(b);
        }
        for (std::size_t e = 0; e < 9; ++e) {
            factor[CellPattern::kVolume + e] = both * side(a, e / 3) * side(b, e % 3) / 16;
        }
        factor[CellPattern::kPull] = a == b ? both : 0;
    });
    return entry->second;
}

int CellPatterns::merged(unsigned axes, const std::array<int, 8>& cells) {
    // A body without order has a pattern a cell, each larger than that cell's matrix.
    constexpr std::size_t kMost = 400;
    if (std::all_of(cells.begin(), cells.end(), [](int c) { return c == kVoid; })) {
        return kVoid;
    }
    if (std::any_of(cells.begin(), cells.end(), [](int c) { return c == kNone; })) {
        return kNone;
    }
    std::array<int, 9> key;
    key[0] = static_cast<int>(axes);
    std::copy(cells.begin(), cells.end(), key.begin() + 1);
    if (const auto found = numbers_.find(key); found != numbers_.end()) {
        return found->second;
    }
    if (patterns_.size() == kMost) {
        return kNone;
    }
    CellPattern pattern = patterns_[kVoid];
    for (std::size_t term = 0; term < CellPattern::kTerms; ++term) {
        CornerMatrix sum{};
        for (std::size_t cell = 0; cell < 8; ++cell) {
            if (cells[cell] == kVoid) {
                continue;
            }
            CornerMatrix matrix = unfolded((*this)[cells[cell]], term);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (axes >> axis & 1u) {
                    spread(matrix, axis, cell >> axis & 1);
                }
            }
            for (std::size_t a = 0; a < 8; ++a) {
                for (std::size_t b = 0; b < 8; ++b) {
                    sum[a][b] += matrix[a][b];
                }
            }
        }
        for_each_corner_pair(
            [&](std::size_t pair, std::size_t a, std::size_t b) { pattern.factor[pair][term] = sum[a][b]; });
    }
    patterns_.push_back(pattern);
    return numbers_[key] = static_cast<int>(patterns_.size()) - 1;
}

} // namespace hybmss
