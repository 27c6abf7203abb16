// active-rows against flat-rows, on bodies where their memory differs most.

#include "bench/standard_bodies.hpp"
#include "tests/moving_body.hpp"

#include "hybmss/force_plan.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace hybmss {
namespace {

constexpr double kCellSize = 0.25;

struct Shape {
    std::string name;
    Lattice lattice;
};

/// Cells at random, each with a scale of its own.
Shape scattered(int nx, int ny, int nz, double fill, unsigned seed) {
    std::mt19937 engine(seed);
    std::vector<float> scales(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
                              static_cast<std::size_t>(nz));
    for (float& scale : scales) {
        const bool filled = static_cast<double>(engine()) < fill * 4294967296.0;
        scale = filled ? 0.1f + static_cast<float>(engine() % 1000) / 400 : 0.0f;
    }
    return {std::to_string(nx) + "x" + std::to_string(ny) + "x" + std::to_string(nz) + " filled " +
                std::to_string(fill) + " seed " + std::to_string(seed),
            Lattice::from_cells(nx, ny, nz, kCellSize, std::move(scales))};
}

/// One cell of a large grid.
Shape single_cell(int i, int j, int k) {
    Lattice lattice = Lattice::from_cells(40, 6, 5, kCellSize, std::vector<float>(40 * 6 * 5, 0.0f));
    lattice.set_cell_scale(i, j, k, 1.5f);
    return {"single cell " + std::to_string(i) + " " + std::to_string(j) + " " + std::to_string(k), lattice};
}

std::vector<Shape> shapes() {
    std::vector<Shape> all;
    for (const std::array<int, 3>& n : {std::array<int, 3>{1, 1, 1},
                                        {15, 1, 1},
                                        {16, 1, 1},
                                        {1, 37, 1},
                                        {1, 1, 37},
                                        {17, 3, 2},
                                        {3, 2, 47},
                                        {5, 31, 4}}) {
        all.push_back({std::to_string(n[0]) + "x" + std::to_string(n[1]) + "x" + std::to_string(n[2]),
                       Lattice::box(n[0], n[1], n[2], kCellSize)});
    }
    // A cell whose nodes lie in two vectors, at an end of the grid, and in its midst.
    for (const int i : {0, 3, 7, 14, 15, 16, 31, 39}) {
        all.push_back(single_cell(i, i % 6, i % 5));
    }
    all.push_back(scattered(40, 9, 8, 0.02, 1));
    all.push_back(scattered(33, 12, 7, 0.2, 2));
    all.push_back(scattered(6, 35, 9, 0.6, 3));
    all.push_back(scattered(5, 6, 50, 0.9, 4));
    all.push_back({"hollow ball", hollow_ball(16, 2, kCellSize)});
    return all;
}

std::vector<Material> materials() {
    Material hybrid, mean_stretch, springs;
    hybrid.poisson_ratio = 0.45;
    mean_stretch.poisson_ratio = 0.1;
    mean_stretch.face_diagonal_ratio = 0;
    mean_stretch.volume_energy = VolumeEnergy::mean_stretch;
    springs.volume_energy = VolumeEnergy::none;
    return {hybrid, mean_stretch, springs};
}

/// Displacements and velocities after the steps, and then forces.
template <class T>
std::vector<T> state_after(const Lattice& lattice, const Material& material, const PlanOptions& options, long steps) {
    ExplicitDynamics<T> body(lattice, material, options);
    const std::size_t n = body.node_count();
    const std::vector<T> start = testing::random_field<T>(n, 0.05 * kCellSize, 7);
    body.set_displacements(VectorField<const T>::aos(start.data(), n));
    PrescribedNode held;
    held.node = static_cast<std::uint32_t>(n - 1);
    held.axes = 2;
    held.displacement = {0, 0.1 * kCellSize, 0};
    body.prescribe(std::vector<PrescribedNode>{held});
    body.step({0.3 * body.critical_time_step(), {1, -9.81, 2}, 0.3}, steps);
    std::vector<T> all(9 * n);
    body.get_displacements(VectorField<T>::aos(all.data(), n));
    body.get_velocities(VectorField<T>::aos(all.data() + 3 * n, n));
    body.get_forces(VectorField<T>::aos(all.data() + 6 * n, n));
    return all;
}

template <class T>
struct ActiveRowsOfBothTypes : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(ActiveRowsOfBothTypes, Precisions);

/// Sums of the same numbers in another order: differences are roundings of the largest, which eight steps carry on.
TYPED_TEST(ActiveRowsOfBothTypes, MoveAsFlatRowsDo) {
    using T = TypeParam;
    for (const Shape& shape : shapes()) {
        for (const Material& material : materials()) {
            for (const InstructionSet set : available_instruction_sets()) {
                PlanOptions options;
                options.instruction_set = set;
                options.layout = "flat-rows";
                const std::vector<T> expected = state_after<T>(shape.lattice, material, options, 8);
                options.layout = "active-rows";
                const std::vector<T> found = state_after<T>(shape.lattice, material, options, 8);
                ASSERT_EQ(found.size(), expected.size());
                const std::size_t third = found.size() / 3;
                for (std::size_t part = 0; part < 3; ++part) {
                    double most = 0, difference = 0;
                    for (std::size_t n = part * third; n < (part + 1) * third; ++n) {
                        most = std::max(most, std::abs(static_cast<double>(expected[n])));
                        difference = std::max(difference, std::abs(static_cast<double>(found[n] - expected[n])));
                    }
                    const double epsilon = static_cast<double>(std::numeric_limits<T>::epsilon());
                    EXPECT_LE(difference, 100 * epsilon * most) << shape.name << " " << name(set) << " part " << part;
                }
            }
        }
    }
}

TYPED_TEST(ActiveRowsOfBothTypes, ThreadsDoNotChangeABit) {
    Material material;
    material.poisson_ratio = 0.4;
    const Lattice ball = hollow_ball(28, 3, kCellSize);
    for (const InstructionSet set : available_instruction_sets()) {
        PlanOptions options;
        options.layout = "active-rows";
        options.instruction_set = set;
        options.threads = 1;
        const auto one = testing::bits_of(state_after<TypeParam>(ball, material, options, 10));
        for (const int threads : {2, 3, 8}) {
            options.threads = threads;
            EXPECT_EQ(testing::bits_of(state_after<TypeParam>(ball, material, options, 10)), one)
                << name(set) << " " << threads;
        }
    }
}

TEST(ActiveRows, ActiveRowsTakeMemoryForFilledCellsAlone) {
    Material material;
    PlanOptions options;
    options.layout = "active-rows";
    std::size_t bytes[2];
    // One body, in its own box and in a grid of a hundred times as many cells.
    const Shape dense = scattered(20, 10, 10, 0.9, 5);
    Lattice large = Lattice::from_cells(100, 50, 40, kCellSize, std::vector<float>(200000, 0.0f));
    for (int k = 0; k < 10; ++k) {
        for (int j = 0; j < 10; ++j) {
            for (int i = 0; i < 20; ++i) {
                large.set_cell_scale(i + 32, j + 16, k + 16, dense.lattice.cell_scale(i, j, k));
            }
        }
    }
    const Lattice* lattices[] = {&dense.lattice, &large};
    for (std::size_t i = 0; i < 2; ++i) {
        bytes[i] = ForcePlan<float>(*lattices[i], material, options).describe().bytes;
    }
    // A void vector for every plane, full or empty.
    EXPECT_LT(static_cast<double>(bytes[1]), 1.2 * static_cast<double>(bytes[0]));
    options.layout = "flat-rows";
    EXPECT_GT(ForcePlan<float>(large, material, options).describe().bytes, 20 * bytes[1]);
}

TEST(ActiveRows, AnEstimateTakesActiveRowsForSparseBodies) {
    Material material;
    const auto estimated = [&](const Lattice& lattice) {
        return ForcePlan<float>(lattice, material, {}).describe().layout;
    };
    EXPECT_EQ(estimated(Lattice::box(20, 20, 20, kCellSize)), "flat-rows");
    EXPECT_EQ(estimated(Lattice::box(1, 1, 1, kCellSize)), "flat-rows");
    EXPECT_EQ(estimated(hollow_ball(64, 4, kCellSize)), "active-rows");
    EXPECT_EQ(estimated(single_cell(20, 3, 3).lattice), "active-rows");
    // A ball, from some 48 cells across.
    EXPECT_EQ(estimated(hollow_ball(24, 12, kCellSize)), "flat-rows");
    EXPECT_EQ(estimated(hollow_ball(48, 24, kCellSize)), "active-rows");
    PlanOptions exact;
    exact.accuracy = Accuracy::exact;
    EXPECT_EQ(ForcePlan<float>(hollow_ball(48, 24, kCellSize), material, exact).describe().layout, "flat-rows");
    // Cells everywhere, if few: hardly a vector is without one.
    EXPECT_EQ(estimated(scattered(40, 20, 20, 0.3, 1).lattice), "flat-rows");
}

} // namespace
} // namespace hybmss
