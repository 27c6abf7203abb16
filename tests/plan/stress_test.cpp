#include "hybmss/stress.hpp"

#include "reference/forces.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <cmath>
#include <random>
#include <vector>

namespace hybmss {
namespace {

using reference::Matrix3d;
using reference::Vector3d;

struct Case {
    const char* name;
    Material material;
};

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const SpringForm form : {SpringForm::nodes, SpringForm::means}) {
        Material m{.young_modulus = 2e4, .poisson_ratio = 0.4, .springs = form};
        all.push_back({"quadratic", m});
        m.poisson_ratio = -0.3;
        all.push_back({"mean stretch", m});
        m.poisson_ratio = 0.25;
        all.push_back({"springs alone", m});
        m.face_diagonal_ratio = 0;
        m.stiffening = {0.3, 2};
        all.push_back({"stiffening, no face diagonals", m});
        m.poisson_ratio = 0.45;
        m.crush = {20, 0.95};
        all.push_back({"crush resistance", m});
    }
    return all;
}

std::vector<Vector3d> random_displacements(std::size_t nodes, double size, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> draw(-size, size);
    std::vector<Vector3d> u(nodes);
    for (Vector3d& v : u) {
        v = {draw(engine), draw(engine), draw(engine)};
    }
    return u;
}

std::vector<CellStress> read(const StressMeter& meter, const std::vector<Vector3d>& u) {
    std::vector<CellStress> stresses(meter.cell_count());
    meter.read(VectorField<const double>::aos(u.data()->data(), u.size()), stresses);
    return stresses;
}

Matrix3d piola(const CellStress& stress) {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(stress.first_piola.data());
}

Matrix3d symmetric(const std::array<double, 6>& s) {
    Matrix3d m;
    m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    return m;
}

/// - sum f X^T of the internal forces.
Matrix3d virial(const reference::Body& body, const std::vector<Vector3d>& forces) {
    Matrix3d sum = Matrix3d::Zero();
    for (std::size_t n = 0; n < forces.size(); ++n) {
        sum -= forces[n] * body.rest[n].transpose();
    }
    return sum;
}

Lattice full_of_holes() {
    std::vector<float> scales(5 * 4 * 7);
    for (std::size_t c = 0; c < scales.size(); ++c) {
        scales[c] = c % 3 == 1 ? 0.0f : 0.5f + static_cast<float>(c % 5);
    }
    return Lattice::from_cells(5, 4, 7, 0.2, scales);
}

TEST(Stress, OfACellIsThatOfItsOwnForces) {
    const double h = 0.3;
    for (const Case& c : cases()) {
        for (unsigned seed = 1; seed < 8; ++seed) {
            const Lattice one = Lattice::from_cells(1, 1, 1, h, {1.5f});
            const reference::Body body = reference::assemble(one, c.material);
            const std::vector<Vector3d> u = random_displacements(8, 0.05 * seed * h, seed);
            const CellStress stress = read(StressMeter(one, c.material), u).at(0);
            const Matrix3d expected = virial(body, reference::forces(body, u)) / (h * h * h);
            EXPECT_LT((piola(stress) - expected).norm(), 1e-12 * expected.norm()) << c.name << " seed " << seed;
            const double energy = reference::energy(body, u).total() / (h * h * h);
            EXPECT_NEAR(stress.energy_density, energy, 1e-12 * std::abs(energy)) << c.name << " seed " << seed;
        }
    }
}

TEST(Stress, OfCellsAddsUpToTheWholeBodysForcesAndEnergy) {
    const Lattice lattice = full_of_holes();
    const double volume = std::pow(lattice.cell_size(), 3);
    for (const Case& c : cases()) {
        const reference::Body body = reference::assemble(lattice, c.material);
        const std::vector<Vector3d> u = random_displacements(body.rest.size(), 0.04, 5);
        Matrix3d sum = Matrix3d::Zero();
        double energy = 0;
        for (const CellStress& stress : read(StressMeter(lattice, c.material), u)) {
            sum += volume * piola(stress);
            energy += volume * stress.energy_density;
        }
        const Matrix3d expected = virial(body, reference::forces(body, u));
        EXPECT_LT((sum - expected).norm(), 1e-11 * expected.norm()) << c.name;
        EXPECT_NEAR(energy, reference::energy(body, u).total(), 1e-11 * std::abs(energy)) << c.name;
    }
}

TEST(Stress, OfSeveralTissuesIsByEachOnesOwnVolume) {
    const std::vector<Material> materials = {{.young_modulus = 1e4, .poisson_ratio = 0.45},
                                             {.young_modulus = 3e4, .poisson_ratio = -0.2},
                                             {.young_modulus = 2e3, .poisson_ratio = 0.25}};
    const std::vector<std::uint8_t> labels = {1, 2, 0, 3, 2, 1, 3, 3, 1, 1, 2, 2};
    const Lattice lattice = Lattice::from_materials(3, 2, 2, 0.2, labels, materials);
    const reference::Body body = reference::assemble(lattice, materials[0]);
    const std::vector<Vector3d> u = random_displacements(body.rest.size(), 0.04, 8);
    Matrix3d sum = Matrix3d::Zero();
    double energy = 0;
    for (const CellStress& stress : read(StressMeter(lattice, materials[0]), u)) {
        sum += 0.008 * piola(stress);
        energy += 0.008 * stress.energy_density;
    }
    const Matrix3d expected = virial(body, reference::forces(body, u));
    EXPECT_LT((sum - expected).norm(), 1e-11 * expected.norm());
    EXPECT_NEAR(energy, reference::energy(body, u).total(), 1e-11 * std::abs(energy));
}

TEST(Stress, OfAHomogeneousDeformationIsTheEnergysDerivative) {
    Matrix3d gradient;
    gradient << 1.1, 0.2, -0.05, 0.03, 0.9, 0.1, -0.15, 0.07, 1.05;
    const Lattice one = Lattice::box(1, 1, 1, 0.5);
    for (const Case& c : cases()) {
        const reference::Body body = reference::assemble(one, c.material);
        const auto deformed = [&](const Matrix3d& f) {
            std::vector<Vector3d> u;
            for (const Vector3d& x : body.rest) {
                u.push_back((f - Matrix3d::Identity()) * x);
            }
            return u;
        };
        const CellStress stress = read(StressMeter(one, c.material), deformed(gradient)).at(0);
        constexpr double kStep = 1e-6;
        for (Eigen::Index i = 0; i < 3; ++i) {
            for (Eigen::Index j = 0; j < 3; ++j) {
                Matrix3d more = gradient, less = gradient;
                more(i, j) += kStep;
                less(i, j) -= kStep;
                const double slope = (reference::energy(body, deformed(more)).total() -
                                      reference::energy(body, deformed(less)).total()) /
                                     (2 * kStep * 0.125);
                EXPECT_NEAR(piola(stress)(i, j), slope, 1e-6 * piola(stress).norm()) << c.name;
            }
        }
        const double j = gradient.determinant();
        const Matrix3d cauchy = piola(stress) * gradient.transpose() / j;
        EXPECT_LT((cauchy - cauchy.transpose()).norm(), 1e-12 * cauchy.norm()) << c.name; // no torque
        EXPECT_LT((symmetric(stress.cauchy) - cauchy).norm(), 1e-12 * cauchy.norm()) << c.name;
        EXPECT_NEAR(stress.volume_ratio, j, 1e-14);
        const Matrix3d green = (gradient.transpose() * gradient - Matrix3d::Identity()) / 2;
        EXPECT_LT((symmetric(stress.green_strain) - green).norm(), 1e-14);
        EXPECT_NEAR(stress.pressure(), -cauchy.trace() / 3, 1e-12 * cauchy.norm());
        const Matrix3d deviator = cauchy - cauchy.trace() / 3 * Matrix3d::Identity();
        EXPECT_NEAR(stress.von_mises(), std::sqrt(1.5) * deviator.norm(), 1e-11 * cauchy.norm());
    }
}

TEST(Stress, OfSmallStrainsIsHookesLaw) {
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    const Lattice one = Lattice::box(1, 1, 1, 1);
    constexpr double kStrain = 1e-6;
    std::vector<Vector3d> u;
    for (const Vector3d& x : reference::assemble(one, material).rest) {
        u.push_back(Vector3d(kStrain, -0.3 * kStrain, -0.3 * kStrain).cwiseProduct(x));
    }
    const CellStress stress = read(StressMeter(one, material), u).at(0);
    EXPECT_NEAR(stress.cauchy[0], 1e4 * kStrain, 1e-5 * 1e4 * kStrain);
    for (const std::size_t other : {1u, 2u, 3u, 4u, 5u}) {
        EXPECT_NEAR(stress.cauchy[other], 0, 1e-5 * 1e4 * kStrain);
    }
}

TEST(Stress, IsTheSameForAnyThreadsAndCloseInFloat) {
    const Lattice lattice = Lattice::box(17, 16, 15, 0.1);
    const Material material{.poisson_ratio = 0.4};
    const std::vector<Vector3d> u = random_displacements(lattice.nodes().size(), 0.01, 3);
    PlanOptions one, three;
    one.threads = 1;
    three.threads = 3;
    const std::vector<CellStress> a = read(StressMeter(lattice, material, one), u);
    const std::vector<CellStress> b = read(StressMeter(lattice, material, three), u);
    std::vector<float> floats;
    for (const Vector3d& v : u) {
        floats.insert(floats.end(), {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
    }
    std::vector<CellStress> rounded(a.size());
    StressMeter(lattice, material).read(VectorField<const float>::aos(floats.data(), u.size()), rounded);
    for (std::size_t n = 0; n < a.size(); ++n) {
        EXPECT_EQ(a[n].first_piola, b[n].first_piola);
        EXPECT_EQ(a[n].cauchy, b[n].cauchy);
        EXPECT_NEAR(a[n].von_mises(), rounded[n].von_mises(), 1e-5 * a[n].von_mises());
    }
}

/// Of a body with rows that are whole, short and torn, in T, and as arrays; largest differences by the largest of each.
template <class T>
double worst_difference(const StressMeter& meter, const std::vector<Vector3d>& u,
                        const std::vector<CellStress>& right) {
    std::vector<T> separate(3 * u.size());
    for (std::size_t n = 0; n < u.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            separate[a * u.size() + n] = static_cast<T>(u[n][static_cast<Eigen::Index>(a)]);
        }
    }
    const std::size_t count = right.size();
    const auto field = VectorField<const T>::soa(separate.data(), separate.data() + u.size(),
                                                 separate.data() + 2 * u.size(), u.size());
    std::vector<CellStress> read(count);
    meter.read(field, read);
    std::vector<T> mises(count + 1, T(-7)), shear(count + 1, T(-7)), pressure(count + 1, T(-7));
    StressArrays<T> arrays;
    arrays.von_mises = mises.data();
    arrays.cauchy[3] = shear.data();
    arrays.pressure = pressure.data();
    meter.read(field, arrays);
    EXPECT_EQ(mises[count], T(-7)); // the caller's own
    EXPECT_EQ(shear[count], T(-7));
    double worst = 0, stress = 0, density = 0;
    for (const CellStress& cell : right) {
        stress = std::max(stress, cell.von_mises() + std::abs(cell.pressure()));
        density = std::max(density, cell.energy_density);
    }
    for (std::size_t n = 0; n < count; ++n) {
        EXPECT_EQ(static_cast<double>(shear[n]), read[n].cauchy[3]);
        for (std::size_t i = 0; i < 9; ++i) {
            worst = std::max(worst, std::abs(read[n].first_piola[i] - right[n].first_piola[i]) / stress);
        }
        for (std::size_t s = 0; s < 6; ++s) {
            worst = std::max({worst, std::abs(read[n].cauchy[s] - right[n].cauchy[s]) / stress,
                              std::abs(read[n].green_strain[s] - right[n].green_strain[s])});
        }
        worst = std::max({worst, std::abs(read[n].volume_ratio - right[n].volume_ratio),
                          std::abs(read[n].energy_density - right[n].energy_density) / density,
                          std::abs(static_cast<double>(mises[n]) - right[n].von_mises()) / stress,
                          std::abs(static_cast<double>(pressure[n]) - right[n].pressure()) / stress});
    }
    return worst;
}

TEST(Stress, IsTheSameOnAllInstructionSetsAndAsArrays) {
    std::vector<float> scales(21 * 5 * 4);
    for (std::size_t c = 0; c < scales.size(); ++c) {
        scales[c] = c % 41 == 7 || c % 13 == 12 ? 0.0f : 0.5f + static_cast<float>(c % 5);
    }
    const Lattice lattice = Lattice::from_cells(21, 5, 4, 0.2, scales);
    const std::vector<Vector3d> u = random_displacements(lattice.nodes().size(), 0.02, 3);
    for (const Case& c : cases()) {
        PlanOptions exact;
        exact.accuracy = Accuracy::exact;
        exact.instruction_set = InstructionSet::sse2;
        const std::vector<CellStress> right = read(StressMeter(lattice, c.material, exact), u);
        for (const InstructionSet set : available_instruction_sets()) {
            SCOPED_TRACE(std::string(c.name) + " " + std::string(name(set)));
            PlanOptions options;
            options.instruction_set = exact.instruction_set = set;
            const StressMeter meter(lattice, c.material, options);
            EXPECT_LT(worst_difference<double>(meter, u, right), 1e-13);
            EXPECT_LT(worst_difference<float>(meter, u, right), 4e-5);
            const std::vector<CellStress> same = read(StressMeter(lattice, c.material, exact), u);
            for (std::size_t n = 0; n < right.size(); ++n) {
                ASSERT_EQ(same[n].first_piola, right[n].first_piola) << n;
                ASSERT_EQ(same[n].cauchy, right[n].cauchy) << n;
                ASSERT_EQ(same[n].energy_density, right[n].energy_density) << n;
            }
        }
    }
}

TEST(Stress, OfABodyThatHasLostCellsIsOfThoseLeft) {
    Lattice lattice = Lattice::box(3, 2, 2, 0.1);
    const Material material;
    const StressMeter whole(lattice, material);
    const std::vector<Vector3d> u = random_displacements(whole.node_count(), 0.01, 9);
    const std::vector<CellStress> before = read(whole, u);
    std::vector<std::array<std::uint32_t, 8>> cells;
    for (int k = 0; k < 2; ++k) {
        for (int j = 0; j < 2; ++j) {
            for (int i = 0; i < 3; ++i) {
                if (i != 1) {
                    auto& cell = cells.emplace_back();
                    for (int c = 0; c < 8; ++c) {
                        cell[static_cast<std::size_t>(c)] = static_cast<std::uint32_t>(
                            lattice.grid_node_index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
                    }
                }
            }
        }
    }
    lattice.remove_cells(std::vector<std::array<int, 3>>{{1, 0, 0}, {1, 1, 0}, {1, 0, 1}, {1, 1, 1}});
    const std::vector<CellStress> after = read(StressMeter(lattice, material, cells, u.size()), u);
    ASSERT_EQ(after.size(), 8u);
    EXPECT_EQ(after[1].first_piola, before[2].first_piola);
    EXPECT_EQ(after[7].first_piola, before[11].first_piola);
}

TEST(Stress, StaysFiniteInFlatAndInvertedCells) {
    const Lattice one = Lattice::box(1, 1, 1, 0.5);
    for (const Case& c : cases()) {
        for (const double stretch : {0.0, 1e-12, -0.5}) {
            std::vector<Vector3d> u;
            for (const Vector3d& x : reference::assemble(one, c.material).rest) {
                u.emplace_back(0, 0, (stretch - 1) * x[2]);
            }
            const CellStress stress = read(StressMeter(one, c.material), u).at(0);
            EXPECT_TRUE(std::isfinite(stress.von_mises() + stress.energy_density)) << c.name << " " << stretch;
        }
    }
}

TEST(Stress, RefusesWhatDoesNotFit) {
    const Lattice lattice = Lattice::box(2, 1, 1, 1);
    const StressMeter meter(lattice, {});
    std::vector<double> u(36);
    std::vector<CellStress> two(2), three(3);
    testing::expect_refusal([&] { meter.read(VectorField<const double>::aos(u.data(), 11), two); },
                            {"vector field of 11 nodes given: the body has 12"});
    testing::expect_refusal([&] { meter.read(VectorField<const double>::aos(u.data(), 12), three); },
                            {"stresses: room for 3, the body has 2 cells"});
    const std::vector<std::array<std::uint32_t, 8>> one(1), far(2, {0, 1, 2, 3, 4, 5, 6, 12});
    testing::expect_refusal([&] { StressMeter(lattice, {}, one, 12); }, {"cells: 1 given, the lattice has 2"});
    testing::expect_refusal([&] { StressMeter(lattice, {}, far, 12); }, {"cells: node 12 does not exist", "12"});
    testing::expect_refusal([&] { StressMeter(lattice, {.poisson_ratio = 0.5}); }, {"poisson_ratio", "0.5"});
}

} // namespace
} // namespace hybmss
