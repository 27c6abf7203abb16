// The kernels of multigrid's cycles beside their formulas in plain loops, for every instruction set.

#include "kernels/grid_arguments.hpp"
#include "kernels/kernel_table.hpp"
#include "tests/random_bodies.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace hybmss {
namespace {

using kernels::BlockUse;
using kernels::kMaxWidth;
using kernels::Range;

template <class T>
class Grid : public ::testing::Test {
protected:
    std::vector<T> draw(std::size_t size) {
        std::vector<T> values(size);
        for (T& value : values) {
            value = static_cast<T>(random_.between(-1, 1));
        }
        return values;
    }
    template <std::size_t arrays>
    std::array<std::vector<T>, arrays> draw_arrays(std::size_t size) {
        std::array<std::vector<T>, arrays> all;
        for (auto& array : all) {
            array = draw(size);
        }
        return all;
    }
    /// Sums of so many products of numbers up to one, in units of rounding.
    static double near(double terms) { return terms * std::numeric_limits<T>::epsilon(); }

    testing::Random random_{5};
};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Grid, Reals);

TYPED_TEST(Grid, NodesBlocksTakeEveryTermOfASmoother) {
    using T = TypeParam;
    constexpr std::size_t kNodes = 3 * kMaxWidth;
    constexpr std::size_t kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (const InstructionSet set : available_instruction_sets()) {
        for (const BlockUse use : {BlockUse::multiply, BlockUse::first, BlockUse::restart, BlockUse::next}) {
            for (const bool pulled : {false, true}) {
                SCOPED_TRACE(std::string(name(set)) + " use " + std::to_string(static_cast<int>(use)));
                const auto inverse = this->template draw_arrays<6>(kNodes);
                const auto from = this->template draw_arrays<3>(kNodes),
                           product = this->template draw_arrays<3>(kNodes),
                           weight = this->template draw_arrays<3>(kNodes);
                auto rest = this->template draw_arrays<3>(kNodes), direction = this->template draw_arrays<3>(kNodes),
                     solution = this->template draw_arrays<3>(kNodes);
                if (use != BlockUse::next) { // may hold anything
                    direction[1].assign(kNodes, std::numeric_limits<T>::quiet_NaN());
                }
                const auto before_d = direction, before_x = solution, before_r = rest;
                kernels::NodeBlocks<T> nodes{};
                for (std::size_t e = 0; e < 6; ++e) {
                    nodes.inverse[e] = inverse[e].data();
                }
                for (std::size_t c = 0; c < 3; ++c) {
                    nodes.from[c] = from[c].data();
                    nodes.product[c] = product[c].data();
                    nodes.weight[c] = weight[c].data();
                    nodes.rest[c] = rest[c].data();
                    nodes.direction[c] = direction[c].data();
                    nodes.solution[c] = solution[c].data();
                }
                nodes.keep = T(0.7);
                nodes.add = T(1.3);
                const Range begin = kMaxWidth, end = 2 * kMaxWidth;
                kernels::kernel_table<T>(set).node_blocks(use, pulled)(nodes, begin, end);
                for (std::size_t n = 0; n < kNodes; ++n) {
                    const bool inside = n >= kMaxWidth && n < 2 * kMaxWidth;
                    double r[3];
                    for (std::size_t c = 0; c < 3; ++c) {
                        r[c] = from[c][n];
                        if (use == BlockUse::restart || use == BlockUse::next) {
                            const double of = use == BlockUse::next ? before_d[c][n] : before_x[c][n];
                            r[c] -= product[c][n] + (pulled ? weight[c][n] * of : 0);
                        }
                    }
                    for (std::size_t c = 0; c < 3; ++c) {
                        double z = 0;
                        for (std::size_t e = 0; e < 3; ++e) {
                            z += inverse[kEntry[c][e]][n] * r[e];
                        }
                        const double step =
                            static_cast<double>(nodes.add) * z +
                            (use == BlockUse::next ? static_cast<double>(nodes.keep) * before_d[c][n] : 0);
                        const double x = use == BlockUse::multiply ? z
                                         : use == BlockUse::first  ? step
                                                                   : before_x[c][n] + step;
                        EXPECT_NEAR(solution[c][n], inside ? x : before_x[c][n], this->near(40)) << n;
                        if (use != BlockUse::multiply) {
                            EXPECT_NEAR(rest[c][n], inside ? r[c] : before_r[c][n], this->near(8)) << n;
                            if (inside) {
                                EXPECT_NEAR(direction[c][n], step, this->near(40)) << n;
                            }
                        }
                    }
                }
            }
        }
    }
}

TYPED_TEST(Grid, StencilIsASymmetricMatrix) {
    using T = TypeParam;
    // 5 x 4 x 4 nodes with the border, of which those between the first and the last are asked for.
    constexpr std::ptrdiff_t kRow = 5, kPlane = 20, kSize = 80, kFirst = kPlane + kRow + 1, kLast = kSize - 1 - kFirst;
    const std::size_t stride = 112;
    for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(name(set));
        const std::vector<T> entries = this->draw(126 * stride);
        const auto in = this->template draw_arrays<3>(kSize + kMaxWidth),
                   from = this->template draw_arrays<3>(kSize + kMaxWidth);
        kernels::GridStencil<T> stencil{};
        stencil.entries = entries.data();
        stencil.stride = static_cast<std::ptrdiff_t>(stride);
        for (int way = 0; way < 13; ++way) {
            const int s = way + 14;
            stencil.ahead[way] = s % 3 - 1 + kRow * (s / 3 % 3 - 1) + kPlane * (s / 9 - 1);
        }
        for (const bool residual : {false, true}) {
            auto out = this->template draw_arrays<3>(kSize + kMaxWidth);
            const auto before = out;
            for (std::size_t c = 0; c < 3; ++c) {
                stencil.in[c] = in[c].data();
                stencil.from[c] = from[c].data();
                stencil.out[c] = out[c].data();
            }
            kernels::kernel_table<T>(set).grid_stencil(residual)(stencil, kFirst, kLast + 1);
            for (std::ptrdiff_t n = 0; n <= kLast; ++n) {
                for (std::size_t c = 0; c < 3; ++c) {
                    double sum = 0;
                    for (std::ptrdiff_t way = -13; way <= 13 && n >= kFirst; ++way) {
                        const std::ptrdiff_t ahead = way == 0 ? 0 : stencil.ahead[std::abs(way) - 1];
                        for (std::size_t f = 0; f < 3; ++f) {
                            const auto at = [&](std::size_t e, std::ptrdiff_t node) {
                                return static_cast<double>(
                                    entries[(9 * static_cast<std::size_t>(std::abs(way)) + e) * stride +
                                            static_cast<std::size_t>(node)]);
                            };
                            const std::ptrdiff_t other = way < 0 ? n - ahead : n + ahead;
                            sum += (way < 0 ? at(3 * f + c, other) : at(3 * c + f, n)) *
                                   static_cast<double>(in[f][static_cast<std::size_t>(other)]);
                        }
                    }
                    const auto node = static_cast<std::size_t>(n);
                    const double expected = n < kFirst ? static_cast<double>(before[c][node])
                                            : residual ? static_cast<double>(from[c][node]) - sum
                                                       : sum;
                    EXPECT_NEAR(out[c][node], expected, this->near(81)) << n;
                }
            }
        }
    }
}

// What a row gives to its nodes is C inverse C^T r with C of the single corners.
TYPED_TEST(Grid, CellsTurnAndNodesCollectIt) {
    using T = TypeParam;
    constexpr std::size_t kNodes = 21, kRow = kNodes + 2, kRows = 3, kPlane = kRow * kRows;
    const std::size_t size = 3 * kPlane + kMaxWidth;
    for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(name(set));
        const auto r = this->template draw_arrays<3>(size);
        const auto F = this->template draw_arrays<9>(size);
        const auto G = this->template draw_arrays<6>(size);
        std::array<std::array<std::vector<T>, 9>, 2> turned;
        const kernels::KernelTable<T>& table = kernels::kernel_table<T>(set);
        const auto corner_offset = [&](std::size_t a) { return (a & 1) + (a >> 1 & 1) * kRow + (a >> 2) * kPlane; };
        for (std::size_t row = 0; row < 2; ++row) {
            kernels::CellTurns<T> turns{};
            for (std::size_t e = 0; e < 9; ++e) {
                turned[row][e].assign(kRow + kMaxWidth, T(0));
                turns.gradient[e] = F[e].data() + row * kRow;
                turns.turned[e] = turned[row][e].data();
            }
            for (std::size_t e = 0; e < 6; ++e) {
                turns.inverse[e] = G[e].data() + row * kRow;
            }
            for (std::size_t c = 0; c < 3; ++c) {
                turns.residual[c] = r[c].data() + row * kRow;
            }
            for (std::size_t a = 0; a < 8; ++a) {
                turns.corner[a] = static_cast<std::ptrdiff_t>(corner_offset(a));
            }
            table.turn_cells()(turns, 0, kNodes + 1);
        }
        auto z = this->template draw_arrays<3>(2 * kPlane);
        const auto before = z;
        kernels::TurnedRows<T> rows{};
        for (std::size_t e = 0; e < 9; ++e) {
            rows.before[e] = turned[0][e].data();
            rows.now[e] = turned[1][e].data();
        }
        for (std::size_t c = 0; c < 3; ++c) {
            rows.below[c] = c == 1 ? nullptr : z[c].data();
            rows.above[c] = z[c].data() + kPlane;
        }
        table.add_turned()(rows, kNodes);
        const auto side = [](std::size_t a, std::size_t axis) { return a >> axis & 1 ? 1.0 : -1.0; };
        const auto given = [&](std::size_t cell, std::size_t corner, std::size_t c) { // to that corner, along c
            double m[3] = {};
            const auto turned_by = [&](std::size_t a, std::size_t axis, std::size_t i) { // of F (e_axis x s_a)
                const std::size_t p = (axis + 1) % 3, q = (axis + 2) % 3;
                return static_cast<double>(F[3 * i + q][cell]) * side(a, p) -
                       static_cast<double>(F[3 * i + p][cell]) * side(a, q);
            };
            for (std::size_t a = 0; a < 8; ++a) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    for (std::size_t i = 0; i < 3; ++i) {
                        m[axis] += turned_by(a, axis, i) * static_cast<double>(r[i][cell + corner_offset(a)]);
                    }
                }
            }
            constexpr std::size_t kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
            double sum = 0;
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) {
                    sum += turned_by(corner, i, c) * static_cast<double>(G[kEntry[i][j]][cell]) * m[j];
                }
            }
            return sum;
        };
        for (std::size_t n = 0; n < kRow; ++n) {
            for (std::size_t c = 0; c < 3; ++c) {
                double below = 0, above = 0;
                for (std::size_t x = 0; x < 2 && n < kNodes; ++x) {
                    for (std::size_t y = 0; y < 2; ++y) {
                        // A node is the high corner, of bit 1, of the cell before it.
                        const std::size_t cell = n + x + y * kRow, corner = (1 - x) + 2 * (1 - y);
                        below += given(cell, corner, c);
                        above += given(cell, corner + 4, c);
                    }
                }
                // Sums of 4 cells, each of 9 products of sums of 48 terms up to 3.
                EXPECT_NEAR(z[c][n], before[c][n] + (c == 1 ? 0 : below), this->near(2000)) << n;
                EXPECT_NEAR(z[c][kPlane + n], before[c][kPlane + n] + above, this->near(2000)) << n;
            }
        }
    }
}

} // namespace
} // namespace hybmss
