// The quick part of `hybmss verify`: every layout, instruction set, precision and variant against the scalar reference.

#include "app/verify/verify.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybmss {
namespace {

// One test: the matrix takes longer than all others of this folder together.
TEST(VerifyMatrix, EveryRowIsWithinItsToleranceAndEveryKernelHasItsCheck) {
    verify::MatrixOptions options;
    options.extent = verify::Extent::quick;
    const verify::RowTable matrix = verify::run_matrix(options);
    EXPECT_GT(matrix.rows().size(), 500u);
    for (const auto& row : matrix.rows()) {
        EXPECT_TRUE(row.passed()) << row.key.check << " " << row.key.layout << " " << row.worst_body;
    }
    const auto listed = verify::listed_kernels();
    ASSERT_FALSE(listed.empty());
    for (const auto& kernel : listed) {
        for (const InstructionSet set : available_instruction_sets()) {
            for (const char* precision : {"float", "double"}) {
                EXPECT_TRUE(std::ranges::any_of(matrix.rows(),
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
