#include "studies/textbook/problem.hpp"

#include "reference/homogeneous_lattice.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

namespace hybmss::textbook {
namespace {

using reference::HomogeneousLattice;
using reference::Matrix3d;
using reference::Vector3d;

Material material_of(double nu, VolumeEnergy energy = VolumeEnergy::automatic) {
    return {.young_modulus = 1, .poisson_ratio = nu, .density = 1, .volume_energy = energy};
}

/// P of W = G/2 (tr F^T F - 3 - 2 ln J) + lambda/2 (ln J)^2 in a bar that is free across, E = 1.
double neo_hooke(double nu, double stretch) {
    const double G = 1 / (2 * (1 + nu)), lambda = 2 * G * nu / (1 - 2 * nu);
    const auto stress = [&](double own, double j) { return G * (own - 1 / own) + lambda * std::log(j) / own; };
    double low = 0.1, high = 10; // across: its stress grows with it
    for (int i = 0; i < 100; ++i) {
        const double across = std::sqrt(low * high);
        (stress(across, stretch * across * across) > 0 ? high : low) = across;
    }
    return stress(stretch, stretch * low * low);
}

const Vector3d kEdge(1, 0, 0), kFaceDiagonal(1, 1, 0), kCubeDiagonal(1, 1, 1);

/// The slowest and the fastest of three waves of a length, over what they are in the continuum; the middle one too.
std::array<double, 3> speeds(const Material& material, const Vector3d& direction, double cells) {
    const Vector3d n = direction.normalized();
    const HomogeneousLattice lattice(material, Matrix3d::Identity());
    const double q = 2 * std::numbers::pi / cells;
    const Vector3d own = Eigen::SelfAdjointEigenSolver<Matrix3d>(lattice.wave_stiffness(q * n)).eigenvalues() / (q * q),
                   continuum = Eigen::SelfAdjointEigenSolver<Matrix3d>(lattice.acoustic_tensor(n)).eigenvalues();
    return {std::sqrt(own[0] / continuum[0]), std::sqrt(own[1] / continuum[1]), std::sqrt(own[2] / continuum[2])};
}

/// Whether long waves of every direction looked at are held at the deformation, springs and volume together.
bool is_elliptic(const Material& material, const Matrix3d& f) {
    const HomogeneousLattice lattice(material, f);
    constexpr int kSteps = 12;
    for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; j <= kSteps; ++j) {
            const double polar = std::numbers::pi / 2 * i / kSteps, around = std::numbers::pi / 2 * j / kSteps;
            const Vector3d n(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), std::cos(polar));
            if (Eigen::SelfAdjointEigenSolver<Matrix3d>(lattice.acoustic_tensor(n)).eigenvalues()[0] <= 0) {
                return false;
            }
        }
    }
    return true;
}

/// The first stretch on the way from 1 to `end` at which `holds` fails; nothing where it does not.
template <class Holds>
std::optional<double> lost_at(double end, const Holds& holds) {
    constexpr int kSteps = 200;
    for (int i = 1; i <= kSteps; ++i) {
        double good = 1 + (end - 1) * (i - 1) / kSteps, bad = 1 + (end - 1) * i / kSteps;
        if (holds(bad)) {
            continue;
        }
        for (int halving = 0; halving < 20; ++halving) {
            const double middle = (good + bad) / 2;
            (holds(middle) ? good : bad) = middle;
        }
        return bad;
    }
    return std::nullopt;
}

paper::Cell cell(const std::optional<double>& value) {
    return value ? paper::Cell(*value) : paper::Cell(std::string("held"));
}

paper::Table uniaxial_table() {
    paper::Table table;
    table.name = "uniaxial";
    table.title = "The uniaxial law from half to double length";
    table.introduction = {
        "Nominal stress over E of the infinite lattice, A = 1, free across, along an edge and along two diagonals; of "
        "a "
        "compressible neo-Hookean material, W = G/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2; and of St Venant's and "
        "Kirchhoff's. All have the same E and nu at small strain."};
    table.columns = {{"poisson_ratio", "nu"},
                     {"stretch", "stretch", 2},
                     {"edge", "<100>", 4},
                     {"face_diagonal", "<110>", 4},
                     {"cube_diagonal", "<111>", 4},
                     {"neo_hooke", "neo-Hooke", 4},
                     {"kirchhoff", "St Venant and Kirchhoff", 4}};
    for (const double nu : {0.0, 0.25, 0.45}) {
        for (int percent = 50; percent <= 200; percent += 10) {
            const double stretch = percent / 100.0;
            auto& row = table.rows.emplace_back();
            row = {fmt::format("{:g}", nu), stretch};
            for (const Vector3d& along : {kEdge, kFaceDiagonal, kCubeDiagonal}) {
                try {
                    row.emplace_back(uniaxial_stress(material_of(nu), along, stretch));
                } catch (const std::runtime_error&) { // no state: printed as none
                    row.emplace_back();
                }
            }
            row.emplace_back(neo_hooke(nu, stretch));
            row.emplace_back(stretch * (stretch * stretch - 1) / 2);
        }
    }
    table.remarks = {"Springs are linear in their own lengths: pulled, the lattice is between neo-Hooke and St Venant; "
                     "pressed, it does not resist as a continuum that cannot be crushed does (`crush_resistance`)."};
    return table;
}

paper::Table dispersion_table() {
    paper::Table table;
    table.name = "dispersion";
    table.title = "Dispersion by direction";
    table.introduction = {
        "Speed of plane waves over that of long ones, less one, in percent, by their length in cells; at "
        "rest, A = 1. The two slow waves are the transverse ones, the fast one is longitudinal."};
    table.columns = {{"springs", "springs"},       {"poisson_ratio", "nu"}, {"direction", "direction"},
                     {"cells", "cells a wave", 0}, {"slow", "slow, %", 3},  {"middle", "middle, %", 3},
                     {"fast", "fast, %", 3}};
    for (const SpringForm form : {SpringForm::nodes, SpringForm::means}) {
        for (const double nu : {0.25, 0.45}) {
            for (const auto& [name, direction] :
                 {std::pair{"<100>", kEdge}, {"<110>", kFaceDiagonal}, {"<111>", kCubeDiagonal}}) {
                for (const double cells : {4.0, 8.0, 16.0, 32.0}) {
                    Material material = material_of(nu);
                    material.springs = form;
                    const auto [slow, middle, fast] = speeds(material, direction, cells);
                    table.rows.push_back({std::string(form == SpringForm::nodes ? "nodes" : "means"),
                                          fmt::format("{:g}", nu), std::string(name), cells, 100 * (slow - 1),
                                          100 * (middle - 1), 100 * (fast - 1)});
                }
            }
        }
    }
    table.remarks = {"Half the wave, four times the error: of the second order in every direction."};
    return table;
}

paper::Table convexity_table() {
    paper::Table table;
    table.name = "convexity";
    table.title = "Where the energy stops holding";
    table.introduction = {
        "The first stretch from 1 on at which the infinite lattice, A = 1, loses: under a dilation the same in all "
        "directions, the growth of its tension with the stretch (its energy is then no more convex in it); under the "
        "dilation, and pulled or pressed along an edge while held across, strong ellipticity: some long wave is not "
        "held. Looked at from 0.5 to 2; \"held\": not lost there."};
    table.columns = {{"poisson_ratio", "nu"},
                     {"energy", "volume energy"},
                     {"dilated", "dilated: convex", 3},
                     {"pressed", "pressed all around: convex", 3},
                     {"dilated_waves", "dilated: elliptic", 3},
                     {"pulled", "pulled: elliptic", 3},
                     {"squeezed", "pressed: elliptic", 3}};
    for (const double nu : {-0.5, 0.0, 0.2, 0.25, 0.45, 0.49}) {
        for (const VolumeEnergy energy : {VolumeEnergy::quadratic, VolumeEnergy::mean_stretch}) {
            const Material material = material_of(nu, energy);
            const auto tension = [&](double s) {
                return HomogeneousLattice(material, s * Matrix3d::Identity()).stress()(0, 0);
            };
            const auto convex = [&](double s) {
                constexpr double kStep = 1e-5;
                return tension(s + kStep) > tension(s - kStep);
            };
            const auto dilated = [&](double s) { return is_elliptic(material, s * Matrix3d::Identity()); };
            const auto along = [&](double s) { return is_elliptic(material, Vector3d(s, 1, 1).asDiagonal()); };
            table.rows.push_back({fmt::format("{:g}", nu),
                                  std::string(energy == VolumeEnergy::quadratic ? "quadratic" : "mean stretch"),
                                  cell(lost_at(2, convex)), cell(lost_at(0.5, convex)), cell(lost_at(2, dilated)),
                                  cell(lost_at(2, along)), cell(lost_at(0.5, along))});
        }
    }
    table.remarks = {"`automatic` takes quadratic at nu >= 1/4, mean stretch below; at nu = 1/4 there is none."};
    return table;
}

} // namespace

std::vector<paper::Table> law_tables() {
    return {uniaxial_table(), dispersion_table(), convexity_table()};
}

} // namespace hybmss::textbook
