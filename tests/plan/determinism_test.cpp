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

/// Roots, quotients, products and sums are rounded alike by every maker. At `exact` none is fused with another, and no
/// sum depends on a vector's width: these numbers hold on every machine and instruction set. Of 300 steps: the state,
/// forces and energies.
struct Golden {
    const char* name;
    std::uint64_t in_float, in_double;
    Lattice lattice;
    Material material;
    const char* layout;
    bool as_network = false, damped = false, cut = false;
};

Lattice with_holes(int nx, int ny, int nz, double filled) {
    std::mt19937 engine(3);
    std::vector<float> scales(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
                              static_cast<std::size_t>(nz));
    for (float& scale : scales) {
        scale = static_cast<double>(engine()) / 4294967296.0 < filled ? 1.0f : 0.0f;
    }
    return Lattice::from_cells(nx, ny, nz, 0.25, std::move(scales));
}
Lattice of_tissues(int nx, int ny, int nz) {
    Lattice lattice = Lattice::box(nx, ny, nz, 0.25);
    std::vector<std::uint8_t> of_cells(lattice.cell_scales().size());
    for (std::size_t c = 0; c < of_cells.size(); ++c) {
        of_cells[c] = static_cast<std::uint8_t>(c % 7 / 3);
    }
    lattice.set_tissues({{0.1, 2000}, {0.45, 500}}, std::move(of_cells));
    return lattice;
}
Material golden_material(double poisson_ratio, SpringForm springs = SpringForm::nodes, bool stiff = false) {
    Material material;
    material.poisson_ratio = poisson_ratio;
    material.springs = springs;
    if (stiff) {
        material.stiffening = {0.3, 2};
    }
    return material;
}
Material crushable(Material material) {
    material.crush = {20, 0.95};
    return material;
}

std::vector<Golden> golden_bodies() {
    const Material plain = golden_material(0.4), auxetic = golden_material(0.1), stiff = golden_material(0.4, {}, true);
    const Material means = golden_material(0.4, SpringForm::means),
                   stiff_means = golden_material(0.1, SpringForm::means, true);
    Material edges = plain;
    edges.face_diagonal_ratio = 0;
    const Lattice bar = Lattice::box(21, 4, 5, 0.25);
    const Lattice holes = with_holes(37, 7, 6, 0.3);
    return {
        {"box", 7860586752763332135u, 16358342890280853659u, Lattice::box(6, 5, 9, 0.25), plain, "flat-rows"},
        {"box, mean stretch", 7930992842198549407u, 589815785806083508u, Lattice::box(6, 5, 9, 0.25), auxetic,
         "flat-rows"},
        {"box without face diagonals", 128110456226758237u, 7904775679059155476u, Lattice::box(6, 5, 9, 0.25), edges,
         "flat-rows"},
        {"rod", 8462712634450883851u, 15725066985836086408u, Lattice::box(1, 1, 40, 0.25), plain, "flat-rows"},
        {"plate", 12885347394490821941u, 1548016817137268862u, Lattice::box(2, 33, 3, 0.25), plain, "flat-rows"},
        {"holes", 15793302518316154510u, 2460799507750076233u, holes, plain, "active-rows"},
        {"holes in a bar", // for which vectors of other widths would choose other axes
         4122948503067515715u, 16157758484086376195u, with_holes(6, 9, 40, 0.3), plain, "active-rows"},
        {"holes in flat rows", 3016900078206048787u, 6460819085027870339u, holes, plain, "flat-rows"},
        {"stiffening, damped", 12932316266213109613u, 16286518928705366510u, bar, stiff, "flat-rows", false, true},
        {"tissues that resist", 8695762960329282089u, 1538474018011729851u, of_tissues(7, 6, 11), crushable(plain),
         "flat-rows", false, true, true},
        {"tissues in active rows", 4578056709386331688u, 18105243199267448929u, of_tissues(7, 6, 11),
         crushable(auxetic), "active-rows", false, false, true},
        {"means", 1076233462188310183u, 14591445675370637542u, Lattice::box(6, 5, 9, 0.25), means, "flat-rows"},
        {"means, holes", 15010492088021821418u, 12376445723568317379u, holes, stiff_means, "active-rows", false, true,
         true},
        {"packed", 5741390422870716163u, 4216707096959944850u, bar, stiff, "packed-xyzw", true, true},
        {"packed, mean stretch", 12858887970602165170u, 18165774283860389050u, bar, auxetic, "packed-xyzw", true},
        {"packed, holes", 6520892956916074424u, 10677416682077797460u, holes, plain, "packed-xyzw", true},
        {"packed means", 4520824072601119605u, 398176857888278436u, bar, stiff_means, "packed-xyzw", true, true},
        {"structure of arrays", 15218969398799068018u, 1631887656791675679u, bar, stiff, "coloured-soa", true, true},
        {"structure of arrays, mean stretch", 8435727504882923213u, 8603323573159827683u, bar, auxetic, "coloured-soa",
         true},
        {"structure of arrays, holes", 15698191000331670994u, 18025815009639284618u, holes, plain, "coloured-soa",
         true},
        {"structure of arrays, means", 17524035321727656287u, 7393435162047368921u, bar, stiff_means, "coloured-soa",
         true, true},
    };
}

template <class T>
std::uint64_t golden_bits(const Golden& golden, InstructionSet set) {
    PlanOptions options;
    options.instruction_set = set;
    options.accuracy = Accuracy::exact;
    options.threads = 1;
    options.layout = golden.layout;
    Lattice lattice = golden.lattice;
    ExplicitDynamics<T> body = golden.as_network
                                   ? ExplicitDynamics<T>(Network::from_lattice(lattice, golden.material), options)
                                   : ExplicitDynamics<T>(lattice, golden.material, options);
    EXPECT_EQ(body.describe().instruction_set, set);
    if (golden.damped) {
        body.damp_springs(1e-3);
    }
    // Numbers of its own: what is found by a matrix's eigenvalues may differ in its last bits.
    const StepParameters step{0.005, {0, -9.81, 0}, 0.3};
    EXPECT_LT(step.time_step, body.critical_time_step());
    std::uint64_t hash = testing::bits_after(body, lattice.cell_size(), step, 200);
    if (golden.cut) {
        std::vector<std::uint32_t> cells;
        for (std::uint32_t c = 5; c < lattice.cell_scales().size(); c += 9) {
            cells.push_back(c);
        }
        EXPECT_GT(body.remove_cells(lattice, cells), 0u);
    }
    body.step(step, 100);
    std::vector<double> energies = {body.potential_energy().springs, body.potential_energy().volume,
                                    body.kinetic_energy()};
    for (const EffectEnergy& effect : body.effect_energies()) {
        energies.push_back(effect.stored);
        energies.push_back(effect.dissipated);
    }
    hash = testing::bits_of(energies, Digest(hash));
    return testing::bits_of(body.exact_state(), Digest(hash));
}

/// After 1,000 steps of a box of 6 x 5 x 9 cells, in float and in double; the WebAssembly module is held to them too.
constexpr std::uint64_t kThousandSteps[] = {17960800380357842183u, 9791978111072379767u};

TEST(Golden, AThousandStepsGiveTheSameBitsEverywhere) {
    for (InstructionSet set : available_instruction_sets()) {
        PlanOptions options;
        options.instruction_set = set;
        options.accuracy = Accuracy::exact;
        options.threads = 1;
        const Lattice lattice = Lattice::box(6, 5, 9, 0.25);
        EXPECT_EQ(bits<float>(lattice, options, 1000, 1), kThousandSteps[0]) << name(set);
        EXPECT_EQ(bits<double>(lattice, options, 1000, 1), kThousandSteps[1]) << name(set);
    }
}

TEST(Golden, ExactKernelsGiveTheSameBitsEverywhere) {
    for (const Golden& golden : golden_bodies()) {
        for (InstructionSet set : available_instruction_sets()) {
            EXPECT_EQ(golden_bits<float>(golden, set), golden.in_float) << golden.name << " " << name(set);
            EXPECT_EQ(golden_bits<double>(golden, set), golden.in_double) << golden.name << " " << name(set);
        }
    }
}

} // namespace
} // namespace hybmss
