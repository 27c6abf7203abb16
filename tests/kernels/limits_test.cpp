// The loops of the machine's limits: the springs in every form, with the digits that docs/accuracy.md tells of, and how
// the operations of a step are counted.

#include "bench/limits/box_springs.hpp"
#include "bench/limits/operation_count.hpp"
#include "hybmss/accuracy.hpp"

#include <gtest/gtest.h>

#include <limits>

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
    EXPECT_GT(exact.vector.additions, accurate.vector.additions + 50); // none of which is part of a multiply-add
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

template <class T>
double error(SpringSweep<T> sweep, StateForm form, double strain) {
    BoxSprings<T> box(5, {}, 0.5, form);
    box.displace(strain);
    sweep(box.grid());
    return box.force_error();
}

template <class T>
void check(const SpringSweep<T> (&forms)[kStateForms][kRoots]) {
    const double epsilon = std::numeric_limits<T>::epsilon();
    const auto& displacement = forms[static_cast<int>(StateForm::displacement)];
    const auto& position = forms[static_cast<int>(StateForm::position)];
    for (const double strain : {1e-7, 1e-3, 0.1, 0.5}) {
        for (const Root root : {Root::refined, Root::exact}) {
            if (const auto sweep = displacement[static_cast<int>(root)]) {
                EXPECT_LT(error<T>(sweep, StateForm::displacement, strain), 5 * epsilon)
                    << strain << kRootNames[static_cast<int>(root)];
            }
            // The rounding of positions of up to 8 cells, over the strain.
            if (const auto sweep = position[static_cast<int>(root)]) {
                const double found = error<T>(sweep, StateForm::position, strain);
                EXPECT_LT(found, 16 * epsilon / strain) << kRootNames[static_cast<int>(root)];
                EXPECT_GT(found, 0.1 * epsilon / strain) << kRootNames[static_cast<int>(root)];
            }
        }
        if (const auto sweep = displacement[static_cast<int>(Root::approximate)]) {
            const double found = error<T>(sweep, StateForm::displacement, strain);
            constexpr Precision kOwn = sizeof(T) == sizeof(float) ? Precision::float32 : Precision::float64;
            EXPECT_LT(found, force_error_bound(Accuracy::fast, kOwn));
            // Estimates of 1 are better on some processors.
            EXPECT_GT(found, strain < 1e-3 ? 0 : 0x1p-20);
        }
    }
}

TEST(SpringForms, keep_the_digits_that_are_documented) {
    for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(name(set));
        check(spring_forms(set).float_sweeps);
        check(spring_forms(set).double_sweeps);
    }
}

} // namespace
} // namespace hybmss::bench
