#include "layouts/coloring.hpp"
#include "layouts/network/colored_soa.hpp"
#include "tests/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(ColoredSoa, PadsEveryColourToWholeVectorsWithSpringsOfStiffnessZero) {
    testing::Random random(6);
    const Network network = Network::from_lattice(testing::random_lattice(4, 3, 5, 0.5, random), Material{1e4, 0.4});
    const ColoredSoa<double> soa(network);
    double stiffness = 0;
    for (std::size_t i = 0; i < soa.springs.a.size(); ++i) {
        const bool dummy = soa.springs.a[i] >= static_cast<std::int32_t>(soa.node_count);
        EXPECT_EQ(soa.springs.stiffness[i] == 0, dummy);
        EXPECT_LT(soa.springs.a[i], static_cast<std::int32_t>(soa.size()));
        stiffness += soa.springs.stiffness[i];
    }
    double expected = 0;
    for (const Network::Spring& s : network.springs) {
        expected += s.stiffness;
    }
    EXPECT_NEAR(stiffness, expected, 1e-9 * expected);
    EXPECT_EQ(soa.springs.color_begin.size() - 1, 26u) << "a node inside a lattice has 26 springs";
    for (const auto* begins : {&soa.springs.color_begin, &soa.cells.color_begin}) {
        for (std::size_t begin : *begins) {
            EXPECT_EQ(begin % kPadding, 0u);
        }
    }
    // Within any vector of any colour no node twice, dummies included: scatters may not collide.
    for (std::size_t block = 0; block < soa.cells.node[0].size(); block += kPadding) {
        std::set<std::int32_t> seen;
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (std::size_t lane = 0; lane < kPadding; ++lane) {
                const std::int32_t n = soa.cells.node[corner][block + lane];
                const bool dummy = n >= static_cast<std::int32_t>(soa.node_count);
                EXPECT_TRUE(seen.insert(n).second || dummy);
                EXPECT_TRUE(!dummy || static_cast<std::size_t>(n) == soa.node_count + lane);
            }
        }
    }
}

} // namespace
} // namespace hybmss
