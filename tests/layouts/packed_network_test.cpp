// The layout packed-xyzw: its order, blocks and tiles.

#include "layouts/coloring.hpp"
#include "layouts/network/item_groups.hpp"
#include "layouts/network/network_geometry.hpp"
#include "layouts/network/packed_sources.hpp"
#include "layouts/network/packed_xyzw.hpp"
#include "tests/random_bodies.hpp"

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

TEST(ItemRuns, HoldEveryItemOnceWithItsNodesInALane) {
    // Springs from each of the nodes 3 ... 40 to the one 50 and to the one 51 behind it; one twice, one elsewhere.
    std::vector<std::int32_t> nodes;
    for (std::int32_t n = 3; n <= 40; ++n) {
        nodes.insert(nodes.end(), {n, n + 50, n, n + 51});
    }
    nodes.insert(nodes.end(), {20, 70, 20, 99});
    std::vector<std::uint32_t> items(nodes.size() / 2), single;
    std::iota(items.begin(), items.end(), 0u);
    std::stable_sort(items.begin(), items.end(), [&](auto a, auto b) { return nodes[2 * a] < nodes[2 * b]; });
    const std::vector<ItemRun> runs = find_runs(items, nodes, 2, 10, single);
    EXPECT_EQ(runs.size(), 4u); // from 0 ... 15 and 16 ... 31; nine from 32 ... are too few
    std::vector<int> seen(items.size(), 0);
    for (const ItemRun& run : runs) {
        EXPECT_EQ(run.node[0] % kBlockItems, 0);
        for (std::int32_t lane = 0; lane < kBlockItems; ++lane) {
            if (const std::uint32_t item = run.item[static_cast<std::size_t>(lane)]; item != kNoItem) {
                ++seen[item];
                EXPECT_EQ(nodes[2 * item], run.node[0] + lane);
                EXPECT_EQ(nodes[2 * item + 1], run.node[1] + lane);
            }
        }
    }
    EXPECT_EQ(single.size(), 18u + 2u);
    for (const std::uint32_t item : single) {
        ++seen[item];
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(items.size()));
}

TEST(ItemRuns, FromTheSameNodesAreApartWhereTheyOverlap) {
    std::vector<std::int32_t> nodes;
    for (std::int32_t n = 0; n < 16; ++n) {
        for (const std::int32_t b : {100, 101, 102, 200, 201, 300}) {
            nodes.insert(nodes.end(), {n, n + b});
        }
    }
    std::vector<std::uint32_t> items(nodes.size() / 2), single;
    std::iota(items.begin(), items.end(), 0u);
    std::vector<std::int32_t> high;
    for (const ItemRun& run : find_runs(items, nodes, 2, 1, single)) {
        high.push_back(run.node[1]);
    }
    EXPECT_EQ(high, (std::vector<std::int32_t>{100, 200, 300, 101, 201, 102}));
    EXPECT_TRUE(single.empty());
}

TEST(DistinctRows, KeepEachRowOnce) {
    DistinctRows<std::array<double, 2>> rows;
    EXPECT_EQ(rows.number_of({1, 2}), 0u);
    EXPECT_EQ(rows.number_of({2, 1}), 1u);
    EXPECT_EQ(rows.number_of({1, 2}), 0u);
    const auto all = rows.array();
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[1][0], 2);
}

TEST(LaneOfRow, IsWhatTheTranspositionLeaves) {
    std::vector<std::size_t> eight, sixteen;
    for (std::size_t position = 0; position < 16; ++position) {
        EXPECT_EQ(lane_of_row(position, 4), position);
        eight.push_back(lane_of_row(position, 8));
        sixteen.push_back(lane_of_row(position, 16));
    }
    EXPECT_EQ(eight, (std::vector<std::size_t>{0, 2, 4, 6, 1, 3, 5, 7, 8, 10, 12, 14, 9, 11, 13, 15}));
    EXPECT_EQ(sixteen, (std::vector<std::size_t>{0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15}));
}

/// All nodes that a block or run names, gaps too: visit(lane, first element).
template <class Block, class Visit>
void for_each_node(const Block& block, const Visit& visit) {
    for (int lane = 0; lane < kBlockItems; ++lane) {
        if constexpr (std::is_same_v<Block, SpringBlock<double>>) {
            visit(lane, block.a[lane]);
            visit(lane, block.b[lane]);
        } else if constexpr (std::is_same_v<Block, SpringRun>) {
            visit(lane, block.low + 4 * lane);
            visit(lane, block.high + 4 * lane);
        } else if constexpr (std::is_same_v<Block, CellRun>) {
            for (const std::int32_t first : block.node) {
                visit(lane, first + 4 * lane);
            }
        } else {
            for (const auto& corner : block.node) {
                visit(lane, corner[lane]);
            }
        }
    }
}

/// A body with runs, gaps in runs, and springs across it that are in none.
Network mixed(unsigned seed) {
    Network network = randomly_numbered(17, 13, 11, seed);
    testing::Random random(seed);
    const auto nodes = static_cast<std::int32_t>(network.masses.size());
    for (int i = 0; i < 300; ++i) {
        const auto a = static_cast<std::int32_t>(random.below(static_cast<std::size_t>(nodes)));
        const auto b = static_cast<std::int32_t>((a + 1 + static_cast<int>(random.below(40))) % nodes);
        network.springs.push_back({a, b, 2.5, {0.1, 0.2, -0.3}});
    }
    return network;
}

TEST(PackedXyzw, TilesOfAColourShareNoNodeAndBlocksRepeatNone) {
    const PackedXyzw<double> layout(mixed(5));
    ASSERT_GT(layout.tiles.size(), 8u);
    ASSERT_GT(layout.spring_runs.size(), 100u);
    ASSERT_GT(layout.springs.size(), 20u);
    const auto body_nodes = static_cast<std::int32_t>(4 * layout.node_count);
    std::set<std::int32_t> dummies;
    for (std::size_t color = 0; color + 1 < layout.color_begin.size(); ++color) {
        std::map<std::int32_t, std::size_t> owner;
        for (std::size_t t = layout.color_begin[color]; t < layout.color_begin[color + 1]; ++t) {
            const auto check = [&](const auto& block) {
                constexpr bool kRun = std::is_same_v<decltype(block), const SpringRun&> ||
                                      std::is_same_v<decltype(block), const CellRun&>;
                std::map<std::int32_t, int> lanes;
                for_each_node(block, [&](int lane, std::int32_t n) {
                    EXPECT_EQ(n % 4, 0);
                    EXPECT_LT(n, static_cast<std::int32_t>(4 * layout.size()));
                    EXPECT_EQ(owner.emplace(n, t).first->second, t) << "two tiles of a colour";
                    if (n >= body_nodes) {
                        EXPECT_EQ(layout.inverse_mass[static_cast<std::size_t>(n)], 0);
                        dummies.insert(n);
                    } else if (!kRun) {
                        EXPECT_TRUE(lanes.emplace(n, lane).second) << "twice in a block";
                    }
                });
            };
            const NetworkTile& tile = layout.tiles[t];
            for (std::size_t b = tile.spring_run_begin; b < tile.spring_run_end; ++b) {
                check(layout.spring_runs[b]);
            }
            for (std::size_t b = tile.cell_run_begin; b < tile.cell_run_end; ++b) {
                check(layout.cell_runs[b]);
            }
            for (std::size_t b = tile.spring_begin; b < tile.spring_end; ++b) {
                check(layout.springs[b]);
            }
            for (std::size_t b = tile.cell_begin; b < tile.cell_end; ++b) {
                check(layout.cells[b]);
            }
        }
    }
    EXPECT_LE(dummies.size(), layout.tiles.size() + kBlockItems);
}

class PackedXyzwLanes : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Widths, PackedXyzwLanes, ::testing::Values(2, 4, 8, 16));

TEST_P(PackedXyzwLanes, HoldsEverySpringAndCellOnceUnderTheCallersNumbers) {
    const Network network = mixed(8);
    const PackedXyzw<double> layout(network, GetParam());
    ASSERT_EQ(layout.order.size(), layout.node_count);
    for (std::size_t n = 0; n < layout.node_count; ++n) {
        EXPECT_EQ(layout.order[layout.place[n]], n);
        EXPECT_EQ(layout.inverse_mass[4 * layout.place[n] + 2], 1 / network.masses[n]);
        EXPECT_EQ(layout.inverse_mass[4 * layout.place[n] + 3], 0);
    }
    using Entry = std::array<double, 6>; // a, b, k, rest vector; from the lower place to the higher
    std::multiset<Entry> expected, found;
    for (const auto& s : network.springs) {
        const auto& r = s.rest_vector;
        const auto a = static_cast<double>(s.a), b = static_cast<double>(s.b);
        const bool turned = layout.place[static_cast<std::size_t>(s.a)] > layout.place[static_cast<std::size_t>(s.b)];
        expected.insert(turned ? Entry{b, a, s.stiffness, -r[0], -r[1], -r[2]}
                               : Entry{a, b, s.stiffness, r[0], r[1], r[2]});
    }
    const auto caller = [&](std::int32_t first) {
        return static_cast<double>(layout.order[static_cast<std::size_t>(first / 4)]);
    };
    for (std::size_t b = 0; b < layout.springs.size(); ++b) {
        const SpringBlock<double>& block = layout.springs[b];
        for (int lane = 0; lane < kBlockItems; ++lane) {
            if (block.stiffness[lane] > 0) {
                found.insert({caller(block.a[lane]), caller(block.b[lane]), block.stiffness[lane], block.rest[0][lane],
                              block.rest[1][lane], block.rest[2][lane]});
            }
        }
    }
    for (std::size_t r = 0; r < layout.spring_runs.size(); ++r) {
        const SpringRun& run = layout.spring_runs[r];
        for (std::size_t position = 0; position < kBlockItems; ++position) {
            const auto lane = static_cast<std::int32_t>(lane_of_row(position, GetParam()));
            const SpringRunShape<double>& shape = layout.spring_run_shapes[run.shape];
            if (const double k = layout.stiffnesses[run.stiffness].lane[position]; k > 0) {
                found.insert({caller(run.low + 4 * lane), caller(run.high + 4 * lane), k, shape.rest[0][position],
                              shape.rest[1][position], shape.rest[2][position]});
            }
        }
    }
    EXPECT_EQ(found, expected);

    using Corners = std::array<double, 9>; // and kappa
    std::multiset<Corners> expected_cells, found_cells;
    for (const auto& c : network.cells) {
        Corners corners{};
        std::copy(c.nodes.begin(), c.nodes.end(), corners.begin());
        corners[8] = c.kappa;
        expected_cells.insert(corners);
    }
    for (std::size_t b = 0; b < layout.cells.size(); ++b) {
        for (std::size_t lane = 0; lane < kBlockItems; ++lane) {
            Corners corners{};
            corners[8] = layout.cells[b].kappa[lane];
            for (std::size_t c = 0; corners[8] != 0 && c < 8; ++c) {
                corners[c] = caller(layout.cells[b].node[c][lane]);
            }
            if (corners[8] != 0) {
                found_cells.insert(corners);
            }
        }
    }
    for (std::size_t r = 0; r < layout.cell_runs.size(); ++r) {
        const CellRun& run = layout.cell_runs[r];
        for (std::size_t position = 0; position < kBlockItems; ++position) {
            Corners corners{};
            corners[8] = layout.kappas[run.weights].lane[position];
            const auto lane = static_cast<std::int32_t>(lane_of_row(position, GetParam()));
            for (std::size_t c = 0; corners[8] != 0 && c < 8; ++c) {
                corners[c] = caller(run.node[c] + 4 * lane);
            }
            if (corners[8] != 0) {
                found_cells.insert(corners);
            }
        }
    }
    EXPECT_EQ(found_cells, expected_cells);
    EXPECT_GT(layout.cell_runs.size(), 0u);
    EXPECT_GT(layout.cells.size(), 0u);
}

TEST(PackedXyzw, KeepsTheOrderOfALatticeAndIsAllRuns) {
    const PackedXyzw<float> layout(Network::from_lattice(Lattice::box(24, 24, 24, 0.5), Material{1e4, 0.4}));
    EXPECT_TRUE(layout.order.empty());
    EXPECT_LT(static_cast<double>(layout.spring_runs.size() * kBlockItems),
              1.1 * static_cast<double>(layout.spring_count));
    EXPECT_LT(static_cast<double>(layout.springs.size() * kBlockItems),
              0.01 * static_cast<double>(layout.spring_count));
    EXPECT_LE(layout.spring_run_shapes.size(), 13u);
    EXPECT_LT(layout.stiffnesses.size() * 20, layout.spring_runs.size());
    EXPECT_LT(layout.color_begin.size() - 1, 16u);
}

TEST(PackedXyzw, HoldsCellsOnMeansInRuns) {
    const Network network =
        Network::from_lattice(Lattice::box(24, 24, 24, 0.5), {.poisson_ratio = 0.4, .springs = SpringForm::means});
    const PackedXyzw<float> layout(network);
    EXPECT_TRUE(layout.order.empty());
    EXPECT_EQ(layout.cells.size() + layout.cell_runs.size() + layout.springs.size() + layout.spring_runs.size(), 0u);
    EXPECT_LT(static_cast<double>(layout.means.runs.size() * kBlockItems), 1.2 * 24 * 24 * 24);
    EXPECT_LT(static_cast<double>(layout.means.blocks.size() * kBlockItems), 0.02 * 24 * 24 * 24);
    EXPECT_EQ(layout.means.run_shapes.size(), 1u);
}

TEST(PackedXyzw, FillsTheBlocksOfABodyWithoutRuns) {
    Network network = Network::from_lattice(Lattice::box(24, 24, 24, 0.5), Material{1e4, 0.4});
    testing::Random random(4);
    std::erase_if(network.springs, [&](const auto&) { return random.between(0, 1) < 0.9; }); // hardly a run is left
    network.cells.clear();
    const PackedXyzw<float> layout(network);
    EXPECT_LT(layout.spring_runs.size() * 4, layout.springs.size());
    EXPECT_LT(static_cast<double>(layout.springs.size() * kBlockItems), 1.2 * static_cast<double>(layout.spring_count));
}

} // namespace
} // namespace hybmss
