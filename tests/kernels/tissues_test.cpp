// Cells of several materials, each with its own Young's modulus, Poisson's ratio and density: the plain equations, the
// kernels beside them, and what follows from both.

#include "tests/kernels/hessian_plans.hpp"
#include "tests/refusal.hpp"

#include "reference/forces.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace hybmss {
namespace {

using reference::Vector3d;
using testing::kEpsilon;

constexpr double kCellSize = 0.3;

/// Without volume force, with the quadratic energy nearly incompressible, by mean stretch, and in between.
std::vector<Material> tissues(double face_diagonal_ratio = 1) {
    std::vector<Material> all;
    for (const auto& [E, nu, density] :
         {std::array{1e4, 0.25, 1000.0}, {3e4, 0.499, 1100.0}, {2e3, -0.5, 200.0}, {1e4, 0.3, 1000.0}}) {
        all.push_back({E, nu, density, face_diagonal_ratio});
    }
    return all;
}

/// Labels at random, 0 to `most`.
std::vector<std::uint8_t> random_labels(std::size_t cells, std::size_t least, std::size_t most,
                                        testing::Random& random) {
    std::vector<std::uint8_t> labels(cells);
    for (std::uint8_t& label : labels) {
        label = static_cast<std::uint8_t>(least + random.below(most - least + 1));
    }
    labels[0] = 1;
    return labels;
}

Lattice mixed(int nx, int ny, int nz, std::size_t least, testing::Random& random, std::span<const Material> materials) {
    const auto cells = static_cast<std::size_t>(nx * ny * nz);
    return Lattice::from_materials(nx, ny, nz, kCellSize, random_labels(cells, least, materials.size(), random),
                                   materials);
}

// A cell's energy is that of the uniform body of its material, its mass too: a body of one cell each.
TEST(Tissues, CellsAreThoseOfTheirMaterials) {
    const std::vector<Material> all = tissues();
    testing::Random random(1);
    for (std::size_t m = 0; m < all.size(); ++m) {
        const std::uint8_t label[] = {static_cast<std::uint8_t>(m + 1)};
        const Lattice own = Lattice::from_materials(1, 1, 1, kCellSize, label, all);
        const reference::Body body = reference::assemble(own, all[0]),
                              uniform = reference::assemble(Lattice::box(1, 1, 1, kCellSize), all[m]);
        const auto u = testing::random_displacement(8, 0.1 * kCellSize, random);
        const double springs = reference::energy(uniform, u).springs, volume = reference::energy(uniform, u).volume;
        // Scales are floats.
        EXPECT_NEAR(reference::energy(body, u).springs, springs, 1e-7 * springs);
        EXPECT_NEAR(reference::energy(body, u).volume, volume, 1e-7 * std::abs(volume));
        EXPECT_EQ(body.mass, uniform.mass);
    }
}

TEST(Tissues, MassesAreExactSums) {
    const std::vector<Material> all = tissues();
    testing::Random random(2);
    const Lattice lattice = mixed(5, 4, 6, 0, random, all);
    const std::vector<double> expected = reference::assemble(lattice, all[0]).mass;
    for (const std::string& layout : distinct_lattice_layouts()) {
        if (!layout.starts_with("flat") && !layout.starts_with("active")) {
            continue; // networks have one volume energy
        }
        const auto body = make_body<double>(lattice, all[0], {.layout = layout});
        ASSERT_EQ(body->masses().size(), expected.size());
        for (std::size_t n = 0; n < expected.size(); ++n) {
            EXPECT_NEAR(body->masses()[n], expected[n], 4 * kEpsilon<double> * expected[n]) << layout;
        }
    }
}

// Central differences of the energy, and of the forces.
TEST(Tissues, ForceAndHessianAreDerivativesOfTheEnergy) {
    const std::vector<Material> all = tissues();
    testing::Random random(3);
    const Lattice lattice = mixed(3, 2, 3, 0, random, all);
    const reference::Body body = reference::assemble(lattice, all[0]);
    auto u = testing::random_displacement(body.rest.size(), 0.1 * kCellSize, random);
    const auto p = testing::random_displacement(body.rest.size(), kCellSize, random);
    const std::vector<Vector3d> forces = reference::forces(body, u);
    const std::vector<Vector3d> product = reference::hessian_product(body, u, p);
    constexpr double kStep = 1e-5;
    const auto moved = [&](double by) {
        std::vector<Vector3d> v = u;
        for (std::size_t n = 0; n < v.size(); ++n) {
            v[n] += by * p[n];
        }
        return v;
    };
    const auto sum = [](const reference::Energy& energy) { return energy.springs + energy.volume; };
    const double slope =
        (sum(reference::energy(body, moved(kStep))) - sum(reference::energy(body, moved(-kStep)))) / (2 * kStep);
    double work = 0, size = 0;
    const auto up = reference::forces(body, moved(kStep)), down = reference::forces(body, moved(-kStep));
    double worst = 0, largest = 0;
    for (std::size_t n = 0; n < p.size(); ++n) {
        work += forces[n].dot(p[n]);
        size += std::abs(forces[n].dot(p[n]));
        worst = std::max(worst, ((down[n] - up[n]) / (2 * kStep) - product[n]).norm());
        largest = std::max(largest, product[n].norm());
    }
    EXPECT_NEAR(slope, -work, 1e-7 * size);
    EXPECT_LE(worst, 1e-6 * largest);
}

template <class T>
struct TissueKernels : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(TissueKernels, Precisions);

// As for uniform bodies (hessian_test.cpp, `hybmss verify`). On every instruction set and lattice layout; with energies
// by name too, stiffening springs and crush resistance.
TYPED_TEST(TissueKernels, AgreeWithTheReference) {
    using T = TypeParam;
    testing::Random random(4);
    for (const std::array<int, 3>& cells :
         {std::array{1, 1, 1}, {1, 1, 5}, {3, 2, 5}, {17, 4, 7}, {5, 24, 4}, {33, 3, 12}}) {
        for (int variant = 0; variant < 5; ++variant) {
            std::vector<Material> all = tissues(variant == 1 ? 0 : 1);
            for (Material& material : all) {
                material.volume_energy = variant == 2   ? VolumeEnergy::quadratic
                                         : variant == 3 ? VolumeEnergy::mean_stretch
                                                        : VolumeEnergy::automatic;
                material.stiffening = variant == 4 ? SpringStiffening{1, 3} : SpringStiffening{};
                material.crush = variant == 4 ? CrushResistance{20, 0.95} : CrushResistance{};
            }
            const Lattice lattice =
                mixed(cells[0], cells[1], cells[2], static_cast<std::size_t>(variant % 2), random, all);
            const reference::Body body = reference::assemble(lattice, all[0]);
            const std::size_t nodes = body.rest.size();
            const auto p = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
            for (const double strain : {1e-6, 0.1, 0.5}) {
                const auto u = testing::as_held<T>(testing::random_displacement(nodes, strain * kCellSize, random));
                const std::vector<Vector3d> forces = reference::forces(body, u);
                const std::vector<Vector3d> products = reference::hessian_product(body, u, p);
                const auto diagonal = reference::hessian_diagonal(body, u);
                const reference::Energy energy = reference::energy(body, u);
                const double force_scale = testing::largest(reference::force_scale(body, u)),
                             product_scale = testing::largest(reference::hessian_product_scale(body, u, p));
                const double limit = (strain > 0.1 ? 25 : 5) * kEpsilon<T>;
                const auto flat = testing::interleaved<T>(u);
                const VectorField<const T> at = VectorField<const T>::aos(flat.data(), nodes);
                testing::for_every_plan<T>(lattice, all[0], [&](const ForcePlan<T>& plan, const std::string& label) {
                    SCOPED_TRACE(label + ", strain " + std::to_string(strain) + ", variant " + std::to_string(variant) +
                                 ", cells " + std::to_string(cells[0]));
                    std::vector<T> out(flat.size(), T(0));
                    plan.add_forces(at, VectorField<T>::aos(out.data(), nodes));
                    EXPECT_LE(testing::largest_difference(testing::vectors(out), forces), limit * force_scale);
                    EXPECT_LE(testing::largest_difference(testing::product(plan, u, p), products),
                              limit * product_scale);
                    const auto blocks = testing::diagonal(plan, u);
                    for (std::size_t n = 0; n < nodes; ++n) {
                        ASSERT_LE((blocks[n] - diagonal[n]).cwiseAbs().maxCoeff() * kCellSize, limit * product_scale);
                    }
                    const PotentialEnergy found = plan.energy(at);
                    const double all_energy = std::abs(energy.springs) + std::abs(energy.volume);
                    if (strain > 1e-3 || sizeof(T) == 8) {
                        EXPECT_NEAR(found.springs, energy.springs, 100 * kEpsilon<T> * all_energy);
                        EXPECT_NEAR(found.volume, energy.volume, 100 * kEpsilon<T> * all_energy);
                    }
                });
            }
        }
    }
}

// Whatever the name of their material, cells that are all alike make the uniform body; where Poisson's ratio and
// density are the first material's, bit for bit.
TYPED_TEST(TissueKernels, OfOneMaterialAreTheUniformBody) {
    using T = TypeParam;
    testing::Random random(5);
    const Material soft{1e4, 0.1, 900}, stiff{1e4, 0.45, 1200};
    const Lattice box = Lattice::box(6, 5, 7, kCellSize);
    const std::size_t cells = box.cell_scales().size(), nodes = box.nodes().size();
    const auto u = testing::random_displacement(nodes, 0.1 * kCellSize, random);
    const auto flat = testing::interleaved<T>(u);
    const auto forces = [&](const Lattice& lattice, const Material& material) {
        std::vector<T> out(flat.size(), T(0));
        ForcePlan<T>(lattice, material)
            .add_forces(VectorField<const T>::aos(flat.data(), nodes), VectorField<T>::aos(out.data(), nodes));
        return out;
    };
    const std::vector<T> uniform = forces(box, stiff);
    const std::vector<Material> of_two = {soft, stiff};
    const std::vector<std::uint8_t> second(cells, 2);
    const Lattice as_second = Lattice::from_materials(6, 5, 7, kCellSize, second, of_two);
    const std::vector<T> found = forces(as_second, soft);
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < flat.size(); ++i) {
        worst = std::max(worst, std::abs(static_cast<double>(found[i] - uniform[i])));
        largest = std::max(largest, std::abs(static_cast<double>(uniform[i])));
    }
    EXPECT_LE(worst, (20 * kEpsilon<T> + 1.2e-7) * largest); // scales are floats
    EXPECT_NE(ForcePlan<T>(as_second, soft).describe().kernel.find("volumes of tissues"), std::string::npos);

    testing::Random labels(6);
    const std::vector<Material> alike = {stiff, stiff, stiff};
    const Lattice same = Lattice::from_materials(6, 5, 7, kCellSize, random_labels(cells, 1, 3, labels), alike);
    EXPECT_EQ(forces(same, stiff), uniform);
    EXPECT_EQ(ForcePlan<T>(same, stiff).describe().kernel, ForcePlan<T>(box, stiff).describe().kernel);
}

// A network has its kappa cell by cell, and one volume energy.
TEST(Tissues, AreNetworksWhereOneEnergyWillDo) {
    testing::Random random(7);
    const std::vector<Material> compressible = {{1e4, 0.3, 1000}, {2e4, 0.25, 500}, {5e3, 0.49, 1500}};
    const Lattice lattice = mixed(5, 4, 6, 0, random, compressible);
    const std::size_t nodes = lattice.nodes().size();
    const auto u = testing::random_displacement(nodes, 0.1 * kCellSize, random);
    const reference::Body body = reference::assemble(lattice, compressible[0]);
    const std::vector<Vector3d> expected = reference::forces(body, u);
    for (const char* layout : {"packed-xyzw", "coloured-soa"}) {
        const ForcePlan<double> plan(lattice, compressible[0], {.layout = layout});
        const auto flat = testing::interleaved<double>(u);
        std::vector<double> out(flat.size(), 0.0);
        plan.add_forces(VectorField<const double>::aos(flat.data(), nodes),
                        VectorField<double>::aos(out.data(), nodes));
        EXPECT_LE(testing::largest_difference(testing::vectors(out), expected),
                  25 * kEpsilon<double> * testing::largest(reference::force_scale(body, u)));
    }
    EXPECT_EQ(Network::from_lattice(lattice, compressible[0]).masses.size(), nodes);
    const std::vector<Material> both = {{1e4, 0.3, 1000}, {2e4, 0.1, 500}};
    testing::expect_refusal([&] { Network::from_lattice(mixed(3, 3, 3, 1, random, both), both[0]); },
                            {"poisson_ratio on both sides of 0.25", "flat-rows"});
}

TEST(Tissues, WhatCannotBeIsRefused) {
    const std::uint8_t labels[] = {1, 2};
    const auto given = [&](const Material& other) {
        const Material both[] = {{1e4, 0.3, 1000}, other};
        return Lattice::from_materials(2, 1, 1, 1, labels, both);
    };
    testing::expect_refusal([&] { given({1e4, 0.3, 1000, 0.5}); }, {"material 2", "only young_modulus"});
    testing::expect_refusal([&] { given({1e4, 0.5, 1000}); }, {"poisson_ratio = 0.5"});
    testing::expect_refusal([&] { given({1e4, 0.3, 0}); }, {"density = 0"});
    const Material one[] = {{1e4, 0.3, 1000}};
    testing::expect_refusal([&] { Lattice::from_materials(2, 1, 1, 1, labels, one); }, {"material 2", "none given"});
    Lattice box = Lattice::box(2, 1, 1, 1);
    testing::expect_refusal([&] { box.set_tissues({{0.3, 1000}}, {0}); }, {"1 numbers given for 2 cells"});
    testing::expect_refusal([&] { box.set_tissues({{0.3, 1000}}, {0, 2}); }, {"tissue 2", "only 1"});
    const Lattice two = given({1e4, 0.4, 1000});
    const Material on_means{.poisson_ratio = 0.3, .springs = SpringForm::means};
    for (const char* layout : {"", "active-rows", "network"}) {
        testing::expect_refusal([&] { ForcePlan<float>(two, on_means, {.layout = layout}); },
                                {"poisson_ratio of its own", "springs on means"});
    }
}

} // namespace
} // namespace hybmss
