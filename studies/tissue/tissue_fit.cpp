#include "studies/tissue/tissue_fit.hpp"

#include "reference/constants.hpp"
#include "reference/springs.hpp"

#include <Eigen/Dense>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hybmss::tissue {
namespace {

using reference::Matrix3d;
using reference::Vector3d;

/// Stretches of tension and of compression, and amounts of shear, each with its nominal stress in kPa.
using Rows = std::array<std::array<double, 6>, 16>;

constexpr std::string_view kBudday =
    "S. Budday et al., Mechanical characterization of human brain tissue, Acta Biomaterialia 48 (2017) 319-340: means "
    "of "
    "human specimens, preconditioned, loaded slowly, glued to plates; as given with M. Peirlinck, K. Linka, J. A. "
    "Hurtado, E. Kuhl, On automated model discovery and a universal material subroutine "
    "(github.com/LivingMatterLab/CANN, "
    "ABAQUS/DATA)";
constexpr Rows kCortex = {{{1.0063, 0.0251, 0.9938, -0.0308, 0.0125, 0.0147},
                           {1.0125, 0.0462, 0.9875, -0.0659, 0.0250, 0.0294},
                           {1.0188, 0.0666, 0.9812, -0.1040, 0.0375, 0.0486},
                           {1.0250, 0.0838, 0.9750, -0.1479, 0.0500, 0.0633},
                           {1.0312, 0.1010, 0.9688, -0.1908, 0.0625, 0.0814},
                           {1.0375, 0.1175, 0.9625, -0.2375, 0.0750, 0.0983},
                           {1.0437, 0.1324, 0.9563, -0.2920, 0.0875, 0.1186},
                           {1.0500, 0.1488, 0.9500, -0.3504, 0.1000, 0.1412},
                           {1.0562, 0.1661, 0.9437, -0.4127, 0.1125, 0.1649},
                           {1.0625, 0.1856, 0.9375, -0.4866, 0.1250, 0.1942},
                           {1.0688, 0.2091, 0.9313, -0.5684, 0.1375, 0.2292},
                           {1.0750, 0.2366, 0.9250, -0.6579, 0.1500, 0.2698},
                           {1.0813, 0.2710, 0.9187, -0.7630, 0.1625, 0.3227},
                           {1.0875, 0.3125, 0.9125, -0.8837, 0.1750, 0.3791},
                           {1.0938, 0.3650, 0.9062, -1.0005, 0.1875, 0.4557},
                           {1.1000, 0.4151, 0.9000, -1.1484, 0.2000, 0.5435}}};
constexpr Rows kCoronaRadiata = {{{1.0063, 0.0157, 0.9938, -0.0193, 0.0125, 0.0079},
                                  {1.0125, 0.0235, 0.9875, -0.0387, 0.0250, 0.0159},
                                  {1.0188, 0.0345, 0.9812, -0.0543, 0.0375, 0.0238},
                                  {1.0250, 0.0423, 0.9750, -0.0800, 0.0500, 0.0318},
                                  {1.0312, 0.0509, 0.9688, -0.1040, 0.0625, 0.0409},
                                  {1.0375, 0.0572, 0.9625, -0.1305, 0.0750, 0.0488},
                                  {1.0437, 0.0642, 0.9563, -0.1674, 0.0875, 0.0601},
                                  {1.0500, 0.0721, 0.9500, -0.2024, 0.1000, 0.0681},
                                  {1.0562, 0.0791, 0.9437, -0.2453, 0.1125, 0.0817},
                                  {1.0625, 0.0869, 0.9375, -0.2959, 0.1250, 0.0964},
                                  {1.0688, 0.0940, 0.9313, -0.3543, 0.1375, 0.1133},
                                  {1.0750, 0.1050, 0.9250, -0.4127, 0.1500, 0.1347},
                                  {1.0813, 0.1151, 0.9187, -0.4827, 0.1625, 0.1596},
                                  {1.0875, 0.1292, 0.9125, -0.5723, 0.1750, 0.1878},
                                  {1.0938, 0.1418, 0.9062, -0.6657, 0.1875, 0.2227},
                                  {1.1000, 0.1582, 0.9000, -0.7591, 0.2000, 0.2611}}};

std::vector<Test> tests_of(const Rows& rows) {
    std::vector<Test> tests = {{"tension", false, {}}, {"compression", false, {}}, {"shear", true, {}}};
    for (const auto& row : rows) {
        for (std::size_t t = 0; t < 3; ++t) {
            tests[t].points.push_back({row[2 * t], 1000 * row[2 * t + 1]});
        }
    }
    return tests;
}

/// P = sum over the 13 springs of k l (e + a e^2 + b e^3) d/|d| r^T + kappa phi'(J) cof F, with cells of the edge 1.
Matrix3d first_piola(const Material& material, const Matrix3d& f) {
    const double g = reference::shear_modulus(material.young_modulus, material.poisson_ratio),
                 ratio = material.face_diagonal_ratio;
    const double stiffness[] = {reference::edge_stiffness(g, ratio, 1), reference::face_diagonal_stiffness(g, ratio, 1),
                                reference::cube_diagonal_stiffness(g, ratio, 1)};
    Matrix3d sum = Matrix3d::Zero();
    for (const Vector3d& r : reference::spring_vectors()) {
        const Vector3d d = f * r;
        const double l = r.norm(), e = d.norm() / l - 1,
                     force = stiffness[std::lround(r.squaredNorm()) - 1] * l *
                             (e + material.stiffening.quadratic * e * e + material.stiffening.cubic * e * e * e);
        sum += force * d.normalized() * r.transpose();
    }
    const double j = f.determinant(), kappa = reference::kappa(material.young_modulus, material.poisson_ratio);
    return sum + kappa * (j - 1) * j * f.inverse().transpose(); // quadratic: nu >= 1/4 here
}

Material material_by(double young_modulus, double poisson_ratio, double quadratic, double cubic) {
    Material material{.young_modulus = young_modulus, .poisson_ratio = poisson_ratio};
    material.stiffening = {quadratic, cubic};
    return material;
}

/// Unknowns without bounds: log E, log b, and where a is between what b allows.
Material material_of(const Eigen::VectorXd& x, double poisson_ratio) {
    const double cubic = std::min(std::exp(x[1]), 1e6);
    const StiffeningRange range = quadratic_stiffening(cubic);
    const double quadratic = range.least + (range.most - range.least) / (1 + std::exp(-x[2]));
    return material_by(std::exp(x[0]), poisson_ratio, std::clamp(quadratic, range.least, range.most), cubic);
}

struct Misfit {
    using Scalar = double;
    using InputType = Eigen::VectorXd;
    using ValueType = Eigen::VectorXd;
    using JacobianType = Eigen::MatrixXd;
    static constexpr int InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic;

    const Tissue* tissue;
    std::vector<std::size_t> tests;
    double poisson_ratio;

    int inputs() const { return 3; }
    int values() const {
        std::size_t count = 0;
        for (const std::size_t t : tests) {
            count += tissue->tests[t].points.size();
        }
        return static_cast<int>(count);
    }
    int operator()(const Eigen::VectorXd& x, Eigen::VectorXd& misfits) const {
        const Material material = material_of(x, poisson_ratio);
        Eigen::Index i = 0;
        for (const std::size_t t : tests) {
            const Test& test = tissue->tests[t];
            double greatest = 0;
            for (const auto& point : test.points) {
                greatest = std::max(greatest, std::abs(point[1]));
            }
            for (const auto& point : test.points) {
                misfits[i++] = (stress(material, test.shear, point[0]) - point[1]) / greatest;
            }
        }
        return 0;
    }
};

} // namespace

const std::vector<Tissue>& tissues() {
    static const std::vector<Tissue> all = {
        {"brain-grey", "human brain, grey matter (cortex)", kBudday, tests_of(kCortex)},
        {"brain-white", "human brain, white matter (corona radiata)", kBudday, tests_of(kCoronaRadiata)}};
    return all;
}

double stress(const Material& material, bool shear, double deformation) {
    if (shear) {
        Matrix3d f = Matrix3d::Identity();
        f(0, 1) = deformation;
        return first_piola(material, f)(0, 1);
    }
    // The stretch across that bears nothing, by halving: the stress across grows with it.
    double low = 0.5, high = 2;
    for (int i = 0; i < 60; ++i) {
        const double across = (low + high) / 2;
        (first_piola(material, Vector3d(deformation, across, across).asDiagonal())(1, 1) > 0 ? high : low) = across;
    }
    return first_piola(material, Vector3d(deformation, low, low).asDiagonal())(0, 0);
}

Fit fit(const Tissue& tissue, double poisson_ratio, std::span<const std::size_t> tests) {
    Misfit misfit{&tissue, {tests.begin(), tests.end()}, poisson_ratio};
    Eigen::NumericalDiff<Misfit, Eigen::Central> differentiable(misfit, 1e-10);
    Fit best;
    double least = std::numeric_limits<double>::infinity();
    // From several places: the sum of squares has more than one valley.
    for (const double cubic : {1.0, 30.0, 300.0}) {
        for (const double quadratic : {-2.0, 0.0, 2.0}) {
            Eigen::VectorXd x(3);
            x << std::log(1000.0), std::log(cubic), quadratic;
            Eigen::LevenbergMarquardt<decltype(differentiable)> method(differentiable);
            method.parameters.maxfev = 400;
            method.minimize(x);
            Eigen::VectorXd left(misfit.values());
            misfit(x, left);
            if (left.squaredNorm() < least) {
                least = left.squaredNorm();
                best.material = material_of(x, poisson_ratio);
            }
        }
    }
    if (!std::isfinite(least)) {
        throw std::runtime_error("tissue: no fit was found");
    }
    for (const Test& test : tissue.tests) {
        double mean = 0, about = 0, left = 0;
        for (const auto& point : test.points) {
            mean += point[1] / static_cast<double>(test.points.size());
        }
        for (const auto& point : test.points) {
            about += std::pow(point[1] - mean, 2);
            left += std::pow(stress(best.material, test.shear, point[0]) - point[1], 2);
        }
        best.r_squared.push_back(1 - left / about);
    }
    return best;
}

namespace {

constexpr double kPoissonRatio = 0.49; // tissues full of water hardly change their volume
const std::vector<std::size_t> kAllTests = {0, 1, 2};

} // namespace

paper::Table fit_table() {
    paper::Table table;
    table.name = "tissue fits";
    table.title = "Tissues as stiffening springs";
    table.introduction = {
        "E, a and b of springs of force k l (e + a e^2 + b e^3) by least squares; nu = 0.49, A = 1, loaded along the "
        "lattice's axes. Every point counts by the greatest stress of its test, so that tests count alike. R^2 of each "
        "test, of those too that the fit did not see.",
        "nu is a choice, not fitted: measured bars tell little of it."};
    table.columns = {{"tissue", "tissue"},
                     {"fitted_to", "fitted to"},
                     {"young_modulus", "E (Pa)", -5},
                     {"quadratic", "a", -5},
                     {"cubic", "b", -5},
                     {"tension", "R^2 tension", 4},
                     {"compression", "R^2 compression", 4},
                     {"shear", "R^2 shear", 4}};
    for (const Tissue& tissue : tissues()) {
        std::vector<std::vector<std::size_t>> choices = {kAllTests, {0}, {1}, {2}};
        for (const std::vector<std::size_t>& tests : choices) {
            const Fit found = fit(tissue, kPoissonRatio, tests);
            const std::string what = tests.size() > 1 ? "all" : std::string(tissue.tests[tests[0]].name);
            table.rows.push_back({std::string(tissue.name), what, found.material.young_modulus,
                                  found.material.stiffening.quadratic, found.material.stiffening.cubic,
                                  found.r_squared[0], found.r_squared[1], found.r_squared[2]});
        }
        table.remarks.push_back(fmt::format("{}: `material.preset = \"{}\"` is its fit to all. Data: {}.", tissue.name,
                                            tissue.preset, tissue.source));
    }
    table.remarks.push_back("A fit is good within the range of its data: stretches of 0.9 to 1.1 and shear up to 0.2.");
    return table;
}

paper::Table point_table() {
    paper::Table table;
    table.name = "tissue points";
    table.title = "The data, and the fits to all tests";
    table.columns = {{"tissue", "tissue"},
                     {"test", "test"},
                     {"deformation", "stretch or shear", 4},
                     {"measured", "measured (Pa)", 1},
                     {"fitted", "fitted (Pa)", 1}};
    for (const Tissue& tissue : tissues()) {
        const Fit found = fit(tissue, kPoissonRatio, kAllTests);
        for (const Test& test : tissue.tests) {
            for (std::size_t p = 3; p < test.points.size(); p += 4) {
                const auto& [at, measured] = test.points[p];
                table.rows.push_back({std::string(tissue.name), std::string(test.name), at, measured,
                                      stress(found.material, test.shear, at)});
            }
        }
    }
    return table;
}

} // namespace hybmss::tissue
