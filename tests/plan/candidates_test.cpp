// What the tuner may choose among, and that every choice is right.

#include "app/verify/verify.hpp"
#include "hybmss/explicit_dynamics.hpp"
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
#include <set>

namespace hybmss {
namespace {

Material full_material() {
    Material material;
    material.poisson_ratio = 0.4;
    return material;
}

TEST(Candidates, NamesReadBack) {
    for (const std::string text :
         {"flat-rows/avx512/fast/threads:1", "a/b/neon/exact/threads:64", "a/sse2/fast/threads:2/tile:4096",
          "a/avx2/exact/threads:1/split", "a/avx2/fast/threads:3/tile:1/split"}) {
        const auto candidate = parse_candidate(text);
        ASSERT_TRUE(candidate) << text;
        EXPECT_EQ(name(*candidate), text);
    }
    for (const std::string text :
         {"", "flat-rows", "/avx2/fast/threads:1", "a/mmx/fast/threads:1", "a/automatic/fast/threads:1",
          "a/avx2/slow/threads:1", "a/avx2/fast/threads:0", "a/avx2/fast/threads:2x", "a/avx2/fast/2",
          "a/avx2/fast/threads:99999999999", "a/avx2/fast/threads:1/tile:0", "a/avx2/fast/threads:1/tile:x",
          "a/avx2/fast/threads:1/split/tile:8", "a/avx2/fast/tile:8", "a/avx2/fast/threads:1/fused", "split",
          "tile:8"}) {
        EXPECT_FALSE(parse_candidate(text)) << text;
    }
}

TEST(Candidates, TheFirstIsTheEstimate) {
    const Lattice lattice = Lattice::box(24, 20, 22, 0.1);
    PlanOptions options;
    options.threads = 3;
    const Candidate first =
        candidates(lattice_layouts(), options, lattice.grid_node_count(), Operation::forces).front();
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
    EXPECT_EQ(candidates(layouts, options, kNodes, Operation::step).size(), 2 * sets * 2 * 2);
    const auto all_have = [&](const auto& holds) {
        const std::vector<Candidate> list = candidates(layouts, options, kNodes, Operation::step);
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
    EXPECT_EQ(candidates(layouts, options, kNodes, Operation::step).size(), 1u);

    options = {};
    const testing::Variable forced("HYBMSS_ISA", std::string(name(available_instruction_sets().front())).c_str());
    EXPECT_TRUE(all_have([](const Candidate& c) { return c.instruction_set == available_instruction_sets().front(); }));
}

TEST(Candidates, TilesAndIntegrationWhereALayoutHasThem) {
    PlanOptions options;
    options.threads = 2;
    options.accuracy = Accuracy::exact;
    options.instruction_set = available_instruction_sets().front();
    const auto names = [&](std::size_t nodes, Operation operation) {
        std::vector<std::string> texts;
        for (const Candidate& c : candidates(lattice_layouts(), options, nodes, operation)) {
            const std::string text = name(c);
            texts.push_back(c.layout + text.substr(text.find("/threads")));
        }
        return texts;
    };
    options.layout = "flat-rows";
    EXPECT_EQ(names(40000, Operation::step),
              (std::vector<std::string>{"flat-rows/threads:2", "flat-rows/threads:2/tile:4096",
                                        "flat-rows/threads:2/split", "flat-rows/threads:1",
                                        "flat-rows/threads:1/tile:4096", "flat-rows/threads:1/tile:32768",
                                        "flat-rows/threads:1/tile:262144", "flat-rows/threads:1/split"}));
    // Forces alone integrate nothing; one tile is one tile, by whatever name.
    EXPECT_EQ(names(2000, Operation::forces),
              (std::vector<std::string>{"flat-rows/threads:1", "flat-rows/threads:1/tile:4096"}));
    options.layout = "coloured-soa";
    EXPECT_EQ(names(2000, Operation::step), (std::vector<std::string>{"coloured-soa/threads:1"}));
    options.layout = "network";
    EXPECT_EQ(names(2000, Operation::step),
              (std::vector<std::string>{"network/threads:1", "network/threads:1/tile:4096"}));
    // What the caller fixed, stays.
    options.tile_nodes = 500;
    options.integration = Integration::split;
    options.layout = "active-rows";
    EXPECT_EQ(names(2000, Operation::step), (std::vector<std::string>{"active-rows/threads:1/tile:500/split"}));
    options.layout = "";
    options.integration = Integration::fused;
    EXPECT_EQ(names(2000, Operation::step),
              (std::vector<std::string>{"flat-rows/threads:1/tile:500", "active-rows/threads:1/tile:500"}));
}

// ---- every candidate is right

/// Draws plans by rising seeds until every candidate has come up, each checked against the reference.
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
    options.effort = Effort::random;
    options.threads = 2;
    std::set<std::string> left;
    for (const Candidate& c : candidates(as_network ? network_layouts() : lattice_layouts(), options,
                                         as_network ? n : lattice.grid_node_count(), Operation::forces)) {
        left.insert(name(c));
    }
    ASSERT_GE(left.size(), 2u);
    for (options.random_seed = 1; !left.empty() && options.random_seed < 2000; ++options.random_seed) {
        const ForcePlan<T> plan =
            as_network ? ForcePlan<T>(network, options) : ForcePlan<T>(lattice, material, options);
        const PlanDescription d = plan.describe();
        EXPECT_EQ(d.effort, Effort::random);
        const std::string picked = name(candidate_of(d.choice));
        if (left.erase(picked) == 0) {
            continue;
        }
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
        key.layout = as_network ? "network" : d.choice.layout;
        key.precision = precision;
        key.strain = 0.1;
        EXPECT_LE(error / scale / verify::epsilon(precision), verify::tolerance(key)) << picked;
    }
    EXPECT_TRUE(left.empty()) << "never drawn: " << *left.begin();
}

TEST(RandomPlans, EveryLatticeCandidateAgreesWithTheReference) {
    testing::Random random(11);
    const Lattice lattice = testing::random_lattice(15, 13, 14, 0.5, random);
    expect_all_candidates_right<float>(lattice, false, "float");
    expect_all_candidates_right<double>(lattice, false, "double");
}

TEST(RandomPlans, EveryNetworkCandidateAgreesWithTheReference) {
    testing::Random random(12);
    const Lattice lattice = testing::random_lattice(15, 13, 14, 0.5, random);
    expect_all_candidates_right<float>(lattice, true, "float");
    expect_all_candidates_right<double>(lattice, true, "double");
}

} // namespace
} // namespace hybmss
