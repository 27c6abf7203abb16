#include "integrations/petsc/block.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace hybmss::distributed {
namespace {

TEST(ProcessGrid, HasTheFewestGhosts) {
    EXPECT_EQ(choose_process_grid({11, 11, 11}, 1), (ProcessGrid{1, 1, 1}));
    EXPECT_EQ(choose_process_grid({11, 11, 11}, 2), (ProcessGrid{1, 1, 2}));  // rows along x stay whole
    EXPECT_EQ(choose_process_grid({101, 11, 11}, 2), (ProcessGrid{2, 1, 1})); // but where the cut is smaller so
    EXPECT_EQ(choose_process_grid({1001, 1001, 1001}, 512), (ProcessGrid{8, 8, 8}));
    EXPECT_EQ(choose_process_grid({2, 2, 50}, 5), (ProcessGrid{1, 1, 5}));
    EXPECT_EQ(most_ghosts({11, 11, 11}, {1, 1, 2}), 11 * 11);
    EXPECT_EQ(most_ghosts({30, 30, 30}, {3, 3, 3}), 12 * 12 * 12 - 10 * 10 * 10);
}

TEST(ProcessGrid, RefusesRanksThatCannotAllHaveNodes) {
    EXPECT_EQ(choose_process_grid({3, 3, 3}, 27), (ProcessGrid{3, 3, 3}));
    EXPECT_THROW(choose_process_grid({3, 3, 3}, 7), std::invalid_argument);
    EXPECT_THROW(choose_process_grid({3, 3, 3}, 28), std::invalid_argument);
}

} // namespace
} // namespace hybmss::distributed
