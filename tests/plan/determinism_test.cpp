// The same bits for any number of threads, and, with exact kernels, for any machine.

#include "tests/moving_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace hybmss {
namespace {

/// Eight slabs, and nodes enough for eight threads.
Lattice eight_slabs() {
    return Lattice::box(20, 20, 32, 0.25);
}
/// A bar whose planes are normal to y.
Lattice lying_bar() {
    return Lattice::box(9, 16, 120, 0.25);
}

#ifdef __SANITIZE_THREAD__
constexpr long kSteps = 20; // minutes otherwise, and a race shows in few
#else
constexpr long kSteps = 200;
#endif

template <class T>
std::uint64_t bits(const Lattice& lattice, const PlanOptions& options, long steps, int expected_threads,
                   SpringForm springs = SpringForm::nodes) {
    Material material;
    material.poisson_ratio = 0.4;
    material.springs = springs;
    ExplicitDynamics<T> body(lattice, material, options);
    EXPECT_EQ(body.describe().threads, expected_threads);
    EXPECT_EQ(body.describe().instruction_set, options.instruction_set);
    const StepParameters step{0.5 * body.critical_time_step(), {0, -9.81, 0}, 0.3};
    return testing::bits_after(body, lattice.cell_size(), step, steps);
}

template <class T>
struct Determinism : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Determinism, Precisions);

TYPED_TEST(Determinism, ThreadsDoNotChangeABitOfALattice) {
    for (InstructionSet set : available_instruction_sets()) {
        PlanOptions options;
        options.instruction_set = set;
        options.threads = 1;
        const std::uint64_t one = bits<TypeParam>(eight_slabs(), options, 5 * kSteps, 1);
        for (int threads : {2, 3, 8}) {
            options.threads = threads;
            EXPECT_EQ(bits<TypeParam>(eight_slabs(), options, 5 * kSteps, threads), one) << name(set) << " " << threads;
        }
    }
}

TYPED_TEST(Determinism, ThreadsDoNotChangeABitOfActiveRows) {
    PlanOptions options;
    options.instruction_set = available_instruction_sets().back();
    options.layout = "active-rows";
    options.threads = 1;
    const std::uint64_t one = bits<TypeParam>(eight_slabs(), options, kSteps, 1);
    for (int threads : {2, 3, 8}) {
        options.threads = threads;
        EXPECT_EQ(bits<TypeParam>(eight_slabs(), options, kSteps, threads), one) << threads;
    }
}

TYPED_TEST(Determinism, ThreadsDoNotChangeABitOfTissues) {
    Lattice lattice = eight_slabs();
    std::vector<std::uint8_t> of_cells(lattice.cell_scales().size());
    for (std::size_t c = 0; c < of_cells.size(); ++c) {
        of_cells[c] = static_cast<std::uint8_t>(c % 7 / 3);
    }
    lattice.set_tissues({{0.1, 2000}, {0.49, 500}}, std::move(of_cells));
    PlanOptions options;
    options.instruction_set = available_instruction_sets().back();
    options.threads = 1;
    const std::uint64_t one = bits<TypeParam>(lattice, options, kSteps, 1);
    for (int threads : {2, 3, 8}) {
        options.threads = threads;
        EXPECT_EQ(bits<TypeParam>(lattice, options, kSteps, threads), one) << threads;
    }
}

TYPED_TEST(Determinism, ThreadsDoNotChangeABitOfALyingBar) {
    PlanOptions options;
    options.instruction_set = available_instruction_sets().back();
    options.threads = 1;
    const std::uint64_t one = bits<TypeParam>(lying_bar(), options, kSteps, 1);
    for (int threads : {2, 3, 8}) {
        options.threads = threads;
        EXPECT_EQ(bits<TypeParam>(lying_bar(), options, kSteps, threads), one) << threads;
    }
}

TYPED_TEST(Determinism, ThreadsDoNotChangeABitOfANetwork) {
    for (const std::string& layout : network_layouts()) {
        for (InstructionSet set : available_instruction_sets()) {
            for (SpringForm form : {SpringForm::nodes, SpringForm::means}) {
                PlanOptions options;
                options.layout = layout;
                options.instruction_set = set;
                options.threads = 1;
                const std::uint64_t one = bits<TypeParam>(eight_slabs(), options, kSteps / 2, 1, form);
                for (int threads : {2, 3, 8}) {
                    options.threads = threads;
                    EXPECT_EQ(bits<TypeParam>(eight_slabs(), options, kSteps / 2, threads, form), one)
                        << layout << " " << threads << " " << (form == SpringForm::means ? "means" : "nodes");
                }
            }
        }
    }
}

/// The same motion, up to rounding, in one tile.
TYPED_TEST(Determinism, OneTileChangesRoundingAlone) {
    const Lattice lattice = Lattice::box(13, 9, 11, 0.25);
    Material material;
    material.poisson_ratio = 0.4;
    for (const std::string layout : {"flat-rows", "active-rows", "packed-xyzw"}) {
        const auto motion = [&](bool one_tile) {
            PlanOptions options;
            options.layout = layout;
            options.one_tile = one_tile;
            ExplicitDynamics<TypeParam> body(lattice, material, options);
            EXPECT_EQ(body.describe().tiles == 1, one_tile) << layout;
            const std::size_t n = body.node_count();
            std::vector<TypeParam> u = testing::random_field<TypeParam>(n, 0.0125, 7);
            body.set_displacements(VectorField<const TypeParam>::aos(u.data(), n));
            body.step({0.5 * body.critical_time_step(), {0, -9.81, 0}, 0.3}, 40);
            body.get_displacements(VectorField<TypeParam>::aos(u.data(), n));
            return u;
        };
        const std::vector<TypeParam> tiles = motion(false), one = motion(true);
        TypeParam difference = 0;
        for (std::size_t i = 0; i < tiles.size(); ++i) {
            difference = std::max(difference, std::abs(tiles[i] - one[i]));
        }
        // Forty steps of roundings of a motion under gravity that starts at 0.0125 m, and doubles.
        EXPECT_LT(difference, 0.025 * 1000 * std::numeric_limits<TypeParam>::epsilon()) << layout;
        EXPECT_GT(difference, 0) << "the option takes no effect: " << layout;
    }
}

/// After 1,000 steps of a box of 6 x 5 x 9 cells with exact kernels: square root, division and fused operations are
/// rounded alike by every maker, so these numbers hold on every machine. AVX2 and AVX-512 agree to the bit, since no
/// sum depends on the vector's width; SSE2 has no fused operations.
struct Golden {
    InstructionSet set;
    std::uint64_t in_float, in_double;
};
constexpr Golden kGolden[] = {
    {InstructionSet::sse2, 17960800380357842183u, 9791978111072379767u},
    {InstructionSet::avx2, 5463959360121224506u, 13365037883696744132u},
    {InstructionSet::avx512, 5463959360121224506u, 13365037883696744132u},
};

TEST(Golden, ExactKernelsGiveTheSameBitsEverywhere) {
    for (InstructionSet set : available_instruction_sets()) {
        const Golden* golden = nullptr;
        for (const Golden& g : kGolden) {
            golden = g.set == set ? &g : golden;
        }
        if (!golden) {
            GTEST_SKIP() << "no golden value for " << name(set);
        }
        PlanOptions options;
        options.instruction_set = set;
        options.accuracy = Accuracy::exact;
        options.threads = 1;
        const Lattice lattice = Lattice::box(6, 5, 9, 0.25);
        EXPECT_EQ(bits<float>(lattice, options, 1000, 1), golden->in_float) << name(set);
        EXPECT_EQ(bits<double>(lattice, options, 1000, 1), golden->in_double) << name(set);
    }
}

} // namespace
} // namespace hybmss
