// The quick hard cases, and that the suite's own judgement can fail.
// The stability map against thresholds known in closed form, or found by other means.
// Both Euler methods are of the first order; the one keeps the energy, the other takes it.

#include "studies/stability/hard_case.hpp"
#include "studies/stability/integrator_order.hpp"
#include "studies/stability/stability_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace hybmss::stability {
namespace {

HardCase case_that(Wanted wanted, std::function<Outcome()> run) {
    return {"test: case", "nothing", wanted, true, std::move(run)};
}

TEST(HardCase, NamesAreUnique) {
    std::set<std::string> names;
    for (const HardCase& hard_case : hard_cases(SpringForm::nodes)) {
        EXPECT_TRUE(names.insert(hard_case.name).second) << hard_case.name;
    }
}

TEST(HardCase, OnlyWhatIsWantedIsAccepted) {
    const auto answers = [] { return right("so it is"); };
    const auto refuses = []() -> Outcome { throw std::invalid_argument("no"); };
    EXPECT_EQ(run_case(case_that(Wanted::answer, answers)).ending, Ending::right);
    EXPECT_EQ(run_case(case_that(Wanted::error, answers)).ending, Ending::wrong);
    EXPECT_EQ(run_case(case_that(Wanted::error, refuses)).ending, Ending::error);
    EXPECT_EQ(run_case(case_that(Wanted::answer, refuses)).ending, Ending::wrong);
    EXPECT_EQ(run_case(case_that(Wanted::answer_or_error, answers)).ending, Ending::right);
    EXPECT_EQ(run_case(case_that(Wanted::answer_or_error, refuses)).ending, Ending::error);
}

TEST(HardCase, WhatIsNoNumberOrNoRefusalIsWrong) {
    const auto not_a_number = [] {
        Outcome outcome = right("so it is");
        outcome.residual = std::nan("");
        return outcome;
    };
    const auto falls = []() -> Outcome { throw std::runtime_error("fell over"); };
    const auto rambles = []() -> Outcome { throw std::invalid_argument("one line\nand another"); };
    const auto breaks = []() -> Outcome {
        require(false, "it broke");
        return right("so it is");
    };
    EXPECT_EQ(run_case(case_that(Wanted::answer, not_a_number)).ending, Ending::wrong);
    EXPECT_EQ(run_case(case_that(Wanted::answer_or_error, falls)).ending, Ending::wrong);
    EXPECT_EQ(run_case(case_that(Wanted::answer_or_error, rambles)).ending, Ending::wrong);
    EXPECT_EQ(run_case(case_that(Wanted::answer_or_error, breaks)).ending, Ending::wrong);
}

class QuickCases : public testing::TestWithParam<std::pair<const char*, SpringForm>> {};

TEST_P(QuickCases, EndWell) {
    int ran = 0;
    const auto& [group, springs] = GetParam();
    for (const HardCase& hard_case : hard_cases(springs)) {
        if (hard_case.quick && hard_case.name.rfind(group, 0) == 0) {
            const Outcome outcome = run_case(hard_case);
            EXPECT_NE(outcome.ending, Ending::wrong) << hard_case.name << ": " << outcome.how;
            ++ran;
        }
    }
    EXPECT_GT(ran, 0);
}

INSTANTIATE_TEST_SUITE_P(HardCases, QuickCases, testing::ValuesIn([] {
                             std::vector<std::pair<const char*, SpringForm>> all;
                             for (const char* group : {"recovery", "shape", "precision", "long", "time step", "numbers",
                                                       "static", "solver"}) {
                                 all.emplace_back(group, SpringForm::nodes);
                                 all.emplace_back(group, SpringForm::means);
                             }
                             return all;
                         }()),
                         [](const auto& cases) {
                             std::string name = cases.param.first;
                             std::erase(name, ' ');
                             return name + (cases.param.second == SpringForm::means ? "_on_means" : "");
                         });

constexpr double kTolerance = 1e-4; // of a bisected stretch

double relative_stiffness(const Material& material, Stretching stretching, double stretch) {
    const auto wave = weakest_wave_at(material, stretching, stretch);
    EXPECT_TRUE(wave.has_value());
    return wave ? wave->relative_stiffness : NAN;
}

TEST(StabilityMap, SpringsAloneAreStableAtRest) {
    EXPECT_GT(relative_stiffness(map_material(0.25, 1, VolumeEnergy::automatic), Stretching::confined, 1), 0.1);
}

/// At rest no wave has less than none, whatever the material; without face diagonals some have none at all.
TEST(StabilityMap, RestIsNeverUnstable) {
    for (const double nu : kPoissonRatios) {
        for (const double ratio : kFaceDiagonalRatios) {
            const double stiffness =
                relative_stiffness(map_material(nu, ratio, VolumeEnergy::automatic), Stretching::dilation, 1);
            if (ratio > 0) {
                EXPECT_GT(stiffness, 0.01) << "nu = " << nu << ", A = " << ratio;
            } else {
                EXPECT_NEAR(stiffness, 0, 1e-9) << "nu = " << nu;
            }
        }
    }
}

/// Without face diagonals the least compression starts the checkerboard wave; held sides leave tension neutral.
TEST(StabilityMap, WithoutFaceDiagonalsCompressionIsLostAtOnce) {
    for (const Stretching stretching : kStretchings) {
        const StableRange range = stable_range(map_material(0.25, 0, VolumeEnergy::automatic), stretching);
        EXPECT_TRUE(range.low.reached);
        EXPECT_EQ(range.low.stretch, 1);
        EXPECT_FALSE(range.low.wave.is_long);
        EXPECT_EQ(range.high.reached, stretching == Stretching::bar); // whose sides contract
    }
}

/// On means no pattern of single cells grows first: the continuum's long waves do, with face diagonals or without.
TEST(StabilityMap, OnMeansLongWavesAreLostFirst) {
    for (const double nu : {0.0, 0.25, 0.49}) {
        for (const double ratio : {0.0, 1.0}) {
            const Material material = map_material(nu, ratio, VolumeEnergy::automatic, SpringForm::means);
            EXPECT_GT(relative_stiffness(material, Stretching::dilation, 1), 0.08);
            for (const Stretching stretching : {Stretching::bar, Stretching::confined}) {
                const StableRange range = stable_range(material, stretching);
                EXPECT_TRUE(range.low.wave.is_long) << "nu = " << nu << ", A = " << ratio << ", " << name(stretching);
                EXPECT_LT(range.low.stretch, ratio == 0 ? 0.67 : 0.69);
            }
        }
    }
}

/// Long longitudinal waves under uniform dilation by s: springs 3 G + 2 G t, t = 1 - 1/s, and kappa s^4 of the
/// quadratic energy. At nu = 0, kappa = -G: 5 - 2/s = s^4.
TEST(StabilityMap, QuadraticEnergyUnderDilationIsLostWhereItsClosedFormSays) {
    double s = 1.3;
    for (int n = 0; n < 60; ++n) { // a contraction
        s = std::pow(5 - 2 / s, 0.25);
    }
    for (const double ratio : {0.1, 1.0, 10.0}) {
        const StableRange range = stable_range(map_material(0, ratio, VolumeEnergy::quadratic), Stretching::dilation);
        EXPECT_TRUE(range.high.reached);
        EXPECT_TRUE(range.high.wave.is_long);
        EXPECT_NEAR(range.high.stretch, s, kTolerance);
    }
    EXPECT_NEAR(s, 1.372, 1e-3);
}

TEST(StabilityMap, MeanStretchIsStableUnderTensionBelowAQuarter) {
    for (const double nu : {-0.9, -0.5, 0.0}) {
        for (const double ratio : {0.1, 1.0, 10.0}) {
            for (const Stretching stretching : kStretchings) {
                const StableRange range = stable_range(map_material(nu, ratio, VolumeEnergy::mean_stretch), stretching);
                EXPECT_FALSE(range.high.reached) << "nu = " << nu << ", A = " << ratio << ", " << name(stretching);
            }
        }
    }
}

/// A free bar with the quadratic energy has no equilibrium at +20 % for nu = 0 and at +5 % for nu = -0.5.
TEST(StabilityMap, QuadraticEnergyHoldsNoBarBelowAQuarter) {
    for (const auto& [nu, stretch] : {std::pair(0.0, 1.2), std::pair(-0.5, 1.05)}) {
        const Material quadratic = map_material(nu, 1, VolumeEnergy::quadratic);
        EXPECT_FALSE(stretches(quadratic, Stretching::bar, stretch).has_value());
        EXPECT_TRUE(stretches(quadratic, Stretching::bar, 1 + 0.8 * (stretch - 1)).has_value());
        EXPECT_TRUE(stretches(map_material(nu, 1, VolumeEnergy::mean_stretch), Stretching::bar, stretch).has_value());
    }
}

/// A little stretch moves the sides of a bar by -nu of it.
TEST(StabilityMap, FreeSidesFollowPoissonsRatio) {
    for (const double nu : kPoissonRatios) {
        const auto diagonal = stretches(map_material(nu, 1, VolumeEnergy::automatic), Stretching::bar, 1 + 1e-6);
        ASSERT_TRUE(diagonal.has_value());
        EXPECT_NEAR((*diagonal)[0] - 1, -nu * 1e-6, 1e-10);
        EXPECT_NEAR((*diagonal)[2] - 1, -nu * 1e-6, 1e-10);
    }
}

TEST(IntegratorOrder, IsTheTextbooksOne) {
    for (const IntegratorStudy& study : study_integrators()) {
        const double order = study.integrator == "leapfrog" ? 2 : 1;
        EXPECT_NEAR(study.observed_order(), order, 0.05) << study.integrator;
        const auto [least, greatest] = std::minmax_element(study.energies.begin(), study.energies.end());
        if (study.integrator == "backward Euler") {
            EXPECT_TRUE(std::is_sorted(study.energies.rbegin(), study.energies.rend()));
            EXPECT_LT(*least, 0.1);
        } else {
            // 1 +- omega dt / 2 with 40 steps a period, leapfrog's square of that
            EXPECT_GT(*least, order == 2 ? 0.99 : 0.9);
            EXPECT_LT(*greatest, order == 2 ? 1.01 : 1.1);
        }
    }
}

} // namespace
} // namespace hybmss::stability
