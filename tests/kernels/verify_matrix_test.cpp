// The quick part of `hybmss verify`: every layout, instruction set, precision and variant against the scalar reference.

#include "app/verify/verify_matrix.hpp"

#include <gtest/gtest.h>

namespace hybmss {
namespace {

TEST(VerifyMatrix, EveryRowIsWithinItsTolerance) {
    verify::MatrixOptions options;
    options.extent = verify::Extent::quick;
    const auto report = verify::run_matrix(options);
    EXPECT_GT(report.rows().size(), 500u);
    for (const auto& row : report.rows()) {
        EXPECT_TRUE(row.passed()) << row.key.check << " " << row.worst_body;
    }
}

} // namespace
} // namespace hybmss
