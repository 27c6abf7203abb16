// The matrices that a linearisation gives: of every coarse cell the sum of the cells that it holds, each spread over
// its corners; and, where the volume is stiff, what the rotations of the cells around every cell cost, and its inverse.
#include "solvers/multigrid/multigrid.hpp"

#include <Eigen/Dense>

namespace hybmss {
namespace {

/// s = -1 or +1 an axis: where corner lies as seen from the cell's middle, in half edges.
void corner_signs(std::size_t corner, float (&s)[3]) {
    for (std::size_t c = 0; c < 3; ++c) {
        s[c] = corner >> c & 1 ? 1.0f : -1.0f;
    }
}

/// The corner of the cell shifted by d that is corner a of the cell itself, or 8 where they do not share it.
std::size_t shared_corner(std::size_t a, const int (&d)[3]) {
    std::size_t corner = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const int at = static_cast<int>(a >> c & 1) - d[c];
        if (at < 0 || at > 1) {
            return 8;
        }
        corner |= static_cast<std::size_t>(at) << c;
    }
    return corner;
}

} // namespace

void Multigrid::find_patterns(std::span<const std::uint8_t> held) {
    held_.assign(held.begin(), held.end());
    const auto& [nx, ny, nz] = grid_.cells;
    Cells& finest = cells_.front();
    finest.pattern.assign(scales_.size(), CellPatterns::kVoid);
    finest.scale = scales_;
    finest.tissue = tissues_;
    std::size_t n = 0;
    for_each_place({0, 0, 0}, {nx - 1, ny - 1, nz - 1}, [&](int i, int j, int k) {
        const std::size_t cell = n++;
        if (!(scales_[cell] > 0)) {
            return;
        }
        unsigned along_all = 0, along_some = 0;
        for (std::size_t a = 0; a < 8; ++a) {
            const std::uint8_t axes = held[node_at_[grid_.index(i, j, k) + grid_.corner_offset(a)]];
            along_all |= (axes == 7 ? 1u : 0u) << a;
            along_some |= (axes != 0 && axes != 7 ? 1u : 0u) << a;
        }
        finest.pattern[cell] = along_some != 0 ? CellPatterns::kNone : patterns_.cell(along_all);
    });
    for (std::size_t l = 1; l < cells_.size(); ++l) {
        Cells &fine = cells_[l - 1], &coarse = cells_[l];
        const std::array<int, 3>&from = fine.gradients->grid().cells, &to = coarse.gradients->grid().cells;
        const auto index = [](const std::array<int, 3>& cells, int i, int j, int k) {
            return static_cast<std::size_t>(i) +
                   static_cast<std::size_t>(cells[0]) *
                       (static_cast<std::size_t>(j) + static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(k));
        };
        unsigned axes = 0;
        for (unsigned c = 0; c < 3; ++c) {
            axes |= (to[c] != from[c] ? 1u : 0u) << c;
        }
        coarse.pattern.clear();
        coarse.scale.clear();
        coarse.tissue.clear();
        std::int32_t kept = 0;
        fine.kept.assign(fine.pattern.size(), -1);
        for_each_place({0, 0, 0}, {to[0] - 1, to[1] - 1, to[2] - 1}, [&](int ci, int cj, int ck) {
            std::array<int, 8> patterns;
            std::array<std::size_t, 8> at;
            float scale = 0;
            std::uint8_t tissue = 0;
            bool alike = true;
            for (unsigned half = 0; half < 8; ++half) {
                const auto place = [&](unsigned c, int coarse_place) {
                    const int high = half >> c & 1u ? 1 : 0;
                    return axes >> c & 1u ? 2 * coarse_place + high : high == 0 ? coarse_place : from[c];
                };
                const int i = place(0, ci), j = place(1, cj), k = place(2, ck);
                patterns[half] = CellPatterns::kVoid;
                if (i < from[0] && j < from[1] && k < from[2]) {
                    at[half] = index(from, i, j, k);
                    patterns[half] = fine.pattern[at[half]];
                }
                if (patterns[half] != CellPatterns::kVoid) {
                    const float own = fine.scale[at[half]];
                    alike = alike && (scale == 0 || (scale == own && tissue == fine.tissue[at[half]]));
                    scale = own;
                    tissue = fine.tissue[at[half]];
                }
            }
            const bool any =
                std::any_of(patterns.begin(), patterns.end(), [](int p) { return p != CellPatterns::kVoid; });
            const int pattern = any && !alike ? CellPatterns::kNone : patterns_.merged(axes, patterns);
            coarse.pattern.push_back(pattern);
            coarse.scale.push_back(scale);
            coarse.tissue.push_back(tissue);
            coarse.gradients->present()[coarse.gradients->grid().index(ci, cj, ck)] = any;
            for (std::size_t half = 0; half < 8; ++half) {
                if (pattern == CellPatterns::kNone && patterns[half] != CellPatterns::kVoid) {
                    fine.kept[at[half]] = kept++;
                }
            }
        });
        if (l > 1) { // the finest cells' matrices are made where they are merged
            fine.matrices.resize(static_cast<std::size_t>(kept));
        }
        fine.scale.resize(fine.scale.size() + kLanes);
        fine.tissue.resize(fine.tissue.size() + kLanes);
    }
    cells_.back().kept.assign(cells_.back().pattern.size(), -1);
    cells_.back().scale.resize(cells_.back().scale.size() + kLanes);
    cells_.back().tissue.resize(cells_.back().tissue.size() + kLanes);
}

void Multigrid::find_gradients(const Potential<float>& potential) {
    gather(potential.displacement(), grid_in_);
    gradients_.take(grid_in_, unit_, *workers_);
    for (std::size_t l = 1; l < cells_.size(); ++l) {
        cells_[l].gradients->merge(*cells_[l - 1].gradients);
    }
}

// Interpolated from level to level along straight lines, a fine node is so from each level at once.
void Multigrid::find_touches(const Potential<float>& potential) {
    touches_.clear();
    if (potential.touched().empty()) {
        return;
    }
    for (const Cells& cells : cells_) {
        touches_.emplace_back(static_cast<std::size_t>(cells.gradients->grid().cells[2]));
    }
    std::vector<std::array<int, 3>> grid_place(places_.size());
    for_each_place({0, 0, 0}, grid_.cells, [&](int i, int j, int k) {
        if (const std::uint32_t node = node_at_[grid_.index(i, j, k)]; node != kNoNode) {
            grid_place[node] = {i, j, k};
        }
    });
    for (const TouchedNode& touched : potential.touched()) {
        const std::uint8_t held = potential.held()[touched.node];
        const Symmetric& b = touched.along;
        Touch touch{0, 0, {}, {}};
        const double block[9] = {b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5]};
        for (std::size_t e = 0; e < 9; ++e) {
            touch.block[e] = held >> (e / 3) & 1 || held >> (e % 3) & 1 ? 0.0f : static_cast<float>(block[e]);
        }
        float place[3];
        std::copy_n(grid_place[touched.node].begin(), 3, place);
        for (std::size_t l = 1; l < cells_.size(); ++l) {
            const std::array<int, 3>&fine = cells_[l - 1].gradients->grid().cells,
                                  &cells = cells_[l].gradients->grid().cells;
            int cell[3];
            touch.weight.fill(1);
            for (std::size_t a = 0; a < 3; ++a) {
                place[a] *= fine[a] != cells[a] ? 0.5f : 1.0f;
                cell[a] = std::min(static_cast<int>(place[a]), cells[a] - 1);
                const float part = place[a] - static_cast<float>(cell[a]);
                for (std::size_t corner = 0; corner < 8; ++corner) {
                    touch.weight[corner] *= corner >> a & 1 ? part : 1 - part;
                }
            }
            touch.i = cell[0], touch.j = cell[1];
            touches_[l][static_cast<std::size_t>(cell[2])].push_back(touch);
        }
    }
}

template <class Add>
void Multigrid::add_layer(std::size_t level, int k, const Potential<float>& potential, const Add& add) {
    Cells& cells = cells_[level];
    const PaddedGrid& grid = cells.gradients->grid();
    const auto row = static_cast<std::size_t>(grid.cells[0]), rows = static_cast<std::size_t>(grid.cells[1]);
    const std::span<const double> pulls = potential.pull_stiffness();
    // The same for every cell of a tissue at every corner: masses follow the cells' number. (Cells that are cut are
    // seldom all alike where they are merged; those that are count as whole.)
    const float pull = pulls.empty() ? 0.0f : static_cast<float>(pulls[0]) / touching_[0];
    const kernels::KernelTable<float>& table = body_->kernel_table();
    CellTangents tangents;
    TangentRow together{};
    CellMatrices matrices;
    CellMatrix one;
    for (std::size_t j = 0; j < rows; ++j) {
        const std::size_t first = row * (j + rows * static_cast<std::size_t>(k));
        const int y = static_cast<int>(j);
        std::size_t count = 1;
        for (std::size_t i = 0; i < row; i += count) {
            const int pattern = cells.pattern[first + i], x = static_cast<int>(i);
            count = 1;
            if (pattern == CellPatterns::kVoid) {
                continue;
            }
            if (pattern == CellPatterns::kNone) {
                merge(level, x, y, k, potential, one);
                for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
                    for (std::size_t e = 0; e < 9; ++e) {
                        matrices.block[pair][e][0] = one.block[a][b][e];
                    }
                });
            } else {
                while (count < kCellsTogether && i + count < row && cells.pattern[first + i + count] == pattern) {
                    ++count;
                }
                // Lanes behind the last are of cells that nobody takes.
                for (std::size_t few = 0; few < count; few += kLanes) {
                    const std::size_t cell = first + i + few;
                    Lanes gradient[9];
                    for (std::size_t e = 0; e < 9; ++e) {
                        gradient[e] = load_lanes_at(cells.gradients->entries()[e].data() + grid.index(x, y, k) + few);
                    }
                    const std::uint8_t* tissue = cells.tissue.data() + cell;
                    Lanes pull_of_cells;
                    for (std::size_t lane = 0; lane < kLanes; ++lane) {
                        pull_of_cells[lane] = pull * stiffness_.density(tissue[lane]);
                    }
                    stiffness_.evaluate(gradient, load_lanes_at(cells.scale.data() + cell), tissue, tangents);
                    together.set(few, tangents, pull_of_cells);
                }
                patterns_[pattern].evaluate(table, together, count, matrices);
            }
            for (std::size_t lane = 0; lane < count; ++lane) {
                if (const std::int32_t kept = cells.kept[first + i + lane]; kept >= 0) {
                    CellMatrix& matrix = cells.matrices[static_cast<std::size_t>(kept)];
                    for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
                        for (std::size_t e = 0; e < 9; ++e) {
                            matrix.block[a][b][e] = matrices.block[pair][e][lane];
                            matrix.block[b][a][3 * (e % 3) + e / 3] = matrices.block[pair][e][lane];
                        }
                    });
                }
            }
            add(x, y, matrices, count);
        }
    }
    if (touches_.empty()) {
        return;
    }
    for (const Touch& touch : touches_[level][static_cast<std::size_t>(k)]) {
        for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
            for (std::size_t e = 0; e < 9; ++e) {
                matrices.block[pair][e][0] = touch.weight[a] * touch.weight[b] * touch.block[e];
            }
        });
        add(touch.i, touch.j, matrices, 1);
    }
}

void Multigrid::assemble(const Potential<float>& potential) {
    for (std::size_t l = 1; l < cells_.size(); ++l) {
        const auto layer = [&](int k, const auto& add) { add_layer(l, k, potential, add); };
        if (l <= levels_.size()) {
            levels_[l - 1]->assemble(layer);
        } else {
            direct_->assemble(layer);
        }
    }
}

bool Multigrid::finest_matrix(int i, int j, int k, const Potential<float>& potential, CellMatrix& matrix) const {
    const NodeField<float>& u = potential.displacement();
    const Component<const float> component_of[3] = {component(u, 0), component(u, 1), component(u, 2)};
    const std::span<const double> pull = potential.pull_stiffness();
    const auto cell =
        static_cast<std::size_t>(i) +
        static_cast<std::size_t>(grid_.cells[0]) *
            (static_cast<std::size_t>(j) + static_cast<std::size_t>(grid_.cells[1]) * static_cast<std::size_t>(k));
    if (!(scales_[cell] > 0)) {
        return false;
    }
    double displacement[8][3];
    std::uint32_t node[8];
    for (std::size_t a = 0; a < 8; ++a) {
        node[a] = node_at_[grid_.index(i, j, k) + grid_.corner_offset(a)];
        const auto place = static_cast<std::ptrdiff_t>(places_[node[a]]);
        for (std::size_t c = 0; c < 3; ++c) {
            displacement[a][c] = unit_ * static_cast<double>(component_of[c].first[place * component_of[c].stride]);
        }
    }
    stiffness_.evaluate(displacement, static_cast<double>(scales_[cell]), tissues_[cell], matrix);
    for (std::size_t a = 0; a < 8; ++a) {
        if (!pull.empty()) {
            const auto share = static_cast<float>(pull[node[a]]) / touching_[node[a]] * mass_of(cell);
            for (const std::size_t e : {0u, 4u, 8u}) {
                matrix.block[a][a][e] += share;
            }
        }
        for (std::size_t c = 0; held_[node[a]] != 0 && c < 3; ++c) {
            if (held_[node[a]] >> c & 1) {
                for (std::size_t b = 0; b < 8; ++b) {
                    for (std::size_t e = 0; e < 3; ++e) {
                        matrix.block[a][b][3 * c + e] = 0;
                        matrix.block[b][a][3 * e + c] = 0;
                    }
                }
            }
        }
    }
    return true;
}

void Multigrid::merge(std::size_t level, int ci, int cj, int ck, const Potential<float>& potential,
                      CellMatrix& sum) const {
    const Cells& fine = cells_[level - 1];
    const std::array<int, 3>&cells = fine.gradients->grid().cells, &coarse = cells_[level].gradients->grid().cells;
    const int merged[3] = {coarse[0] != cells[0], coarse[1] != cells[1], coarse[2] != cells[2]};
    const auto evaluate = [&](int i, int j, int k, CellMatrix& matrix) {
        if (i >= cells[0] || j >= cells[1] || k >= cells[2]) {
            return false;
        }
        if (level == 1) {
            return finest_matrix(i, j, k, potential, matrix);
        }
        const std::int32_t kept = fine.kept[static_cast<std::size_t>(i) +
                                            static_cast<std::size_t>(cells[0]) *
                                                (static_cast<std::size_t>(j) +
                                                 static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(k))];
        if (kept >= 0) {
            matrix = fine.matrices[static_cast<std::size_t>(kept)];
        }
        return kept >= 0;
    };
    CellMatrix one, pair, quad;
    sum = {};
    for (int z = 0; z <= merged[2]; ++z) {
        quad = {};
        for (int y = 0; y <= merged[1]; ++y) {
            pair = {};
            for (int x = 0; x <= merged[0]; ++x) {
                if (evaluate((1 + merged[0]) * ci + x, (1 + merged[1]) * cj + y, (1 + merged[2]) * ck + z, one)) {
                    if (merged[0]) {
                        spread_half(one, 0, x == 1);
                    }
                    add(one, pair);
                }
            }
            if (merged[1]) {
                spread_half(pair, 1, y == 1);
            }
            add(pair, quad);
        }
        if (merged[2]) {
            spread_half(quad, 2, z == 1);
        }
        add(quad, sum);
    }
}

void Multigrid::find_rest_rotations() {
    CellMatrix rest;
    stiffness_.springs_at_rest(rest);
    for_each_place({-1, -1, -1}, {1, 1, 1}, [&](int i, int j, int k) {
        const int d[3] = {i, j, k};
        Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
        const auto turn = [](std::size_t corner) {
            float s[3];
            corner_signs(corner, s);
            Eigen::Matrix3f m;
            m << 0, s[2], -s[1], -s[2], 0, s[0], s[1], -s[0], 0;
            return m;
        };
        for (std::size_t a = 0; a < 8; ++a) {
            for (std::size_t b = 0; b < 8; ++b) {
                const std::size_t p = shared_corner(a, d), q = shared_corner(b, d);
                if (p < 8 && q < 8) {
                    const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> block(rest.block[p][q]);
                    sum += turn(a).transpose() * block * turn(b);
                }
            }
        }
        rest_rotation_.push_back({sum(0, 0), sum(0, 1), sum(0, 2), sum(1, 1), sum(1, 2), sum(2, 2)});
    });
}

// For each cell around, how far turning this one changes its volume: sum over shared corners a of s_a x (F^T g_a), g_a
// that cell's dV'/dx_a on free components, which grid_in_ tells.
void Multigrid::find_rotations() {
    constexpr double kSoftestTurn = 1e-5;
    gradients_.spread();
    const std::size_t row = grid_.row(), plane = grid_.plane();
    // Of cells beyond the border too, which have none.
    const std::size_t margin = plane + row + 1, size = grid_.size() + 2 * margin + kLanes;
    std::array<std::vector<float>, 9> areas;
    for (auto& entries : areas) {
        entries.resize(size);
    }
    std::vector<float> volume_stiffness(size), scale(size);
    const std::vector<float>& scales = cells_.front().scale;
    workers_->run(static_cast<std::size_t>(grid_.cells[2]), [&](std::size_t layer, std::size_t) {
        const int k = static_cast<int>(layer);
        for (int j = 0; j < grid_.cells[1]; ++j) {
            const std::size_t at = grid_.index(0, j, k);
            const std::size_t first = static_cast<std::size_t>(grid_.cells[0]) *
                                      (static_cast<std::size_t>(j) + static_cast<std::size_t>(grid_.cells[1]) * layer);
            const auto length = static_cast<std::size_t>(grid_.cells[0]);
            for (std::size_t i = 0; i < length; i += kLanes) {
                Lanes F[9], area[9];
                for (std::size_t e = 0; e < 9; ++e) {
                    F[e] = load_lanes_at(gradients_.entries()[e].data() + at + i);
                }
                const Lanes own = load_lanes_at(scales.data() + first + i);
                const Lanes stiffness =
                    stiffness_.evaluate_volume(F, own, cells_.front().tissue.data() + first + i, area);
                for (std::size_t lane = 0; lane < std::min(kLanes, length - i); ++lane) {
                    const std::size_t place = margin + at + i + lane;
                    scale[place] = own[lane];
                    volume_stiffness[place] = stiffness[lane];
                    for (std::size_t e = 0; e < 9; ++e) {
                        areas[e][place] = area[e][lane];
                    }
                }
            }
        }
    });
    workers_->run(static_cast<std::size_t>(grid_.cells[2] + 2), [&](std::size_t layer, std::size_t) {
        for_each_lanes(grid_, static_cast<int>(layer) - 1, [&](std::size_t cell, std::size_t count) {
            Lanes F[9];
            for (std::size_t e = 0; e < 9; ++e) {
                F[e] = load_lanes_at(gradients_.entries()[e].data() + cell);
            }
            Lanes moment[27][3] = {};
            for (std::size_t a = 0; a < 8; ++a) {
                float s[3];
                corner_signs(a, s);
                Lanes free[3];
                for (std::size_t c = 0; c < 3; ++c) {
                    free[c] = 0.25f * load_lanes_at(grid_in_.c[c].data() + cell + grid_.corner_offset(a));
                }
                for (std::size_t corner = 0; corner < 8; ++corner) {
                    // The cell whose corner this is.
                    const std::size_t place = margin + cell + grid_.corner_offset(a) - grid_.corner_offset(corner);
                    float t[3];
                    corner_signs(corner, t);
                    Lanes q[3] = {};
                    for (std::size_t c = 0; c < 3; ++c) {
                        const Lanes g = free[c] * (t[0] * load_lanes_at(areas[c].data() + place) +
                                                   t[1] * load_lanes_at(areas[3 + c].data() + place) +
                                                   t[2] * load_lanes_at(areas[6 + c].data() + place));
                        for (std::size_t e = 0; e < 3; ++e) {
                            q[e] += F[3 * c + e] * g;
                        }
                    }
                    const auto step = [&](std::size_t axis) { return 1 + (a >> axis & 1) - (corner >> axis & 1); };
                    Lanes(&m)[3] = moment[step(0) + 3 * (step(1) + 3 * step(2))];
                    m[0] += s[1] * q[2] - s[2] * q[1];
                    m[1] += s[2] * q[0] - s[0] * q[2];
                    m[2] += s[0] * q[1] - s[1] * q[0];
                }
            }
            Lanes sum[6] = {};
            for (std::size_t way = 0; way < 27; ++way) {
                const std::size_t place = cell + way % 3 + row * (way / 3 % 3) + plane * (way / 9); // less the margin
                const Lanes own = load_lanes_at(scale.data() + place),
                            c = load_lanes_at(volume_stiffness.data() + place);
                std::size_t entry = 0;
                for (std::size_t p = 0; p < 3; ++p) {
                    for (std::size_t q = p; q < 3; ++q, ++entry) {
                        sum[entry] += own * rest_rotation_[way][entry] + c * moment[way][p] * moment[way][q];
                    }
                }
            }
            rotations_->invert(cell, count, sum, kSoftestTurn);
        });
    });
    rotations_->finish(kSoftestTurn);
}

} // namespace hybmss
