// The levels of accuracy as a caller chooses them: by name, and by the error that is wanted.

#include "hybmss/force_plan.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/moving_body.hpp"
#include "tests/random_bodies.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybmss {
namespace {

constexpr double kFloatRounding = 5 * 0x1p-23, kDoubleRounding = 5 * 0x1p-52;

Accuracy chosen(const PlanOptions& options) {
    return ForcePlan<float>(Lattice::box(2, 2, 2, 1.0), Material{}, options).describe().choice.accuracy;
}

/// Over the greatest force scale.
double error_of(const PlanOptions& options) {
    const Lattice lattice = Lattice::box(7, 5, 6, 0.5);
    Material material;
    material.poisson_ratio = 0.45;
    const ForcePlan<float> plan(lattice, material, options);
    const std::size_t n = plan.node_count();
    const std::vector<float> u = testing::random_field<float>(n, 1e-3, 1);
    std::vector<float> f(3 * n, 0.0f);
    plan.add_forces(VectorField<const float>::aos(u.data(), n), VectorField<float>::aos(f.data(), n));
    const reference::Body body = reference::assemble(lattice, material);
    std::vector<reference::Vector3d> at(n);
    for (std::size_t i = 0; i < n; ++i) {
        at[i] = {u[3 * i], u[3 * i + 1], u[3 * i + 2]};
    }
    const auto expected = reference::forces(body, at);
    const auto scales = reference::force_scale(body, at);
    double error = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const reference::Vector3d found(f[3 * i], f[3 * i + 1], f[3 * i + 2]);
        error = std::max(error, (found - expected[i]).cwiseAbs().maxCoeff());
    }
    return error / *std::max_element(scales.begin(), scales.end());
}

TEST(AccuracyLevels, AreNamed) {
    for (const Accuracy level : {Accuracy::fast, Accuracy::accurate, Accuracy::exact}) {
        EXPECT_EQ(parse_accuracy(name(level)), level);
    }
    testing::expect_refusal([] { parse_accuracy("precise"); },
                            {"accuracy \"precise\" is not known: it must be one of fast, accurate, exact"});
}

TEST(AccuracyLevels, AreChosenByTheErrorThatIsWanted) {
    const auto level = [](double error) { return fastest_level(error); };
    EXPECT_EQ(level(0.5).precision, Precision::float32);
    EXPECT_EQ(level(0.5).accuracy, Accuracy::fast);
    EXPECT_EQ(level(0x1p-10).accuracy, Accuracy::fast);
    EXPECT_EQ(level(0x1p-11).precision, Precision::float32);
    EXPECT_EQ(level(0x1p-11).accuracy, Accuracy::accurate);
    EXPECT_EQ(level(kFloatRounding).precision, Precision::float32);
    EXPECT_EQ(level(1e-7).precision, Precision::float64);
    EXPECT_EQ(level(kDoubleRounding).accuracy, Accuracy::accurate);
    for (const double none : {1e-16, 0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        testing::expect_refusal([&] { fastest_level(none); },
                                {"force_error = ", "is not allowed: it must be at least 1.11022e-15"});
    }
}

TEST(AccuracyLevels, APlanTakesTheFastestThatWillDo) {
    PlanOptions options;
    EXPECT_EQ(chosen(options), Accuracy::accurate);
    options.force_error = 0.01;
    EXPECT_EQ(chosen(options), Accuracy::fast);
    options.force_error = 1e-5;
    options.accuracy = Accuracy::exact; // its place is taken
    EXPECT_EQ(chosen(options), Accuracy::accurate);
    options.force_error = 1e-8;
    testing::expect_refusal([&] { chosen(options); },
                            {"force_error = 1e-08 is not allowed: it must be 0 or at least 5.96046e-07 in float"});
    options.force_error = std::numeric_limits<double>::quiet_NaN();
    testing::expect_refusal([&] { chosen(options); }, {"force_error = nan"});
    options.force_error = 1e-8;
    const ForcePlan<double> in_double(Lattice::box(2, 2, 2, 1.0), Material{}, options);
    EXPECT_EQ(in_double.describe().choice.accuracy, Accuracy::accurate);
    // What is chosen makes the same plan again.
    EXPECT_EQ(in_double.describe().choice.force_error, 0);
}

TEST(AccuracyLevels, EachIsAsGoodAsItSaysAndNoBetter) {
    for (const InstructionSet set : available_instruction_sets()) {
        PlanOptions options;
        options.instruction_set = set;
        const double accurate = error_of(options);
        EXPECT_LT(accurate, force_error_bound(Accuracy::accurate, Precision::float32)) << name(set);
        options.accuracy = Accuracy::fast;
        const double fast = error_of(options);
        EXPECT_LT(fast, force_error_bound(Accuracy::fast, Precision::float32)) << name(set);
        if (set != InstructionSet::neon) {
            EXPECT_GT(fast, 10 * accurate) << name(set);
        }
    }
}

} // namespace
} // namespace hybmss
