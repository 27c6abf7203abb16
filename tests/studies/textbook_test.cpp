/// Problems with known answers: exact ones to rounding, the others within their bounds, and their errors fall.

#include "studies/paper/tables.hpp"
#include "studies/textbook/problem.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace hybmss::textbook {
namespace {

class Textbook : public testing::TestWithParam<Problem> {};

TEST_P(Textbook, agrees) {
    const Problem& problem = GetParam();
    ASSERT_GE(problem.meshes.size(), 2u);
    for (const SpringForm springs : {SpringForm::nodes, SpringForm::means}) {
        SCOPED_TRACE(springs == SpringForm::nodes ? "nodes" : "means");
        const Material material = unit_material(problem, springs);
        const double coarse = std::abs(problem.solve(material, problem.meshes[0]).error());
        const double fine = std::abs(problem.solve(material, problem.meshes[1]).error());
        EXPECT_LE(fine, problem.bound);
        if (problem.agreement == Agreement::rounding) {
            EXPECT_LE(coarse, problem.bound);
        }
        if (problem.least_order > 0 && springs == SpringForm::nodes) {
            EXPECT_GE(paper::observed_order(coarse, problem.meshes[0], fine, problem.meshes[1]), problem.least_order);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Problems, Textbook, testing::ValuesIn(all_problems()), [](const auto& problem) {
    std::string name;
    for (const char c : problem.param.name) {
        name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
    }
    return name;
});

/// On means a cantilever errs by its clamp alone.
TEST(ClampedCantilever, is_nearly_right_on_one_cell) {
    const paper::Table table = clamped_cantilever_table(true);
    ASSERT_EQ(table.rows.size(), 6u);
    for (const std::vector<paper::Cell>& row : table.rows) {
        ASSERT_EQ(row.size(), table.columns.size());
        const double nodes = row[2].number, means = row[3].number;
        EXPECT_GT(nodes, row[1].number == 1 ? 90 : 25) << row[0].word;
        EXPECT_GT(means, 0.1) << row[0].word;
        EXPECT_LT(means, row[0].word == "0.45" ? 1.8 : 0.8) << row[0].word;
        EXPECT_TRUE(std::isnan(row[4].number)); // no CalculiX where it is to be quick
    }
}

/// The torsion problem's own errors, and that no weight serves bars of 2 and of 4 cells with plates.
TEST(TwistWeights, are_a_choice) {
    const paper::Table table = twist_table();
    ASSERT_EQ(table.columns.size(), 12u);
    constexpr std::size_t kPlate = 3, kTwo = 5, kFour = 6, kEight = 7;
    const std::vector<Problem> problems = all_problems();
    const auto torsion = std::ranges::find_if(
        problems, [](const Problem& problem) { return problem.name.starts_with("torsion, Saint-Venant"); });
    ASSERT_NE(torsion, problems.end());
    const Material means = unit_material(*torsion, SpringForm::means);
    EXPECT_NEAR(table.rows[0][kPlate].number, 0, 1e-9);
    for (const auto& [column, across] : {std::pair(kTwo, 2), {kFour, 4}, {kEight, 8}}) {
        EXPECT_NEAR(table.rows[0][column].number, 100 * torsion->solve(means, across).error(), 1e-4) << across;
    }
    for (const std::vector<paper::Cell>& row : table.rows) {
        const bool plates = std::abs(row[kPlate].number) < 1e-9;
        const bool bars = std::abs(row[kTwo].number) < 1.5 && std::abs(row[kFour].number) < 0.1;
        EXPECT_EQ(plates && bars, row[0].word == "by free sides") << row[0].word;
        // Rectangles likewise: 2 x 6 and 3 x 5 cells.
        EXPECT_EQ(plates && std::abs(row[10].number) < 0.1 && std::abs(row[11].number) < 0.1,
                  row[0].word == "by free sides")
            << row[0].word;
    }
}

/// Alike along all directions at small strain, and at 20 % no more; along an edge what a bar of cells gives.
TEST(Anisotropy, comes_with_strain) {
    for (const double ratio : {1.0, 0.0}) {
        const Material material{.young_modulus = 1, .poisson_ratio = 0.3, .density = 1, .face_diagonal_ratio = ratio};
        for (const reference::Vector3d& along :
             {reference::Vector3d(1, 0, 0), reference::Vector3d(1, 1, 0), reference::Vector3d(3, -1, 2)}) {
            EXPECT_NEAR(uniaxial_stress(material, along, 1 + 1e-6), 1e-6, 1e-11);
        }
        const double edge = uniaxial_stress(material, {1, 0, 0}, 1.2),
                     diagonal = uniaxial_stress(material, {1, 1, 1}, 1.2);
        EXPECT_GT(std::abs(diagonal / edge - 1), 0.01);
        EXPECT_NEAR(edge, ratio == 1 ? 0.214401 : 0.207992, 1e-6);
    }
}

TEST(AngularSprings, AreIsotropicAndHaveTheirEnergysForces) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (const double nu : {-0.2, 0.0, 0.2, 0.3}) {
        for (int i = 0; i < 20; ++i) {
            reference::Matrix3d strain;
            for (double& entry : strain.reshaped()) {
                entry = normal(random);
            }
            EXPECT_NEAR(angular_stiffness_error(nu, 1e-6 * (strain + strain.transpose())), 0, 1e-4) << nu;
        }
    }
    EXPECT_NEAR(angular_force_error(), 0, 1e-7);
}

} // namespace
} // namespace hybmss::textbook
