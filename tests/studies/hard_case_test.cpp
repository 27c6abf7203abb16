// The quick hard cases, and that the suite's own judgement can fail.
#include "studies/stability/hard_case.hpp"

#include <gtest/gtest.h>

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
    for (const HardCase& hard_case : hard_cases()) {
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

class QuickCases : public testing::TestWithParam<const char*> {};

TEST_P(QuickCases, EndWell) {
    int ran = 0;
    for (const HardCase& hard_case : hard_cases()) {
        if (hard_case.quick && hard_case.name.rfind(GetParam(), 0) == 0) {
            const Outcome outcome = run_case(hard_case);
            EXPECT_NE(outcome.ending, Ending::wrong) << hard_case.name << ": " << outcome.how;
            ++ran;
        }
    }
    EXPECT_GT(ran, 0);
}

INSTANTIATE_TEST_SUITE_P(HardCases, QuickCases,
                         testing::Values("recovery", "shape", "precision", "long", "time step", "numbers", "static",
                                         "solver"),
                         [](const auto& group) {
                             std::string name = group.param;
                             std::erase(name, ' ');
                             return name;
                         });

} // namespace
} // namespace hybmss::stability
