// How the tuner decides. Nothing here asserts a time: rounds run on clocks that the tests make.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/wisdom.hpp"
#include "plan/tuning/candidates.hpp"
#include "plan/tuning/planned_body.hpp"
#include "plan/tuning/tuner.hpp"
#include "plan/tuning/wisdom_store.hpp"
#include "tests/environment.hpp"
#include "tests/moving_body.hpp"
#include "tests/random_bodies.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybmss {
namespace {

using testing::expect_refusal;

Material full_material() {
    Material material;
    material.poisson_ratio = 0.4;
    return material;
}

// ---- timing on clocks of the tests' own

TEST(TimingInRounds, TheFastestIsFoundThroughTheMachinesMoods) {
    double now = 0;
    const auto trial = [&](double seconds_a_step) {
        return Trial([&now, seconds_a_step](long steps) {
            const double mood = static_cast<long>(now / 0.037) % 2 == 0 ? 1.5 : 1.0;
            const double elapsed = static_cast<double>(steps) * seconds_a_step * mood;
            now += elapsed;
            return elapsed;
        });
    };
    const auto results = time_in_rounds({trial(1.1e-4), trial(1e-4), trial(1.2e-4)}, 2.0, 5e-3);
    ASSERT_EQ(results.size(), 3u);
    EXPECT_NEAR(results[1].seconds_a_step, 1e-4, 2e-6);
    EXPECT_LT(results[1].seconds_a_step, results[0].seconds_a_step);
    EXPECT_LT(results[0].seconds_a_step, results[2].seconds_a_step);
}

TEST(TimingInRounds, DropsThoseFarBehindAndSpendsNoMoreOnThem) {
    double on_slow = 0, on_fast = 0;
    const auto trial = [](double seconds_a_step, double& spent) {
        return Trial([seconds_a_step, &spent](long steps) {
            spent += static_cast<double>(steps) * seconds_a_step;
            return static_cast<double>(steps) * seconds_a_step;
        });
    };
    double on_middle = 0;
    const auto results =
        time_in_rounds({trial(1e-4, on_fast), trial(1.3e-4, on_slow), trial(1.2e-4, on_middle)}, 1.0, 5e-3);
    EXPECT_TRUE(results[0].finalist);
    EXPECT_FALSE(results[1].finalist);
    EXPECT_TRUE(results[2].finalist);
    EXPECT_LT(on_slow, 0.03);
    EXPECT_GT(on_fast, 0.3);
    EXPECT_LT(on_fast + on_slow + on_middle, 1.05);
}

TEST(TimingInRounds, StepsThatOutlastTheBudgetEndIt) {
    int calls = 0;
    const auto slow = [&](long steps) {
        ++calls;
        return 10.0 * static_cast<double>(steps);
    };
    EXPECT_EQ(time_in_rounds({slow, slow}, 0.3, 5e-3).size(), 2u);
    EXPECT_EQ(calls, 2 * (1 + 3)); // to warm up, and three rounds
}

// ---- samples

TEST(Samples, ALatticesWindowIsFilledLikeTheWhole) {
    Lattice lattice = Lattice::box(40, 30, 5, 0.1);
    for (int i = 10; i < 40; ++i) { // the lowest quarter along x is full, the rest is empty
        for (int j = 0; j < 30; ++j) {
            for (int k = 0; k < 5; ++k) {
                lattice.set_cell_scale(i, j, k, 0.0f);
            }
        }
    }
    const Lattice sample = sample_of(lattice, 1600);
    EXPECT_LE(sample.grid_node_count(), 1600u);
    EXPECT_GT(sample.grid_node_count(), 1200u);
    EXPECT_EQ(sample.cells()[2], 5);
    EXPECT_GT(sample.cell_count(), 0u) << "the window in the middle is empty, that at the end is not";
    EXPECT_EQ(sample_of(lattice, 1000000).cells(), lattice.cells());

    std::vector<float> scales(100 * 100, 0.0f);
    scales[3 * 100 + 30] = 2.0f; // in none of the windows at the ends and in the middle
    const Lattice speck = sample_of(Lattice::from_cells(100, 1, 100, 0.1, scales), 400);
    EXPECT_EQ(speck.cell_count(), 1u);
    EXPECT_LE(speck.grid_node_count(), 400u);
}

TEST(Samples, ANetworksPieceIsAValidNetwork) {
    const Network network = Network::from_lattice(Lattice::box(6, 5, 20, 0.1), full_material());
    const std::size_t layer = 7 * 6;
    const Network sample = sample_of(network, 11 * layer);
    validate(sample);
    const Network expected = Network::from_lattice(Lattice::box(6, 5, 10, 0.1), full_material());
    EXPECT_EQ(sample.masses.size(), expected.masses.size());
    EXPECT_EQ(sample.cells.size(), expected.cells.size());
    EXPECT_EQ(sample.springs.size(), expected.springs.size());
}

// ---- efforts

TEST(Efforts, NamesReadBack) {
    for (const Effort effort : {Effort::estimate, Effort::measure, Effort::stored}) {
        EXPECT_EQ(parse_effort(name(effort)), effort);
    }
    expect_refusal([] { parse_effort("patient"); },
                   {"effort \"patient\" is not known: it must be one of estimate, measure, stored"});
}

TEST(Efforts, MeasuringFillsWisdomThatStoredReads) {
    const Lattice lattice = Lattice::box(8, 8, 8, 0.1);
    Wisdom wisdom;
    PlanOptions options;
    options.effort = Effort::stored;
    expect_refusal([&] { ForcePlan<float>(lattice, full_material(), options); },
                   {"effort = stored is not allowed without wisdom"});
    options.wisdom = &wisdom;
    expect_refusal([&] { ForcePlan<float>(lattice, full_material(), options); },
                   {"effort = stored: none of the 0 entries of the wisdom fits \"forces lattice float", "hybmss tune"});

    options.effort = Effort::measure;
    options.measure_seconds = 0.02;
    const PlanDescription measured = ForcePlan<float>(lattice, full_material(), options).describe();
    EXPECT_EQ(wisdom.entries(), 1u);
    EXPECT_EQ(measured.effort, Effort::measure);
    EXPECT_NE(measured.reason.find("measured now"), std::string::npos) << measured.reason;
    const std::vector<Candidate> all =
        candidates(layouts_to_try(lattice, full_material()), options, lattice.grid_node_count());
    EXPECT_EQ(measured.candidates.size(), all.size());
    for (const CandidateFigure& figure : measured.candidates) {
        EXPECT_GT(figure.ns_per_cell_step, 0) << figure.name;
    }
    // Measured once, known for ever: the same choice, and nothing is timed again.
    const PlanDescription again = ForcePlan<float>(lattice, full_material(), options).describe();
    EXPECT_NE(again.reason.find("wisdom for this class"), std::string::npos) << again.reason;
    options.effort = Effort::stored;
    const PlanDescription stored = ForcePlan<float>(lattice, full_material(), options).describe();
    for (const PlanDescription& d : {again, stored}) {
        EXPECT_EQ(d.choice.layout, measured.choice.layout);
        EXPECT_EQ(d.choice.instruction_set, measured.choice.instruction_set);
        EXPECT_EQ(d.choice.accuracy, measured.choice.accuracy);
        EXPECT_EQ(d.choice.threads, measured.choice.threads);
    }
    // Another operation, precision or wish is another question.
    EXPECT_THROW(ExplicitDynamics<float>(lattice, full_material(), options), std::invalid_argument);
    EXPECT_THROW(ForcePlan<double>(lattice, full_material(), options), std::invalid_argument);
    options.accuracy = Accuracy::exact;
    EXPECT_THROW(ForcePlan<float>(lattice, full_material(), options), std::invalid_argument);
}

TEST(Efforts, MeasuringRespectsWhatIsFixed) {
    const Lattice lattice = Lattice::box(6, 5, 7, 0.1);
    PlanOptions options;
    options.effort = Effort::measure;
    options.measure_seconds = 0.01;
    options.layout = "network";
    options.instruction_set = available_instruction_sets().front();
    options.threads = 1;
    const PlanDescription d = ExplicitDynamics<double>(lattice, full_material(), options).describe();
    EXPECT_EQ(d.choice.layout, "network");
    EXPECT_EQ(d.instruction_set, options.instruction_set);
    EXPECT_EQ(d.threads, 1);
    for (const CandidateFigure& figure : d.candidates) {
        EXPECT_TRUE(figure.name.starts_with("network/" + std::string(name(options.instruction_set)))) << figure.name;
        EXPECT_TRUE(figure.name.ends_with("/threads:1") || figure.name.ends_with("/threads:1/one-tile")) << figure.name;
    }
}

TEST(Efforts, ALargeBodyIsScreenedFirst) {
    const Lattice lattice = Lattice::box(25, 20, 22, 0.1);
    PlanOptions options;
    options.effort = Effort::measure;
    options.measure_seconds = 0.02;
    options.threads = 2;
    const PlanDescription d = ExplicitDynamics<float>(lattice, full_material(), options).describe();
    const auto find = [&](const std::string& text) {
        return std::count_if(d.candidates.begin(), d.candidates.end(),
                             [&](const CandidateFigure& figure) { return figure.name == text; });
    };
    for (const Candidate& c :
         candidates(layouts_to_try(lattice, full_material()), options, lattice.grid_node_count())) {
        Candidate single = c;
        single.threads = 1;
        EXPECT_EQ(find(name(single)), 1) << "timed at least on the small piece, and told once: " << name(single);
    }
    EXPECT_EQ(find(name(candidate_of(d.choice))), 1);
}

TEST(Efforts, WhatReplacesTheFixedChoiceMustWinTwice) {
    // Far apart, so that a busy machine makes none of them another.
    const Lattice small = Lattice::box(2, 2, 2, 0.1), medium = Lattice::box(16, 16, 16, 0.1),
                  large = Lattice::box(40, 40, 40, 0.1);
    for (const bool wins_again : {true, false}) {
        int made = 0;
        const auto make = [&](const PlanOptions& options) {
            const bool is_fixed = options.layout == "flat-rows";
            return make_body<float>(is_fixed                    ? medium
                                    : made++ == 0 || wins_again ? small
                                                                : large,
                                    full_material(), options);
        };
        const TunerSubject<float> subject{"", {}, medium.grid_node_count(), medium.cell_count(), make, {}};
        PlanOptions options;
        options.measure_seconds = 0.1;
        const InstructionSet best = available_instruction_sets().back();
        const WisdomEntry entry =
            measure(subject, {{"flat-rows", best, Accuracy::accurate}, {"active-rows", best, Accuracy::accurate}},
                    options, Operation::step);
        EXPECT_EQ(entry.choice.layout, wins_again ? "active-rows" : "flat-rows");
        EXPECT_EQ(made, 2);
    }
}

TEST(Efforts, WisdomThatNamesNoCandidateIsNotTrusted) {
    const testing::Variable unforced("HYBMSS_ISA", nullptr);
    const Lattice lattice = Lattice::box(5, 5, 5, 0.1);
    Wisdom wisdom;
    PlanOptions options;
    options.threads = 1;
    const std::string key = "step " + body_class<float>(lattice, full_material()) + " " + wish_class(options);
    options.wisdom = &wisdom;
    options.effort = Effort::stored;
    WisdomEntry entry{{"network", available_instruction_sets().front(), Accuracy::exact, 1}, {}};
    if (available_instruction_sets().size() < 3) { // the weakest of three is no candidate
        entry.choice.layout = "spaghetti";
    }
    WisdomStore::put(wisdom, key, entry);
    EXPECT_THROW(ExplicitDynamics<float>(lattice, full_material(), options), std::invalid_argument);
    // And one that does is taken as it stands.
    entry.choice.layout = "network";
    entry.choice.instruction_set = available_instruction_sets().back();
    WisdomStore::put(wisdom, key, entry);
    const PlanDescription d = ExplicitDynamics<float>(lattice, full_material(), options).describe();
    EXPECT_EQ(d.choice.layout, "network");
    EXPECT_EQ(d.choice.accuracy, Accuracy::exact);
    // More threads than are of use to this body are cut.
    entry.choice.threads = 7;
    WisdomStore::put(wisdom, key, entry);
    EXPECT_EQ(ExplicitDynamics<float>(lattice, full_material(), options).describe().threads, 1);
}

TEST(Efforts, BadOptionsAreRefusedAtEveryEffort) {
    const Lattice lattice = Lattice::box(3, 3, 3, 0.1);
    for (const Effort effort : {Effort::estimate, Effort::measure, Effort::stored}) {
        Wisdom wisdom;
        PlanOptions options;
        options.effort = effort;
        options.wisdom = &wisdom;
        options.layout = "spaghetti";
        expect_refusal([&] { ForcePlan<float>(lattice, Material{}, options); }, {"layout \"spaghetti\" is not known"});
        Material bad;
        bad.poisson_ratio = 0.5;
        options.layout = "";
        expect_refusal([&] { ForcePlan<float>(lattice, bad, options); }, {"poisson_ratio = 0.5 is not allowed"});
    }
    PlanOptions options;
    options.effort = Effort::measure;
    options.measure_seconds = -1;
    expect_refusal([&] { ForcePlan<float>(lattice, Material{}, options); },
                   {"measure_seconds = -1 is not allowed: it must be finite and above 0"});
}

/// Layouts that lost were taken out: who names one is told the others, and wisdom that names one says nothing.
TEST(Efforts, ALayoutThatIsNoMoreIsRefused) {
    const Lattice lattice = Lattice::box(5, 5, 5, 0.1);
    const Network network = Network::from_lattice(lattice, full_material());
    PlanOptions options;
    options.threads = 1;
    const std::string key = "step " + body_class<float>(lattice, full_material()) + " " + wish_class(options);
    for (const std::string gone : {"gather-rows", "aos"}) {
        PlanOptions named;
        named.layout = gone;
        const std::string unknown = "layout \"" + gone + "\" is not known for this body: it must be one of ";
        expect_refusal([&] { ExplicitDynamics<float>(lattice, full_material(), named); },
                       {(unknown + "flat-rows, active-rows, network").c_str()});
        expect_refusal([&] { ExplicitDynamics<float>(network, named); },
                       {(unknown + "packed-xyzw, coloured-soa").c_str()});
        Wisdom wisdom;
        WisdomStore::put(wisdom, key, {{gone, available_instruction_sets().back(), Accuracy::exact, 1}, {}});
        options.wisdom = &wisdom;
        options.effort = Effort::stored;
        expect_refusal([&] { ExplicitDynamics<float>(lattice, full_material(), options); },
                       {"effort = stored: none of the 1 entries of the wisdom fits"});
        options.effort = Effort::measure;
        options.measure_seconds = 0.01;
        const PlanDescription d = ExplicitDynamics<float>(lattice, full_material(), options).describe();
        EXPECT_NE(d.reason.find("measured now"), std::string::npos) << d.reason;
        EXPECT_NE(d.layout, gone);
    }
}

TEST(Efforts, TheChoiceMakesTheSamePlanAgain) {
    const Lattice lattice = Lattice::box(9, 8, 7, 0.1);
    PlanOptions options;
    options.threads = 2;
    for (const Candidate& candidate : candidates(distinct_lattice_layouts(), options, lattice.grid_node_count())) {
        ExplicitDynamics<float> first(lattice, full_material(), fixed_options(options, candidate));
        ExplicitDynamics<float> second(lattice, full_material(), first.describe().choice);
        const StepParameters step{0.3 * first.critical_time_step(), {0, -1, 0}, 1};
        EXPECT_EQ(second.describe().kernel, first.describe().kernel);
        EXPECT_EQ(testing::bits_after(first, 0.1, step, 5), testing::bits_after(second, 0.1, step, 5));
    }
}

} // namespace
} // namespace hybmss
