// Figures of the clamped cube of 10^3 cells that were computed independently, with a sparse direct solver.
#include "clamped_cube.hpp"

#include <gtest/gtest.h>

namespace hybmss::testing {
namespace {

constexpr int kCells = 10;
constexpr double kCellSize = 0.5, kEdge = kCells * kCellSize;

struct Case {
    const char* what;
    double poisson_ratio;
    PlateMotion motion;
    double force;         ///< N, the component that the plate exerts along its motion; or the torque, N m
    double volume_change; ///< percent; negative: not known
};

template <class T>
void check(const Case& expected, double tolerance) {
    SCOPED_TRACE(expected.what);
    const Lattice lattice = Lattice::box(kCells, kCells, kCells, kCellSize);
    EquilibriumSolver<T> solver(lattice, {.young_modulus = 1e4, .poisson_ratio = expected.poisson_ratio});
    std::vector<std::array<T, 3>> u(solver.node_count()), f(u.size());
    EquilibriumOptions options;
    options.tolerance = tolerance;
    const auto result =
        solver.solve(plates(lattice, expected.motion), VectorField<T>::aos(u[0].data(), u.size()), options);
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_LE(result.residual, tolerance);
    EXPECT_EQ(result.load_fraction, 1);
    solver.get_forces(VectorField<T>::aos(u[0].data(), u.size()), VectorField<T>::aos(f[0].data(), u.size()));
    std::vector<Vector> displacement, force;
    for (std::size_t n = 0; n < u.size(); ++n) {
        displacement.push_back({u[n][0], u[n][1], u[n][2]});
        force.push_back({f[n][0], f[n][1], f[n][2]});
    }
    const PlateReading reading = read_plate(lattice, displacement, force);
    const bool torsion = expected.what[0] == 't', shear = expected.what[0] == 's';
    const double measured = torsion ? reading.torque : shear ? reading.force[0] : -reading.force[1];
    EXPECT_NEAR(std::abs(measured), expected.force, 1e-3 * expected.force);
    if (expected.volume_change > 0) {
        // A tenth of a percent of the figure, or half of its last printed digit.
        EXPECT_NEAR(100 * reading.volume_change, expected.volume_change, std::max(1e-3 * expected.volume_change, 6e-4));
    }
}

const Case kCompression5 = {"compression 5%", 0.25, translated({0, -0.05 * kEdge, 0}), 12743.8, 3.167};
const Case kCompression20 = {"compression 20%", 0.25, translated({0, -0.2 * kEdge, 0}), 46526.7, 13.519};
const Case kShear5 = {"shear 5%", 0.25, translated({0.05 * kEdge, 0, 0}), 3377.8, -1};
const Case kShear20 = {"shear 20%", 0.25, translated({0.2 * kEdge, 0, 0}), 14108.3, -1};
const Case kTorsion36 = {"torsion 36 degrees", 0.25, turned(36, kEdge / 2), 47351.7, -1};
const Case kStiff5 = {"compression 5%, nu = 0.499", 0.499, translated({0, -0.05 * kEdge, 0}), 16425.3, 0.020};
const Case kStiff20 = {"compression 20%, nu = 0.499", 0.499, translated({0, -0.2 * kEdge, 0}), 79497.9, 0.108};
const Case kStretch20 = {"compression 20%, nu = 0", 0, translated({0, -0.2 * kEdge, 0}), 37285.7, 19.849};

class EquilibriumFigures : public ::testing::TestWithParam<Case> {};

TEST_P(EquilibriumFigures, AreMet) {
    check<double>(GetParam(), 1e-8);
}

INSTANTIATE_TEST_SUITE_P(ClampedCube, EquilibriumFigures,
                         ::testing::Values(kCompression5, kCompression20, kShear5, kShear20, kTorsion36, kStiff5,
                                           kStiff20, kStretch20),
                         [](const auto& at) {
                             std::string name = at.param.what;
                             std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                             return name;
                         });

TEST(EquilibriumFigures, AreMetInFloat) {
    check<float>(kCompression20, 1e-4);
    check<float>(kTorsion36, 1e-4);
}

} // namespace
} // namespace hybmss::testing
