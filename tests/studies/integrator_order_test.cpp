// Both Euler methods are of the first order; the one keeps the energy, the other takes it.
#include "studies/stability/integrator_order.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybmss::stability {
namespace {

TEST(IntegratorOrder, IsTheTextbooksOne) {
    for (const IntegratorStudy& study : study_integrators()) {
        EXPECT_NEAR(study.observed_order(), 1, 0.05) << study.integrator;
        const auto [least, greatest] = std::minmax_element(study.energies.begin(), study.energies.end());
        if (study.integrator == "backward Euler") {
            EXPECT_TRUE(std::is_sorted(study.energies.rbegin(), study.energies.rend()));
            EXPECT_LT(*least, 0.1);
        } else {
            // (1 +- omega dt / 2) with 40 steps a period
            EXPECT_GT(*least, 0.9);
            EXPECT_LT(*greatest, 1.1);
        }
    }
}

} // namespace
} // namespace hybmss::stability
