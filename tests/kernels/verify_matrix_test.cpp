// The quick part of `hybmss verify`: every layout, instruction set, precision and variant against the scalar reference.

#include "app/verify/verify.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybmss {
namespace {

const verify::RowTable& quick_matrix() {
    static const verify::RowTable table = [] {
        verify::MatrixOptions options;
        options.extent = verify::Extent::quick;
        return verify::run_matrix(options);
    }();
    return table;
}

TEST(VerifyMatrix, EveryRowIsWithinItsTolerance) {
    EXPECT_GT(quick_matrix().rows().size(), 500u);
    for (const auto& row : quick_matrix().rows()) {
        EXPECT_TRUE(row.passed()) << row.key.check << " " << row.key.layout << " " << row.worst_body;
    }
}

TEST(VerifyMatrix, EveryListedKernelHasItsCheck) {
    const auto listed = verify::listed_kernels();
    ASSERT_FALSE(listed.empty());
    for (const auto& kernel : listed) {
        for (const InstructionSet set : available_instruction_sets()) {
            for (const char* precision : {"float", "double"}) {
                EXPECT_TRUE(std::ranges::any_of(quick_matrix().rows(),
                                                [&](const verify::Row& row) {
                                                    return row.key.check == kernel.check &&
                                                           row.key.instruction_set == set &&
                                                           row.key.precision == precision;
                                                }))
                    << kernel.name << " is listed with the check \"" << kernel.check << "\", which has no row for "
                    << name(set) << " in " << precision;
            }
        }
    }
}

} // namespace
} // namespace hybmss
