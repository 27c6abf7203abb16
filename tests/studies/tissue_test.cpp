/// Tissues and the lattice's law: what the fits and tables must say.

#include "hybmss/simulation/scene.hpp"
#include "studies/textbook/problem.hpp"
#include "studies/tissue/tissue_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hybmss {
namespace {

TEST(Tissue, the_fits_are_as_good_as_they_say_and_scenes_have_them) {
    for (const tissue::Tissue& each : tissue::tissues()) {
        ASSERT_EQ(each.tests.size(), 3u);
        const tissue::Fit all = tissue::fit(each, 0.49, std::vector<std::size_t>{0, 1, 2});
        EXPECT_NO_THROW(validate(all.material));
        if (each.preset == "brain-grey") {
            for (const double r : all.r_squared) {
                EXPECT_GT(r, 0.98);
            }
        }
        for (std::size_t t = 0; t < 3; ++t) { // by itself every test is met
            EXPECT_GT(tissue::fit(each, 0.49, std::vector<std::size_t>{t}).r_squared[t], 0.99) << each.name << t;
        }
        const Scene scene =
            parse_scene("[body]\ncells = [1, 1, 1]\ncell_size = 1\n[material]\ndensity = 1000\npreset = \"" +
                            std::string(each.preset) + "\"\n[solver]\nmethod = \"static\"\n",
                        "s.toml");
        EXPECT_NEAR(scene.material.young_modulus, all.material.young_modulus, 1e-3 * all.material.young_modulus);
        EXPECT_NEAR(scene.material.stiffening.quadratic, all.material.stiffening.quadratic, 0.05);
        EXPECT_NEAR(scene.material.stiffening.cubic, all.material.stiffening.cubic, 0.5);
    }
}

/// Small strain finds E and G; and the fit is of the law that the body has.
TEST(Tissue, stress_is_that_of_the_lattice) {
    Material material{.young_modulus = 1e3, .poisson_ratio = 0.49};
    EXPECT_NEAR(tissue::stress(material, false, 1 + 1e-6), 1e-3, 1e-8);
    EXPECT_NEAR(tissue::stress(material, true, 1e-6), 1e-3 / 2.98, 1e-8);
    EXPECT_NEAR(tissue::stress(material, false, 0.9), textbook::uniaxial_stress(material, {1, 0, 0}, 0.9), 1e-6 * 1e3);
}

const paper::Table& table(const std::vector<paper::Table>& tables, const std::string& name) {
    for (const paper::Table& each : tables) {
        if (each.name == name) {
            return each;
        }
    }
    throw std::runtime_error(name);
}

TEST(Law, waves_are_of_the_second_order_and_mean_stretch_stays_convex) {
    const std::vector<paper::Table> tables = textbook::law_tables();
    const auto& waves = table(tables, "dispersion").rows;
    for (std::size_t row = 0; row + 1 < waves.size(); ++row) {
        if (waves[row][3].number == 16) { // and 32 in the next
            for (const std::size_t wave : {4u, 5u, 6u}) {
                EXPECT_NEAR(waves[row][wave].number / waves[row + 1][wave].number, 4, 0.05);
            }
        }
    }
    for (const auto& row : table(tables, "convexity").rows) {
        if (row[1].word == "mean stretch") {
            EXPECT_EQ(row[2].word, "held");
        } else if (row[0].word == "0") {
            EXPECT_NEAR(row[2].number, 1.0950, 1e-3); // the root of 15 - 15 s^4 + 6 s
        }
    }
    // At a stretch of 0.9 and 1.1 all laws are near each other; at 2 they are not.
    for (const auto& row : table(tables, "uniaxial").rows) {
        if (std::abs(row[1].number - 1.1) < 1e-9) {
            EXPECT_NEAR(row[2].number, row[5].number, 0.02);
        }
    }
}

} // namespace
} // namespace hybmss
