#include "studies/paper/experiment.hpp"
#include "studies/paper/tables.hpp"

#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "reference/homogeneous_lattice.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace hybmss::paper {
namespace {

using reference::Vector3d;

constexpr double kCellsPerWavelength = 10, kWidthsPerWavelength = 10;
constexpr double kWaveNumber = 2 * std::numbers::pi / kCellsPerWavelength; // times the cell edge, which is 1

/// Along axes of symmetry every wave is purely longitudinal or transverse.
struct PlaneWave {
    const char* name;
    bool longitudinal;
    std::array<double, 3> along, moving;
};
constexpr PlaneWave kPlaneWaves[] = {{"P along <100>", true, {1, 0, 0}, {1, 0, 0}},
                                     {"S along <100>", false, {1, 0, 0}, {0, 1, 0}},
                                     {"P along <110>", true, {1, 1, 0}, {1, 1, 0}},
                                     {"S along <110>, moving along <001>", false, {1, 1, 0}, {0, 0, 1}},
                                     {"S along <110>, moving along <1-10>", false, {1, 1, 0}, {1, -1, 0}},
                                     {"P along <111>", true, {1, 1, 1}, {1, 1, 1}},
                                     {"S along <111>", false, {1, 1, 1}, {1, -1, 0}}};

/// rho h^3 omega^2 = U . D(q) U over the continuum's rho c^2 |q|^2 h^3; of the speeds, less 1.
double speed_error(const Material& material, const PlaneWave& wave) {
    const Vector3d q = kWaveNumber * Vector3d(wave.along.data()).normalized(),
                   u = Vector3d(wave.moving.data()).normalized();
    const reference::HomogeneousLattice lattice(material, reference::Matrix3d::Identity());
    const double nu = material.poisson_ratio,
                 modulus = shear_modulus(material) * (wave.longitudinal ? 2 * (1 - nu) / (1 - 2 * nu) : 1);
    return std::sqrt(u.dot(lattice.wave_stiffness(q) * u) / (modulus * q.squaredNorm())) - 1;
}

/// The lowest omega^2 of an infinite bar along z of `across` x `across` cells whose sections move by
/// u exp(i q z): of the two layers of nodes of one cell's length, the upper is the lower one's next.
double bending_eigenvalue(const Material& material, int across) {
    const reference::Body body = reference::assemble(Lattice::box(across, across, 1, 1), material);
    const Eigen::MatrixXd k = reference::hessian(body, std::vector<Vector3d>(body.rest.size(), Vector3d::Zero()));
    const Eigen::Index n = k.rows() / 2;
    const std::complex<double> next = std::polar(1.0, 2 * std::numbers::pi / (kWidthsPerWavelength * across));
    Eigen::MatrixXcd d = (k.topLeftCorner(n, n) + k.bottomRightCorner(n, n)).cast<std::complex<double>>();
    d += next * k.topRightCorner(n, n) + std::conj(next) * k.bottomLeftCorner(n, n);
    Eigen::VectorXd mass(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const auto node = static_cast<std::size_t>(i / 3);
        mass[i] = body.mass[node] + body.mass[node + body.mass.size() / 2];
    }
    const Eigen::VectorXd scale = mass.cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXcd scaled = scale.asDiagonal() * d * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(scaled, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

} // namespace

Table wave_table(TableContext& context) {
    Table table{"waves",
                "Waves on few cells",
                {fmt::format("Small waves on the infinite lattice, {:g} cells a wavelength, and an infinite square bar "
                             "that bends at a wavelength of {:g} widths, as a bar of half that length between hinges "
                             "vibrates first; masses in the nodes. Errors in percent, exact by the matrix D(q) of a "
                             "Bloch wave: of the speed against that of linear elasticity, of the bar's frequency "
                             "against Timoshenko's.",
                             kCellsPerWavelength, kWidthsPerWavelength)},
                {{"poisson_ratio", "nu"}, {"wave", "wave"}, {"cells_per_wavelength", "cells a wavelength", 0}},
                {},
                {}};
    constexpr Model kForms[] = {Model::hybmss_fd, Model::hybmss, Model::hybmss_m};
    for (const Model model : kForms) {
        table.columns.push_back({std::string(name(model)), fmt::format("{}, %", name(model)), 2});
    }
    for (const double nu : {0.0, 0.3, 0.45}) {
        context.progress(fmt::format("waves, nu={:g}", nu));
        const auto add = [&](const std::string& wave, double cells, const auto& error_of) {
            table.rows.push_back({fmt::format("{:g}", nu), wave, cells});
            for (const Model model : kForms) {
                table.rows.back().emplace_back(100 * error_of(with_model({.poisson_ratio = nu}, model)));
            }
        };
        for (const PlaneWave& wave : kPlaneWaves) {
            add(wave.name, kCellsPerWavelength, [&](const Material& m) { return speed_error(m, wave); });
        }
        for (const int across : {1, 2, 4}) {
            add(fmt::format("bending, {} cell{} across", across, across == 1 ? "" : "s"), across * kWidthsPerWavelength,
                [&](const Material& m) {
                    const double of_the_lattice = std::max(0.0, bending_eigenvalue(m, across)); // but for rounding
                    return std::sqrt(of_the_lattice /
                                     timoshenko_eigenvalue(m, across,
                                                           2 * std::numbers::pi / (kWidthsPerWavelength * across))) -
                           1;
                });
        }
    }
    table.remarks = {"A rod one cell thick of HybMSS-FD has a motion that nothing resists, and bends by that."};
    return table;
}

} // namespace hybmss::paper
