#include "bench/limits/operation_count.hpp"

#include <gtest/gtest.h>

namespace hybmss::bench {
namespace {

BenchRow row(Model model, Precision precision, Accuracy accuracy) {
    return {{32, 32, 32}, model, "flat-rows", InstructionSet::avx512, precision, 1, accuracy};
}

double count_roots(const OperationCount& n) {
    return n.estimates + n.square_roots;
}

// One root a spring, and where estimates are taken as they come the reciprocal of the sum; a spring of a cell is
// counted once.
TEST(OperationCount, FindsTheSpringsOfACell) {
    for (Precision precision : {Precision::float32, Precision::float64}) {
        for (Accuracy accuracy : {Accuracy::fast, Accuracy::accurate, Accuracy::exact}) {
            const auto roots = [&](Model model) {
                return count_roots(count_operations(row(model, precision, accuracy)).vector);
            };
            const int of_spring = accuracy == Accuracy::fast ? 2 : 1;
            EXPECT_EQ(roots(Model::hybmss), 13 * of_spring);
            EXPECT_EQ(roots(Model::without_face_diagonals), 7 * of_spring);
            EXPECT_EQ(roots(Model::without_correction_forces), 13 * of_spring);
        }
    }
}

TEST(OperationCount, FindsWhatAccuracyCosts) {
    const KernelCount estimated = count_operations(row(Model::hybmss, Precision::float32, Accuracy::fast));
    const KernelCount accurate = count_operations(row(Model::hybmss, Precision::float32, Accuracy::accurate));
    EXPECT_EQ(accurate.vector.divisions + accurate.vector.square_roots, 0);
    const KernelCount exact = count_operations(row(Model::hybmss, Precision::float32, Accuracy::exact));
    EXPECT_EQ(exact.vector.divisions, 13);
    EXPECT_EQ(exact.vector.estimates, 0);
    EXPECT_LT(exact.vector.slots(), accurate.vector.slots());
    EXPECT_LT(estimated.vector.slots(), accurate.vector.slots());
}

// Displacement and velocity are updated; the mass and a stiffness a kind of spring are read, but none that no spring
// needs.
TEST(OperationCount, FindsTheArraysThatAStepTouches) {
    const KernelCount full = count_operations(row(Model::hybmss, Precision::float32, Accuracy::accurate));
    EXPECT_EQ(full.width, 16);
    EXPECT_EQ(full.arrays_updated, 6);
    EXPECT_EQ(full.arrays_read, 1);
    EXPECT_EQ(full.planes_read, 7);
    const KernelCount sparse =
        count_operations(row(Model::without_face_diagonals, Precision::float32, Accuracy::accurate));
    EXPECT_EQ(sparse.planes_read, 4);
    EXPECT_LT(sparse.vector.slots(), full.vector.slots());
}

} // namespace
} // namespace hybmss::bench
