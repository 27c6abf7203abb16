// The estimate of a run's memory, before anything is allocated.

#include "simulation/run/memory.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace hybmss {
namespace {

TEST(Memory, NetworkLayoutsCountTheirSprings) {
    SceneBody body;
    body.cells = {40, 40, 40};
    SimulationOptions options;
    const double by_default = estimated_bytes(body, options);
    std::vector<std::string> layouts = lattice_layouts();
    for (const std::string& layout : network_layouts()) {
        layouts.push_back(layout); // a lattice may name these too
    }
    for (const std::string& layout : layouts) {
        options.plan.layout = layout;
        if (layout.ends_with("-rows")) { // index-free, or nearly
            EXPECT_GE(estimated_bytes(body, options), by_default) << layout;
            EXPECT_LT(estimated_bytes(body, options), 1.2 * by_default) << layout;
        } else {
            EXPECT_GT(estimated_bytes(body, options), 1.5 * by_default) << layout;
        }
    }
}

TEST(Memory, SparseVoxelsCountByTheirCells) {
    // Two cubes of cells in the corners of a large grid.
    const auto body_of = [](std::int64_t edge, std::int64_t grid) {
        SceneBody body;
        body.cells = {grid, grid, grid};
        body.labels.resize(static_cast<std::size_t>(grid * grid * grid));
        for (std::int64_t k = 0; k < edge; ++k) {
            for (std::int64_t j = 0; j < edge; ++j) {
                for (std::int64_t i = 0; i < edge; ++i) {
                    body.labels[static_cast<std::size_t>(i + grid * (j + grid * k))] = 1;
                    body.labels[static_cast<std::size_t>(grid - 1 - i +
                                                         grid * (grid - 1 - j + grid * (grid - 1 - k)))] = 2;
                }
            }
        }
        return body;
    };
    const SimulationOptions options;
    const double small = estimated_bytes(body_of(12, 96), options), large = estimated_bytes(body_of(24, 96), options);
    const double grid = 9 * 97.0 * 97 * 97; // what the grid itself takes
    EXPECT_GT((large - grid) / (small - grid), 5);
    EXPECT_LT((large - grid) / (small - grid), 9);
    SceneBody box = body_of(1, 96);
    box.labels.clear();
    EXPECT_LT(large, estimated_bytes(box, options) / 10);
    box.labels.assign(96 * 96 * 96, 1);
    const double full = estimated_bytes(box, options);
    box.labels.clear();
    EXPECT_EQ(full, estimated_bytes(box, options));
}

} // namespace
} // namespace hybmss
