#include "studies/textbook/problem.hpp"

#include "reference/homogeneous_lattice.hpp"
#include "studies/paper/experiment.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace hybmss::textbook {
namespace {

using reference::Matrix3d;
using reference::Vector3d;
using Unknowns = Eigen::Matrix<double, 5, 1>;
using Tractions = Eigen::Matrix<double, 6, 1>;

/// A frame whose first axis lies along `direction`.
Matrix3d frame(const Vector3d& direction) {
    Matrix3d axes;
    axes.col(0) = direction.normalized();
    axes.col(1) = axes.col(0).unitOrthogonal();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    return axes;
}

/// F in the frame: stretched along its first axis, which stays where it is.
Matrix3d deformation(double stretch, const Unknowns& u) {
    Matrix3d f;
    f << stretch, u[0], u[1], 0, u[2], u[3], 0, 0, u[4];
    return f;
}

} // namespace

double uniaxial_stress(const Material& material, const Vector3d& direction, double stretch) {
    constexpr double kLoadStep = 0.02, kDifference = 1e-6;
    const Matrix3d axes = frame(direction);
    const auto stress = [&](double at, const Unknowns& u) -> Matrix3d {
        const Matrix3d f = axes * deformation(at, u) * axes.transpose();
        return axes.transpose() * reference::HomogeneousLattice(material, f).stress() * axes;
    };
    const auto across = [&](double at, const Unknowns& u) -> Tractions {
        return stress(at, u).rightCols<2>().reshaped();
    };
    Unknowns u(0, 0, 1, 0, 1);
    const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(stretch - 1) / kLoadStep)));
    for (int step = 1; step <= steps; ++step) {
        const double at = 1 + (stretch - 1) * step / steps;
        double left = across(at, u).norm();
        for (int iteration = 0; iteration < 50 && left > 1e-12 * material.young_modulus; ++iteration) {
            Eigen::Matrix<double, 6, 5> slopes;
            for (Eigen::Index i = 0; i < 5; ++i) {
                const Unknowns change = kDifference * Unknowns::Unit(i);
                slopes.col(i) = (across(at, u + change) - across(at, u - change)) / (2 * kDifference);
            }
            u -= slopes.colPivHouseholderQr().solve(across(at, u));
            left = across(at, u).norm();
        }
        if (!(left < 1e-9 * material.young_modulus)) {
            throw std::runtime_error("uniaxial stress: no state of the lattice found");
        }
    }
    return stress(stretch, u)(0, 0);
}

paper::Table anisotropy_table() {
    paper::Table table{
        "anisotropy",
        "Anisotropy at finite strain",
        {"The infinite lattice stretched or pressed along a direction, free across: nominal stress over E, and how far "
         "it is above that along an edge. A difference of nothing at small strain is the isotropy that the springs are "
         "made for. Where springs act, between nodes or on means, makes no difference here. Last: St Venant and "
         "Kirchhoff, s (s^2 - 1)/2 at the stretch s, whatever nu."},
        {{"poisson_ratio", "nu"},
         {"face_diagonal_ratio", "A"},
         {"strain", "strain, %"},
         {"edge", "<100>", 5},
         {"face_diagonal", "<110>, %", 2},
         {"between", "<210>, %", 2},
         {"cube_diagonal", "<111>, %", 2},
         {"kirchhoff", "St Venant and Kirchhoff", 5}},
        {},
        {"Along edges and diagonals springs turn differently with the load: at 20 % the lattice is not isotropic any "
         "more."}};
    for (const double nu : {0.0, 0.25, 0.45}) {
        for (const double ratio : {1.0, 0.0}) {
            for (const double strain : {-0.3, -0.2, -0.1, -0.01, 0.01, 0.1, 0.2, 0.5, 1.0}) {
                const Material material{
                    .young_modulus = 1, .poisson_ratio = nu, .density = 1, .face_diagonal_ratio = ratio};
                const double s = 1 + strain;
                auto& row = table.rows.emplace_back();
                row = {fmt::format("{:g}", nu), fmt::format("{:g}", ratio), fmt::format("{:g}", 100 * strain)};
                double edge = std::nan("");
                for (const Vector3d& along :
                     {Vector3d(1, 0, 0), Vector3d(1, 1, 0), Vector3d(2, 1, 0), Vector3d(1, 1, 1)}) {
                    double stress = std::nan("");
                    try {
                        stress = uniaxial_stress(material, along, s);
                    } catch (const std::runtime_error&) { // printed as none
                    }
                    const bool is_first = row.size() == 3;
                    edge = is_first ? stress : edge;
                    row.emplace_back(is_first ? stress : 100 * (stress / edge - 1));
                }
                row.emplace_back(s * (s * s - 1) / 2);
            }
        }
    }
    return table;
}

} // namespace hybmss::textbook
