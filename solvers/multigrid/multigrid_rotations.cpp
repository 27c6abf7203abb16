// The rotations of cells around every cell that a stiff volume couples: what they cost, and its inverse.
#include "solvers/multigrid/bounded_inverse.hpp"
#include "solvers/multigrid/cell_corners.hpp"
#include "solvers/multigrid/multigrid.hpp"

namespace hybmss {
namespace {

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

template <class T>
void Multigrid<T>::find_rest_rotations() {
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

template <class T>
void Multigrid<T>::find_rotations(const Potential<T>& potential) {
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

template void Multigrid<float>::find_rest_rotations();
template void Multigrid<double>::find_rest_rotations();
template void Multigrid<float>::find_rotations(const Potential<float>&);
template void Multigrid<double>::find_rotations(const Potential<double>&);

} // namespace hybmss
