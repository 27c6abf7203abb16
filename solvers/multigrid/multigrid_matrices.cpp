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

/// The part of cell c's displacement component (F (w x s))_a by which corner s turns: s x (F^T g).
void add_moment(const float (&F)[9], const float (&s)[3], const float (&g)[3], float (&moment)[3]) {
    float q[3];
    for (std::size_t c = 0; c < 3; ++c) {
        q[c] = F[c] * g[0] + F[3 + c] * g[1] + F[6 + c] * g[2];
    }
    moment[0] += s[1] * q[2] - s[2] * q[1];
    moment[1] += s[2] * q[0] - s[0] * q[2];
    moment[2] += s[0] * q[1] - s[1] * q[0];
}

} // namespace

void Multigrid::merge_finest(const Potential<float>& potential) {
    const PaddedGrid& coarse = levels_.empty() ? direct_->grid() : levels_[0]->grid();
    const std::array<int, 3>& cells = grid_.cells;
    const auto count = [](const PaddedGrid& grid) {
        return static_cast<std::size_t>(grid.cells[0]) * static_cast<std::size_t>(grid.cells[1]) *
               static_cast<std::size_t>(grid.cells[2]);
    };
    merged_.resize(count(coarse));
    const NodeField<float>& u = potential.displacement();
    const Component<const float> component_of[3] = {component(u, 0), component(u, 1), component(u, 2)};
    const std::span<const double> pull = potential.pull_stiffness();
    const std::span<const std::uint8_t> held = potential.held();
    const int merged[3] = {coarse.cells[0] != cells[0], coarse.cells[1] != cells[1], coarse.cells[2] != cells[2]};

    const auto evaluate = [&](int i, int j, int k, CellMatrix& matrix) {
        const auto cell =
            static_cast<std::size_t>(i) +
            static_cast<std::size_t>(cells[0]) *
                (static_cast<std::size_t>(j) + static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(k));
        if (!(scales_[cell] > 0)) {
            return false;
        }
        const std::size_t low = grid_.index(i, j, k);
        double displacement[8][3];
        std::uint32_t node[8];
        for (std::size_t a = 0; a < 8; ++a) {
            node[a] = node_at_[low + grid_.corner_offset(a)];
            const auto place = static_cast<std::ptrdiff_t>(places_[node[a]]);
            for (std::size_t c = 0; c < 3; ++c) {
                displacement[a][c] = unit_ * static_cast<double>(component_of[c].first[place * component_of[c].stride]);
            }
        }
        CellShape shape;
        stiffness_.evaluate(displacement, static_cast<double>(scales_[cell]), matrix, shape);
        for (std::size_t a = 0; a < 8; ++a) {
            if (!pull.empty()) {
                const auto share = static_cast<float>(pull[node[a]]) / touching_[node[a]];
                for (const std::size_t e : {0u, 4u, 8u}) {
                    matrix.block[a][a][e] += share;
                }
            }
            for (std::size_t c = 0; held[node[a]] != 0 && c < 3; ++c) {
                if (held[node[a]] >> c & 1) {
                    for (std::size_t b = 0; b < 8; ++b) {
                        for (std::size_t e = 0; e < 3; ++e) {
                            matrix.block[a][b][3 * c + e] = 0;
                            matrix.block[b][a][3 * e + c] = 0;
                        }
                    }
                }
            }
        }
        if (rotations_) {
            shapes_[cell] = shape;
            rotations_->present()[low] = 1;
            for (std::size_t e = 0; e < 9; ++e) {
                rotations_->gradient()[e][low] = shape.gradient[e];
            }
        }
        return true;
    };
    workers_->run(static_cast<std::size_t>(coarse.cells[2]), [&](std::size_t layer, std::size_t) {
        const int ck = static_cast<int>(layer);
        std::size_t n = layer * static_cast<std::size_t>(coarse.cells[0]) * static_cast<std::size_t>(coarse.cells[1]);
        CellMatrix one, pair, quad;
        for_each_place({0, 0, ck}, {coarse.cells[0] - 1, coarse.cells[1] - 1, ck}, [&](int ci, int cj, int) {
            CellMatrix& sum = merged_[n++];
            sum = {};
            for (int z = 0; z <= merged[2]; ++z) {
                quad = {};
                for (int y = 0; y <= merged[1]; ++y) {
                    pair = {};
                    for (int x = 0; x <= merged[0]; ++x) {
                        const int i = (1 + merged[0]) * ci + x, j = (1 + merged[1]) * cj + y,
                                  k = (1 + merged[2]) * ck + z;
                        if (i < cells[0] && j < cells[1] && k < cells[2] && evaluate(i, j, k, one)) {
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
        });
    });
}

void Multigrid::merge(std::span<const CellMatrix> fine_cells, const PaddedGrid& fine, const PaddedGrid& coarse) {
    merged_next_.resize(static_cast<std::size_t>(coarse.cells[0]) * static_cast<std::size_t>(coarse.cells[1]) *
                        static_cast<std::size_t>(coarse.cells[2]));
    const int merged[3] = {coarse.cells[0] != fine.cells[0], coarse.cells[1] != fine.cells[1],
                           coarse.cells[2] != fine.cells[2]};
    workers_->run(static_cast<std::size_t>(coarse.cells[2]), [&](std::size_t layer, std::size_t) {
        const int ck = static_cast<int>(layer);
        std::size_t n = layer * static_cast<std::size_t>(coarse.cells[0]) * static_cast<std::size_t>(coarse.cells[1]);
        CellMatrix one;
        for_each_place({0, 0, ck}, {coarse.cells[0] - 1, coarse.cells[1] - 1, ck}, [&](int ci, int cj, int) {
            CellMatrix& sum = merged_next_[n++];
            sum = {};
            for_each_place({0, 0, 0}, {merged[0], merged[1], merged[2]}, [&](int x, int y, int z) {
                const int i = (1 + merged[0]) * ci + x, j = (1 + merged[1]) * cj + y, k = (1 + merged[2]) * ck + z;
                if (i < fine.cells[0] && j < fine.cells[1] && k < fine.cells[2]) {
                    one = fine_cells[static_cast<std::size_t>(i) +
                                     static_cast<std::size_t>(fine.cells[0]) *
                                         (static_cast<std::size_t>(j) +
                                          static_cast<std::size_t>(fine.cells[1]) * static_cast<std::size_t>(k))];
                    const int half[3] = {x, y, z};
                    for (unsigned c = 0; c < 3; ++c) {
                        if (merged[c]) {
                            spread_half(one, c, half[c] == 1);
                        }
                    }
                    add(one, sum);
                }
            });
        });
    });
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
        auto& entry = rest_rotation_.emplace_back();
        for (std::size_t e = 0; e < 9; ++e) {
            entry[e] = sum(static_cast<int>(e / 3), static_cast<int>(e % 3));
        }
    });
}

void Multigrid::find_rotations(const Potential<float>& potential) {
    const std::array<int, 3>& cells = grid_.cells;
    const std::span<const std::uint8_t> held = potential.held();
    rotations_->spread();
    workers_->run(static_cast<std::size_t>(cells[2] + 2), [&](std::size_t layer, std::size_t) {
        const int k = static_cast<int>(layer) - 1;
        for_each_place({-1, -1, k}, {cells[0], cells[1], k}, [&](int i, int j, int) {
            const std::size_t low = grid_.index(i, j, k);
            float F[9], s[8][3];
            for (std::size_t e = 0; e < 9; ++e) {
                F[e] = rotations_->gradient()[e][low];
            }
            std::uint32_t node[8];
            for (std::size_t a = 0; a < 8; ++a) {
                corner_signs(a, s[a]);
                node[a] = node_at_[low + grid_.corner_offset(a)];
            }
            float sum[9] = {};
            std::size_t way = 0;
            for_each_place({-1, -1, -1}, {1, 1, 1}, [&](int x, int y, int z) {
                const std::array<float, 9>& rest = rest_rotation_[way++];
                const int at[3] = {i + x, j + y, k + z}, d[3] = {x, y, z};
                if (at[0] < 0 || at[1] < 0 || at[2] < 0 || at[0] >= cells[0] || at[1] >= cells[1] ||
                    at[2] >= cells[2]) {
                    return;
                }
                const auto cell = static_cast<std::size_t>(at[0]) +
                                  static_cast<std::size_t>(cells[0]) *
                                      (static_cast<std::size_t>(at[1]) +
                                       static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(at[2]));
                if (!(scales_[cell] > 0)) {
                    return;
                }
                const CellShape& shape = shapes_[cell];
                float moment[3] = {};
                for (std::size_t a = 0; a < 8; ++a) {
                    const std::size_t corner = shared_corner(a, d);
                    if (corner == 8) {
                        continue;
                    }
                    float t[3], g[3];
                    corner_signs(corner, t);
                    for (std::size_t c = 0; c < 3; ++c) {
                        g[c] = (t[0] * shape.area[c] + t[1] * shape.area[3 + c] + t[2] * shape.area[6 + c]) / 4;
                        if (held[node[a]] >> c & 1) {
                            g[c] = 0;
                        }
                    }
                    add_moment(F, s[a], g, moment);
                }
                for (std::size_t e = 0; e < 9; ++e) {
                    sum[e] += scales_[cell] * rest[e] + shape.volume_stiffness * moment[e / 3] * moment[e % 3];
                }
            });
            const auto entry = [&](std::size_t e) { return static_cast<double>(sum[e]); };
            const auto inverse =
                bounded_pseudoinverse({entry(0), entry(1), entry(2), entry(4), entry(5), entry(8)}, 1e-5);
            for (std::size_t e = 0; e < 6; ++e) {
                rotations_->inverse()[e][low] = static_cast<float>(inverse[e]);
            }
        });
    });
}

} // namespace hybmss
