#include "layouts/coloring.hpp"
#include "layouts/network/colored_soa.hpp"
#include "tests/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

namespace hybmss {
namespace {

/// Every item once, and no node twice within a colour.
void expect_proper(const Coloring& coloring, const std::vector<std::int32_t>& nodes, std::size_t per_item) {
    std::vector<std::uint32_t> sorted = coloring.order;
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint32_t> all(nodes.size() / per_item);
    std::iota(all.begin(), all.end(), 0u);
    ASSERT_EQ(sorted, all);
    for (std::size_t c = 0; c < coloring.colors(); ++c) {
        std::set<std::int32_t> seen;
        for (std::size_t i = coloring.begin[c]; i < coloring.begin[c + 1]; ++i) {
            for (std::size_t n = 0; n < per_item; ++n) {
                EXPECT_TRUE(seen.insert(nodes[coloring.order[i] * per_item + n]).second) << "colour " << c;
            }
        }
    }
}

TEST(Coloring, IsProperOnRandomGraphs) {
    testing::Random random(5);
    for (std::size_t per_item : {2u, 8u}) {
        std::vector<std::int32_t> nodes;
        for (int item = 0; item < 500; ++item) {
            std::set<std::int32_t> own;
            while (own.size() < per_item) {
                own.insert(static_cast<std::int32_t>(random.below(60)));
            }
            nodes.insert(nodes.end(), own.begin(), own.end());
        }
        expect_proper(color_greedily(nodes, per_item, 60), nodes, per_item);
    }
}

TEST(Coloring, PassesSixtyFourColoursWhenANodeHasMoreSprings) {
    std::vector<std::int32_t> star;
    for (std::int32_t i = 1; i <= 150; ++i) {
        star.insert(star.end(), {0, i});
    }
    const Coloring coloring = color_greedily(star, 2, 151);
    expect_proper(coloring, star, 2);
    EXPECT_EQ(coloring.colors(), 150u);
}

TEST(Coloring, OfNothingHasNoColours) {
    EXPECT_EQ(color_greedily({}, 2, 0).colors(), 0u);
}

/// No node in two pieces of a colour; lanes in a row, or each node once; padding at the dummies, or in the gaps of
/// rows.
template <std::size_t ends>
void expect_blocks(const AlignedArray<std::int32_t>* const (&node)[ends], const AlignedArray<std::uint8_t>& in_row,
                   const std::vector<std::size_t>& color_begin, const std::vector<std::size_t>& piece_begin,
                   std::size_t node_count) {
    ASSERT_EQ(color_begin.back(), node[0]->size());
    ASSERT_EQ(piece_begin.back(), node[0]->size());
    ASSERT_EQ(in_row.size() * kPadding, node[0]->size());
    EXPECT_TRUE(std::includes(piece_begin.begin(), piece_begin.end(), color_begin.begin(), color_begin.end()));
    for (std::size_t color = 0; color + 1 < color_begin.size(); ++color) {
        std::map<std::int32_t, std::size_t> piece_of;
        std::set<std::int32_t> gathered;
        EXPECT_EQ(color_begin[color] % kPadding, 0u);
        for (std::size_t slot = color_begin[color]; slot < color_begin[color + 1]; ++slot) {
            const std::size_t block = slot / kPadding, lane = slot % kPadding;
            const auto piece = static_cast<std::size_t>(std::upper_bound(piece_begin.begin(), piece_begin.end(), slot) -
                                                        piece_begin.begin());
            for (const auto* end : node) {
                const std::int32_t n = (*end)[slot];
                if (in_row[block]) {
                    EXPECT_EQ(n, (*end)[block * kPadding] + static_cast<std::int32_t>(lane));
                    EXPECT_LT(static_cast<std::size_t>(n), node_count + kPadding);
                } else if (n >= static_cast<std::int32_t>(node_count)) {
                    EXPECT_EQ(static_cast<std::size_t>(n), node_count + lane);
                    continue;
                } else {
                    EXPECT_TRUE(gathered.insert(n).second) << n;
                }
                EXPECT_EQ(piece_of.emplace(n, piece).first->second, piece) << n;
            }
        }
    }
}

void expect_soa(const Network& network) {
    const ColoredSoa<double> soa(network);
    double stiffness = 0, kappa = 0, expected = 0, expected_kappa = 0;
    std::size_t springs = 0;
    for (std::size_t i = 0; i < soa.springs.a.size(); ++i) {
        springs += soa.springs.stiffness[i] > 0;
        stiffness += soa.springs.stiffness[i];
    }
    for (std::size_t i = 0; i < soa.cells.kappa.size(); ++i) {
        kappa += soa.cells.kappa[i];
    }
    for (const Network::Spring& s : network.springs) {
        expected += s.stiffness;
    }
    for (const Network::Cell& c : network.cells) {
        expected_kappa += c.kappa;
    }
    EXPECT_EQ(springs, network.springs.size());
    EXPECT_NEAR(stiffness, expected, 1e-9 * expected);
    EXPECT_NEAR(kappa, expected_kappa, 1e-9 * expected_kappa);
    const auto& rows = soa.springs.in_row;
    EXPECT_GT(std::count(rows.data(), rows.data() + rows.size(), 1), 0);
    EXPECT_GT(std::count(rows.data(), rows.data() + rows.size(), 0), 0);
    expect_blocks<2>({&soa.springs.a, &soa.springs.b}, rows, soa.springs.color_begin, soa.springs.piece_begin,
                     soa.node_count);
    const auto& n = soa.cells.node;
    expect_blocks<8>({&n[0], &n[1], &n[2], &n[3], &n[4], &n[5], &n[6], &n[7]}, soa.cells.in_row, soa.cells.color_begin,
                     soa.cells.piece_begin, soa.node_count);
}

TEST(ColoredSoa, HasRunsAndSinglesInBlocksWhosePiecesShareNoNodeInAColour) {
    testing::Random random(6);
    expect_soa(Network::from_lattice(testing::random_lattice(4, 3, 5, 0.5, random), Material{1e4, 0.4}));
    expect_soa(Network::from_lattice(testing::random_lattice(20, 5, 6, 0.9, random), Material{1e4, 0.4}));
    expect_soa(Network::from_lattice(Lattice::box(1, 1, 1, 0.1), Material{1e4, 0.4}));
    expect_soa(Network::from_lattice(Lattice::box(12, 11, 13, 0.1), Material{1e4, 0.4}));
    expect_soa(Network::from_lattice(Lattice::box(30, 3, 3, 0.1), Material{1e4, 0.4}));
}

} // namespace
} // namespace hybmss
