#include "studies/paper/tables.hpp"

#include "hybmss/equilibrium.hpp"
#include "simulation/geometry/cells.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <stdexcept>

namespace hybmss::paper {
namespace {

using Vector3 = std::array<double, 3>;

struct Wave {
    Vector3 amplitude, k;
    double phase;
};

/// So small that what the model has beyond linear elasticity is a millionth of the error on the finest mesh.
constexpr double kSmall = 1e-8;
constexpr Wave kWaves[] = {{{kSmall, 0.4 * kSmall, -0.3 * kSmall}, {2.1, 1.3, -0.7}, 0.3},
                           {{-0.5 * kSmall, 0.8 * kSmall, 0.6 * kSmall}, {-1.1, 2.4, 0.9}, 1.1},
                           {{0.2 * kSmall, -0.6 * kSmall, 0.9 * kSmall}, {0.8, -0.6, 2.7}, 2.3}};

double dot(const Vector3& a, const Vector3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vector3 exact_displacement(const Vector3& x) {
    Vector3 u = {0, 0, 0};
    for (const Wave& w : kWaves) {
        for (std::size_t a = 0; a < 3; ++a) {
            u[a] += w.amplitude[a] * std::sin(dot(w.k, x) + w.phase);
        }
    }
    return u;
}

/// d u_a / d x_b
double exact_gradient(const Vector3& x, std::size_t a, std::size_t b) {
    double sum = 0;
    for (const Wave& w : kWaves) {
        sum += w.amplitude[a] * w.k[b] * std::cos(dot(w.k, x) + w.phase);
    }
    return sum;
}

Vector3 body_force(const Vector3& x, const Material& material) {
    const double nu = material.poisson_ratio, G = shear_modulus(material), lambda = 2 * G * nu / (1 - 2 * nu);
    Vector3 b = {0, 0, 0};
    for (const Wave& w : kWaves) {
        const double along = (lambda + G) * dot(w.amplitude, w.k), across = G * dot(w.k, w.k);
        for (std::size_t a = 0; a < 3; ++a) {
            b[a] += (along * w.k[a] + across * w.amplitude[a]) * std::sin(dot(w.k, x) + w.phase);
        }
    }
    return b;
}

bool is_on_boundary(double coordinate, double h) {
    return coordinate < h / 2 || coordinate > 1 - h / 2;
}

Loading manufactured_loading(const Lattice& lattice, const Material& material) {
    Loading loading;
    const double h = lattice.cell_size();
    std::uint32_t number = 0;
    for (const std::uint32_t grid_node : lattice.nodes()) {
        const Vector3 x = lattice.rest_position(grid_node);
        bool on_boundary = false;
        for (const double coordinate : x) {
            on_boundary = on_boundary || is_on_boundary(coordinate, h);
        }
        if (on_boundary) {
            loading.supports.push_back({number, 7, exact_displacement(x), {0, 0, 0}});
        }
        const Vector3 b = body_force(x, material);
        loading.forces.push_back({b[0] * h * h * h, b[1] * h * h * h, b[2] * h * h * h});
        ++number;
    }
    return loading;
}

std::vector<Vector3> solve(const Lattice& lattice, const Material& material) {
    EquilibriumSolver<double> solver(lattice, material);
    std::vector<double> u(3 * solver.node_count(), 0.0);
    const EquilibriumResult result =
        solver.solve(manufactured_loading(lattice, material), VectorField<double>::aos(u.data(), solver.node_count()));
    if (result.status != EquilibriumStatus::converged) {
        throw std::runtime_error("manufactured problem: " + result.message);
    }
    std::vector<Vector3> displacements(solver.node_count());
    for (std::size_t n = 0; n < displacements.size(); ++n) {
        displacements[n] = {u[3 * n], u[3 * n + 1], u[3 * n + 2]};
    }
    return displacements;
}

/// By the trapezoidal rule: a node on a face counts half, on an edge a quarter, on a corner an eighth.
double displacement_error(const Lattice& lattice, const std::vector<Vector3>& u) {
    double error = 0, norm = 0;
    const double h = lattice.cell_size();
    for (std::size_t n = 0; n < u.size(); ++n) {
        const Vector3 x = lattice.rest_position(n); // a box: every grid node is a node
        const Vector3 exact = exact_displacement(x);
        double weight = 1;
        for (std::size_t a = 0; a < 3; ++a) {
            weight *= is_on_boundary(x[a], h) ? 0.5 : 1;
        }
        for (std::size_t a = 0; a < 3; ++a) {
            error += weight * (u[n][a] - exact[a]) * (u[n][a] - exact[a]);
            norm += weight * exact[a] * exact[a];
        }
    }
    return std::sqrt(error / norm);
}

double gradient_error(const Lattice& lattice, const std::vector<Vector3>& u) {
    double error = 0, norm = 0;
    const double h = lattice.cell_size();
    for (const auto& corners : cell_corners(lattice)) {
        Vector3 center = lattice.rest_position(corners[0]);
        for (double& coordinate : center) {
            coordinate += h / 2;
        }
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t b = 0; b < 3; ++b) {
                double gradient = 0;
                for (std::size_t c = 0; c < 8; ++c) {
                    gradient += (c >> b & 1 ? 1 : -1) * u[corners[c]][a] / (4 * h);
                }
                const double exact = exact_gradient(center, a, b);
                error += (gradient - exact) * (gradient - exact);
                norm += exact * exact;
            }
        }
    }
    return std::sqrt(error / norm);
}

} // namespace

std::vector<ConvergenceStep> manufactured_convergence(const Material& material, const std::vector<int>& cells) {
    std::vector<ConvergenceStep> steps;
    for (const int n : cells) {
        const Lattice lattice = Lattice::box(n, n, n, 1.0 / n);
        const std::vector<Vector3> u = solve(lattice, material);
        steps.push_back({n, displacement_error(lattice, u), gradient_error(lattice, u)});
    }
    return steps;
}

double observed_order(double coarse_error, int coarse, double fine_error, int fine) {
    return std::log(coarse_error / fine_error) / std::log(static_cast<double>(fine) / coarse);
}

Table order_table(TableContext& context) {
    Table table{
        "order",
        "Order of convergence",
        {"A unit cube that holds three plane waves of displacement, prescribed on its boundary and kept up inside "
         "by the body force of linear elasticity. The error against the waves themselves, relative: L2 of the "
         "displacement, H1 of its gradient in the cells' centres. Expected order: 2."},
        {{"poisson_ratio", "nu"},
         {"model", "model"},
         {"cells", "cells"},
         {"l2", "L2 error", -3},
         {"l2_order", "order", 3},
         {"h1", "H1 error", -3},
         {"h1_order", "order", 3}},
        {},
        {}};
    const std::vector<int> cells = context.quick ? std::vector<int>{4, 8, 16} : std::vector<int>{4, 8, 16, 32};
    for (const double nu : {0.0, 0.25, 0.45}) {
        for (const Model model : {Model::hybmss_fd, Model::hybmss, Model::hybmss_m}) {
            context.progress(fmt::format("order, nu={:g}, {}", nu, name(model)));
            const auto steps = manufactured_convergence(with_model({.poisson_ratio = nu}, model), cells);
            for (std::size_t s = 0; s < steps.size(); ++s) {
                const auto order = [&](double ConvergenceStep::*error) {
                    return s == 0 ? Cell()
                                  : Cell(observed_order(steps[s - 1].*error, steps[s - 1].cells, steps[s].*error,
                                                        steps[s].cells));
                };
                table.rows.push_back({fmt::format("{:g}", nu), std::string(name(model)), fmt::format("{}^3", cells[s]),
                                      steps[s].displacement, order(&ConvergenceStep::displacement), steps[s].gradient,
                                      order(&ConvergenceStep::gradient)});
            }
        }
    }
    return table;
}

} // namespace hybmss::paper
