// What the tuner may choose among, and that every choice is right.

#include "app/verify/verify.hpp"
#include "hybmss/force_plan.hpp"
#include "plan/tuning/candidates.hpp"
#include "plan/tuning/planned_body.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/environment.hpp"
#include "tests/moving_body.hpp"
#include "tests/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

namespace hybmss {
namespace {

Material full_material() {
    Material material;
    material.poisson_ratio = 0.4;
    return material;
}

TEST(Candidates, NamesReadBack) {
    for (const std::string text :
         {"flat-rows/avx512/fast/threads:1", "a/b/neon/exact/threads:64", "a/sse2/fast/threads:1/one-tile"}) {
        const auto candidate = parse_candidate(text);
        ASSERT_TRUE(candidate) << text;
        EXPECT_EQ(name(*candidate), text);
    }
    for (const std::string text :
         {"", "flat-rows", "/avx2/fast/threads:1", "a/mmx/fast/threads:1", "a/automatic/fast/threads:1",
          "a/avx2/slow/threads:1", "a/avx2/fast/threads:0", "a/avx2/fast/threads:2x", "a/avx2/fast/2",
          "a/avx2/fast/threads:99999999999", "a/avx2/fast/threads:1/more", "threads:1", "/one-tile",
          "a/avx2/fast/one-tile/threads:1"}) {
        EXPECT_FALSE(parse_candidate(text)) << text;
    }
}

TEST(Candidates, TheFirstIsTheEstimate) {
    const Lattice lattice = Lattice::box(24, 20, 22, 0.1);
    PlanOptions options;
    options.threads = 3;
    const Candidate first = candidates(lattice_layouts(), options, lattice.grid_node_count()).front();
    const PlanDescription estimate = ForcePlan<float>(lattice, full_material(), options).describe();
    EXPECT_EQ(first.layout, estimate.layout);
    EXPECT_EQ(first.instruction_set, estimate.instruction_set);
    EXPECT_EQ(first.threads, estimate.threads);
    EXPECT_EQ(first.accuracy, Accuracy::accurate);
}

TEST(Candidates, WhatTheCallerFixedStays) {
    const std::vector<std::string> layouts = {"a", "b"};
    constexpr std::size_t kNodes = 1000000;
    const testing::Variable unforced("HYBMSS_ISA", nullptr);
    PlanOptions options;
    options.threads = 2;
    const std::size_t sets = std::min<std::size_t>(2, available_instruction_sets().size());
    EXPECT_EQ(candidates(layouts, options, kNodes).size(), 2 * sets * 2 * 2);
    const auto all_have = [&](const auto& holds) {
        const std::vector<Candidate> list = candidates(layouts, options, kNodes);
        return !list.empty() && std::all_of(list.begin(), list.end(), holds);
    };
    options.layout = "b";
    EXPECT_TRUE(all_have([](const Candidate& c) { return c.layout == "b"; }));
    options.accuracy = Accuracy::exact;
    EXPECT_TRUE(all_have([](const Candidate& c) { return c.accuracy == Accuracy::exact; }));
    options.threads = 1;
    EXPECT_TRUE(all_have([](const Candidate& c) { return c.threads == 1; }));
    options.instruction_set = available_instruction_sets().front();
    EXPECT_TRUE(all_have([&](const Candidate& c) { return c.instruction_set == options.instruction_set; }));
    EXPECT_EQ(candidates(layouts, options, kNodes).size(), 1u);

    options = {};
    const testing::Variable forced("HYBMSS_ISA", std::string(name(available_instruction_sets().front())).c_str());
    EXPECT_TRUE(all_have([](const Candidate& c) { return c.instruction_set == available_instruction_sets().front(); }));
}

TEST(Candidates, AreAllCombinationsOfWhatIsLeftOpen) {
    PlanOptions options;
    options.threads = 5;
    options.accuracy = Accuracy::exact;
    options.instruction_set = available_instruction_sets().front();
    const std::string middle = "/" + std::string(name(options.instruction_set)) + "/exact/threads:";
    std::vector<std::string> names, expected;
    for (const Candidate& c : candidates({"a", "b"}, options, 1000000)) {
        names.push_back(name(c));
    }
    for (const std::string layout : {"a", "b"}) {
        for (const std::string threads : {"5", "1", "2", "3", "4"}) {
            expected.push_back(layout + middle + threads);
        }
    }
    EXPECT_EQ(names, expected);
}

TEST(Candidates, OneTileWhereALayoutHasTiles) {
    PlanOptions options;
    options.threads = 2;
    options.accuracy = Accuracy::exact;
    options.instruction_set = available_instruction_sets().front();
    const auto names = [&](const std::string& layout) {
        std::vector<std::string> texts;
        for (const Candidate& c : candidates({layout}, options, 40000)) {
            texts.push_back(name(c).substr(name(c).find("threads")));
        }
        return texts;
    };
    using Names = std::vector<std::string>;
    EXPECT_EQ(names("flat-rows"), (Names{"threads:2", "threads:1", "threads:1/one-tile"}));
    EXPECT_EQ(names("network"), (Names{"threads:2", "threads:1", "threads:1/one-tile"}));
    EXPECT_EQ(names("coloured-soa"), (Names{"threads:2", "threads:1"}));
    options.one_tile = true; // what the caller fixed, stays
    EXPECT_EQ(names("flat-rows"), Names{"threads:1/one-tile"});
    EXPECT_EQ(names("coloured-soa"), Names{"threads:1"});
}

// ---- every candidate is right

template <class T>
void expect_all_candidates_right(const Lattice& lattice, bool as_network, const char* precision) {
    const Material material = full_material();
    const Network network = Network::from_lattice(lattice, material);
    const reference::Body body = reference::assemble(lattice, material);
    const std::size_t n = body.rest.size();
    const std::vector<T> u = testing::random_field<T>(n, 0.1 * lattice.cell_size(), 5);
    std::vector<reference::Vector3d> displacements(n);
    for (std::size_t i = 0; i < n; ++i) {
        displacements[i] = {static_cast<double>(u[3 * i]), static_cast<double>(u[3 * i + 1]),
                            static_cast<double>(u[3 * i + 2])};
    }
    const std::vector<reference::Vector3d> expected = reference::forces(body, displacements);
    const std::vector<double> scales = reference::force_scale(body, displacements);
    const double scale = *std::max_element(scales.begin(), scales.end());

    PlanOptions options;
    options.threads = 2;
    const std::vector<Candidate> all = candidates(as_network ? network_layouts() : distinct_lattice_layouts(), options,
                                                  as_network ? n : lattice.grid_node_count());
    ASSERT_GE(all.size(), 2u);
    for (const Candidate& candidate : all) {
        const PlanOptions fixed = fixed_options(options, candidate);
        const ForcePlan<T> plan = as_network ? ForcePlan<T>(network, fixed) : ForcePlan<T>(lattice, material, fixed);
        ASSERT_EQ(candidate_of(plan.describe().choice), candidate);
        EXPECT_EQ(plan.describe().layout, candidate.layout);
        std::vector<T> f(3 * n, T(0));
        plan.add_forces(VectorField<const T>::aos(u.data(), n), VectorField<T>::aos(f.data(), n));
        double error = 0;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t a = 0; a < 3; ++a) {
                error = std::max(
                    error, std::abs(static_cast<double>(f[3 * i + a]) - expected[i][static_cast<Eigen::Index>(a)]));
            }
        }
        verify::RowKey key;
        key.check = "forces";
        key.layout = as_network ? "network" : candidate.layout;
        key.precision = precision;
        key.strain = 0.1;
        EXPECT_LE(error / scale / verify::epsilon(precision), verify::tolerance(key)) << name(candidate);
    }
}

TEST(Candidates, EveryLatticeCandidateAgreesWithTheReference) {
    testing::Random random(11);
    const Lattice lattice = testing::random_lattice(15, 13, 14, 0.5, random);
    expect_all_candidates_right<float>(lattice, false, "float");
    expect_all_candidates_right<double>(lattice, false, "double");
}

TEST(Candidates, EveryNetworkCandidateAgreesWithTheReference) {
    testing::Random random(12);
    const Lattice lattice = testing::random_lattice(15, 13, 14, 0.5, random);
    expect_all_candidates_right<float>(lattice, true, "float");
    expect_all_candidates_right<double>(lattice, true, "double");
}

} // namespace
} // namespace hybmss
