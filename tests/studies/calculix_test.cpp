/// CalculiX as a program: what it is asked, what is read back, and one solve where it is installed.

#include "studies/calculix/problem.hpp"
#include "studies/calculix/program.hpp"
#include "studies/paper/experiment.hpp"
#include "tests/program.hpp"

#include <cmath>
#include <sstream>

namespace hybmss {
namespace {

using calculix::ElementType;
using calculix::Geometry;

std::string deck(const calculix::Problem& problem) {
    std::ostringstream out;
    calculix::write_deck(problem, out);
    return out.str();
}

TEST(CalculixMesh, shares_nodes_and_weighs_what_the_cells_weigh) {
    const Lattice lattice = Lattice::box(2, 1, 1, 0.5);
    for (const ElementType type : {ElementType::c3d8i, ElementType::c3d20}) {
        const calculix::BrickMesh mesh = calculix::brick_mesh(lattice, type);
        EXPECT_EQ(mesh.lattice_nodes, 12u);
        EXPECT_EQ(mesh.rest.size(), type == ElementType::c3d8i ? 12u : 32u); // and 20 edges
        ASSERT_EQ(mesh.elements.size(), 2 * mesh.nodes_per_element());
        double weight = 0;
        for (std::size_t n = 0; n < mesh.nodes_per_element(); ++n) {
            weight += mesh.weight_share(n);
        }
        EXPECT_DOUBLE_EQ(weight, 1);
    }
    // Each middle lies half way between its two corners.
    const calculix::BrickMesh mesh = calculix::brick_mesh(lattice, ElementType::c3d20, {1, 2, 3});
    const auto& middle_of_upright = mesh.rest[mesh.elements[16]];
    EXPECT_DOUBLE_EQ(middle_of_upright[0], 1);
    EXPECT_DOUBLE_EQ(middle_of_upright[1], 2);
    EXPECT_DOUBLE_EQ(middle_of_upright[2], 3.25);
}

TEST(CalculixDeck, says_what_the_scene_says) {
    Scene scene = paper::scene({.kind = paper::Kind::beam, .young_modulus = 2e6, .across = 1});
    scene.loads = {{FaceRegion{2, true}, {4, 0, 0}}};
    const std::string text = deck(calculix::scene_problem(scene, ElementType::c3d20, Geometry::nonlinear));
    for (const char* line :
         {"*ELEMENT,TYPE=C3D20,", "*STEP,NLGEOM", "*ELASTIC\n2.000000000000e+06,2.500000000000e-01",
          "*DENSITY\n1.000000000000e+03", "SOLID,GRAV,1.000000000000e+01,0.000000000000e+00,-1.000000000000e+00",
          "*CLOAD\n25,1,1.000000000000e+00"}) {
        EXPECT_NE(text.find(line), std::string::npos) << line << "\nin\n" << text;
    }
    // Four corners and four middles of edges are held, along three axes.
    const calculix::Problem linear = calculix::scene_problem(scene, ElementType::c3d20, Geometry::linear);
    EXPECT_EQ(linear.loading.supports.size(), 8u);
    EXPECT_EQ(deck(linear).find("NLGEOM"), std::string::npos);
}

TEST(CalculixDeck, gives_parts_their_own_stiffness) {
    calculix::Problem problem{calculix::brick_mesh(Lattice::from_cells(2, 1, 1, 1, {1.0f, 0.5f}), ElementType::c3d8i),
                              {.young_modulus = 8, .poisson_ratio = 0.25},
                              {},
                              Geometry::nonlinear,
                              calculix::Law::linear};
    EXPECT_NE(deck(problem).find("*ELASTIC\n4.000000000000e+00"), std::string::npos);
    EXPECT_NE(deck(problem).find("*ELASTIC\n8.000000000000e+00"), std::string::npos);
    problem.law = calculix::Law::neo_hooke; // C10 = G/2 = 1.6, D1 = 2/K = 0.375
    EXPECT_NE(deck(problem).find("NEO HOOKE\n1.600000000000e+00,3.750000000000e-01"), std::string::npos);
}

TEST(CalculixResults, last_increment_counts) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path() / "body.dat";
    test::write_text(path, "\n displacements (vx,vy,vz) for set ALL and time  0.5000000E+00\n\n"
                           "         1  1.000000E+00  2.000000E+00 -3.000000E+00\n"
                           "\n forces (fx,fy,fz) for set HELD and time  0.5000000E+00\n\n"
                           "         1  9.000000E+00  9.000000E+00  9.000000E+00\n"
                           "\n displacements (vx,vy,vz) for set ALL and time  0.1000000E+01\n\n"
                           "         2  4.000000E+00  5.000000E+00 -6.500000E+00\n");
    const auto u = calculix::read_node_table(path, "displacements", 2);
    EXPECT_EQ(u[0], (std::array<double, 3>{0, 0, 0}));
    EXPECT_EQ(u[1], (std::array<double, 3>{4, 5, -6.5}));
    EXPECT_THROW(calculix::read_node_table(path, "stresses", 2), std::runtime_error);
    EXPECT_THROW(calculix::read_node_table(path, "displacements", 1), std::runtime_error);
}

TEST(CalculixResults, stresses_are_means_over_points) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path() / "body.dat";
    const std::string heading = "\n stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz) for set SOLID and time  ";
    test::write_text(path, heading +
                               "0.5000000E+00\n\n"
                               "         1   1  9.0E+00  9.0E+00  9.0E+00  9.0E+00  9.0E+00  9.0E+00\n" +
                               heading +
                               "0.1000000E+01\n\n"
                               "         1   1  1.0E+00  2.0E+00  3.0E+00  4.0E+00  6.0E+00  5.0E+00\n"
                               "         1   2  3.0E+00  2.0E+00  1.0E+00  0.0E+00 -6.0E+00  7.0E+00\n"
                               "         2   1  0.0E+00  0.0E+00  0.0E+00  0.0E+00  1.0E+00  0.0E+00\n");
    const auto s = calculix::read_stresses(path, 2);
    EXPECT_EQ(s[0], (std::array<double, 6>{2, 2, 2, 2, 6, 0}));
    EXPECT_EQ(s[1], (std::array<double, 6>{0, 0, 0, 0, 0, 1}));
    EXPECT_THROW(calculix::read_stresses(path, 1), std::runtime_error);
    EXPECT_THROW(calculix::read_stresses(path, 3), std::runtime_error);
}

TEST(CalculixProgram, is_missed_in_one_line) {
    const std::string path = std::getenv("PATH");
    ::setenv("PATH", "/nowhere", 1);
    std::string message;
    try {
        calculix::solve({});
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    ::setenv("PATH", path.c_str(), 1);
    EXPECT_EQ(message, calculix::kNotInstalled);
}

/// At nu = 0 a clamped cube is a rod: F = E A e linear, E A (e - 3 e^2 / 2 + e^3 / 2) by St Venant and Kirchhoff.
TEST(CalculixProgram, compresses_a_cube) {
    if (!calculix::is_installed()) {
        GTEST_SKIP() << calculix::kNotInstalled;
    }
    const Scene scene = paper::scene({.amount = 20, .poisson_ratio = 0, .across = 2});
    for (const ElementType type : {ElementType::c3d8i, ElementType::c3d20}) {
        for (const Geometry geometry : {Geometry::linear, Geometry::nonlinear}) {
            calculix::Problem problem = calculix::scene_problem(scene, type, geometry);
            problem.stresses = true;
            const calculix::Solution solution = calculix::solve(problem);
            ASSERT_EQ(solution.stresses.size(), 8u);
            double force = 0;
            for (std::size_t n = 0; n < problem.mesh.rest.size(); ++n) {
                force += problem.mesh.rest[n][1] == 5 ? solution.support[n][1] : 0;
            }
            const double e = 0.2, EA = 1e4 * 25;
            const double expected = geometry == Geometry::linear ? EA * e : EA * (e - 1.5 * e * e + 0.5 * e * e * e);
            for (const auto& stress : solution.stresses) { // Cauchy's: no area changes
                EXPECT_NEAR(stress[1], -expected / 25, 1e-5 * expected / 25);
                EXPECT_NEAR(stress[0], 0, 1e-5 * expected / 25);
            }
            EXPECT_NEAR(force, -expected, 1e-5 * expected) << calculix::name(type) << calculix::name(geometry);
            EXPECT_NEAR(solution.displacements[13][1], -0.5, 1e-6); // the node in the middle
        }
    }
}

/// The clamp carries the whole weight, though half a cell of it acts on held nodes.
TEST(CalculixProgram, support_carries_the_weight) {
    if (!calculix::is_installed()) {
        GTEST_SKIP() << calculix::kNotInstalled;
    }
    const Scene scene = paper::scene({.kind = paper::Kind::beam, .young_modulus = 1e8, .across = 1});
    for (const ElementType type : {ElementType::c3d8i, ElementType::c3d20}) {
        const calculix::Solution solution = calculix::solve(calculix::scene_problem(scene, type, Geometry::linear));
        double force = 0;
        for (const auto& f : solution.support) {
            force += f[1];
        }
        EXPECT_NEAR(force, 1000 * 0.4 * 0.4 * 2.4 * 10, 0.01) << calculix::name(type);
    }
}

} // namespace
} // namespace hybmss
