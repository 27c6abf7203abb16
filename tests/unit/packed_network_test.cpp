// The layout packed-xyzw: its order, blocks and tiles.

#include "layouts/conflict_free_blocks.hpp"
#include "layouts/packed_xyzw.hpp"
#include "layouts/row_order.hpp"
#include "layouts/tile_coloring.hpp"
#include "tests/unit/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

namespace hybmss {
namespace {

/// Springs and cells on a lattice with voids, nodes numbered at random.
Network randomly_numbered(int nx, int ny, int nz, unsigned seed) {
    testing::Random random(seed);
    Network network = Network::from_lattice(testing::random_lattice(nx, ny, nz, 0.5, random), Material{1e4, 0.4});
    std::vector<std::int32_t> number(network.masses.size());
    std::iota(number.begin(), number.end(), 0);
    std::shuffle(number.begin(), number.end(), std::mt19937(seed));
    const auto renumbered = [&](std::int32_t n) { return number[static_cast<std::size_t>(n)]; };
    const Network old = network;
    for (std::size_t n = 0; n < number.size(); ++n) {
        network.rest_positions[static_cast<std::size_t>(number[n])] = old.rest_positions[n];
        network.masses[static_cast<std::size_t>(number[n])] = old.masses[n];
    }
    for (auto& s : network.springs) {
        s.a = renumbered(s.a);
        s.b = renumbered(s.b);
    }
    for (auto& c : network.cells) {
        std::transform(c.nodes.begin(), c.nodes.end(), c.nodes.begin(), renumbered);
    }
    return network;
}

TEST(RowOrder, NumbersAShuffledLatticeAsItWas) {
    const Lattice lattice = Lattice::box(3, 4, 5, 0.7);
    std::vector<std::array<double, 3>> points;
    for (std::size_t n = 0; n < lattice.grid_node_count(); ++n) {
        points.push_back(lattice.rest_position(n));
    }
    std::vector<std::uint32_t> number(points.size());
    std::iota(number.begin(), number.end(), 0u);
    std::shuffle(number.begin(), number.end(), std::mt19937(2));
    auto shuffled = points;
    testing::Random random(2);
    for (std::size_t n = 0; n < points.size(); ++n) {
        for (double& x : points[n]) {
            x += random.between(-0.1, 0.1); // rounded away
        }
        shuffled[number[n]] = points[n];
    }
    EXPECT_EQ(row_order(shuffled, 0.7), number);
    // The longest side counts slowest, whichever it is.
    const std::vector<std::array<double, 3>> flat = {{0, 0, 0}, {5, 0, 0}, {0, 1, 0}, {5, 1, 0}};
    EXPECT_EQ(row_order(flat, 1), (std::vector<std::uint32_t>{0, 2, 1, 3}));
    EXPECT_TRUE(row_order({}, 1).empty());
}

TEST(ConflictFreeBlocks, HoldEveryItemOnceAndNoNodeTwiceInABlock) {
    testing::Random random(3);
    constexpr std::size_t kNodes = 300, kCount = 4000, kSize = 16;
    std::vector<std::int32_t> nodes;
    std::vector<std::uint32_t> items(kCount);
    std::iota(items.begin(), items.end(), 0u);
    for (std::size_t i = 0; i < kCount; ++i) {
        // A hub among them: more items at one node than blocks may be open.
        const auto a = static_cast<std::int32_t>(i % 10 == 0 ? 0 : random.below(kNodes - 1) + 1);
        std::int32_t b = a;
        while (b == a) {
            b = static_cast<std::int32_t>(random.below(kNodes));
        }
        nodes.insert(nodes.end(), {a, b});
    }
    std::vector<std::uint32_t> slots;
    ConflictFreeBlocks(kNodes, 2, kSize).append(items, nodes, slots);
    ASSERT_EQ(slots.size() % kSize, 0u);
    std::vector<int> seen(kCount, 0);
    for (std::size_t block = 0; block < slots.size(); block += kSize) {
        std::set<std::int32_t> own;
        for (std::size_t i = block; i < block + kSize; ++i) {
            if (slots[i] != kNoItem) {
                ++seen[slots[i]];
                EXPECT_TRUE(own.insert(nodes[2 * slots[i]]).second);
                EXPECT_TRUE(own.insert(nodes[2 * slots[i] + 1]).second);
            }
        }
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(kCount));
}

TEST(TileColoring, GivesTilesThatMeetDifferentColours) {
    // A hundred tiles that all meet: a hundred colours, more than a word has bits. One more meets nobody.
    std::vector<std::vector<std::int32_t>> tiles(100, {5});
    tiles.push_back({6});
    const Coloring coloring = color_tiles(tiles, 7);
    EXPECT_EQ(coloring.colors(), 100u);
    EXPECT_EQ(coloring.begin[1] - coloring.begin[0], 2u);
    EXPECT_EQ(color_tiles({}, 0).colors(), 0u);
}

template <class Block, class Visit>
void for_each_node(const Block& block, const Visit& visit) {
    for (int lane = 0; lane < kBlockItems; ++lane) {
        if constexpr (std::is_same_v<Block, SpringBlock<double>>) {
            visit(lane, block.a[lane]);
            visit(lane, block.b[lane]);
        } else {
            for (const auto& corner : block.node) {
                visit(lane, corner[lane]);
            }
        }
    }
}

TEST(PackedXyzw, TilesOfAColourShareNoNodeAndBlocksRepeatNone) {
    const PackedXyzw<double> layout(randomly_numbered(17, 13, 11, 5));
    ASSERT_GT(layout.tiles.size(), 8u);
    const auto body_nodes = static_cast<std::int32_t>(4 * layout.node_count);
    std::set<std::int32_t> dummies;
    for (std::size_t color = 0; color + 1 < layout.color_begin.size(); ++color) {
        std::map<std::int32_t, std::size_t> owner;
        for (std::size_t t = layout.color_begin[color]; t < layout.color_begin[color + 1]; ++t) {
            const auto check = [&](const auto& block) {
                std::map<std::int32_t, int> lanes;
                for_each_node(block, [&](int lane, std::int32_t n) {
                    EXPECT_EQ(n % 4, 0);
                    EXPECT_LT(n, static_cast<std::int32_t>(4 * layout.size()));
                    EXPECT_EQ(owner.emplace(n, t).first->second, t) << "two tiles of a colour";
                    if (n < body_nodes) {
                        EXPECT_TRUE(lanes.emplace(n, lane).second) << "twice in a block";
                    } else {
                        EXPECT_EQ(layout.inverse_mass[static_cast<std::size_t>(n)], 0);
                        dummies.insert(n);
                    }
                });
            };
            for (std::size_t b = layout.tiles[t].spring_begin; b < layout.tiles[t].spring_end; ++b) {
                check(layout.springs[b]);
            }
            for (std::size_t b = layout.tiles[t].cell_begin; b < layout.tiles[t].cell_end; ++b) {
                check(layout.cells[b]);
            }
        }
    }
    EXPECT_LE(dummies.size(), layout.tiles.size());
}

TEST(PackedXyzw, HoldsEverySpringAndCellOnceUnderTheCallersNumbers) {
    const Network network = randomly_numbered(9, 8, 7, 8);
    const PackedXyzw<double> layout(network);
    ASSERT_EQ(layout.order.size(), layout.node_count);
    for (std::size_t n = 0; n < layout.node_count; ++n) {
        EXPECT_EQ(layout.order[layout.place[n]], n);
        EXPECT_EQ(layout.inverse_mass[4 * layout.place[n] + 2], 1 / network.masses[n]);
        EXPECT_EQ(layout.inverse_mass[4 * layout.place[n] + 3], 0);
    }
    using Entry = std::array<double, 6>; // a, b, k, rest vector
    std::multiset<Entry> expected, found;
    for (const auto& s : network.springs) {
        const auto& r = s.rest_vector;
        expected.insert({static_cast<double>(s.a), static_cast<double>(s.b), s.stiffness, r[0], r[1], r[2]});
    }
    for (std::size_t b = 0; b < layout.springs.size(); ++b) {
        const SpringBlock<double>& block = layout.springs[b];
        for (int lane = 0; lane < kBlockItems; ++lane) {
            if (block.stiffness[lane] > 0) {
                const auto caller = [&](std::int32_t n) {
                    return static_cast<double>(layout.order[static_cast<std::size_t>(n / 4)]);
                };
                found.insert({caller(block.a[lane]), caller(block.b[lane]), block.stiffness[lane], block.rest[0][lane],
                              block.rest[1][lane], block.rest[2][lane]});
            }
        }
    }
    EXPECT_EQ(found, expected);
    std::size_t cells = 0;
    for (std::size_t b = 0; b < layout.cells.size(); ++b) {
        cells += static_cast<std::size_t>(
            std::count_if(layout.cells[b].kappa, layout.cells[b].kappa + kBlockItems, [](double k) { return k != 0; }));
    }
    EXPECT_EQ(cells, network.cells.size());
}

TEST(PackedXyzw, KeepsTheOrderOfALatticeAndFillsItsBlocks) {
    const PackedXyzw<float> layout(Network::from_lattice(Lattice::box(24, 24, 24, 0.5), Material{1e4, 0.4}));
    EXPECT_TRUE(layout.order.empty());
    EXPECT_LT(static_cast<double>(layout.springs.size() * kBlockItems), 1.1 * static_cast<double>(layout.spring_count));
    EXPECT_LT(layout.color_begin.size() - 1, 16u);
}

} // namespace
} // namespace hybmss
