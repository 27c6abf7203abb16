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

} // namespace
} // namespace hybmss::textbook
