/// The springs in every form: what docs/accuracy.md says of their digits.

#include "bench/limits/box_springs.hpp"
#include "hybmss/accuracy.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace hybmss::bench {
namespace {

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
