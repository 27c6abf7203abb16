/// Problems with known answers: exact ones to rounding, the others within their bounds, and their errors fall.

#include "studies/paper/tables.hpp"
#include "studies/textbook/problem.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

} // namespace
} // namespace hybmss::textbook
