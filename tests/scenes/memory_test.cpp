// The estimate of a run's memory, before anything is allocated.

#include "simulation/memory.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace hybmss {
namespace {

TEST(Memory, NetworkLayoutsCountTheirSprings) {
    Body body;
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

} // namespace
} // namespace hybmss
