#include "studies/textbook/problem.hpp"

#include "hybmss/equilibrium.hpp"
#include "studies/calculix/program.hpp"
#include "studies/paper/experiment.hpp"
#include "studies/stability/static_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

namespace hybmss::textbook {
namespace {

using reference::Vector3d;
using stability::Vectors;

Lattice bar(int across, int length) {
    return Lattice::box(across, across, length * across, 1.0 / across);
}

/// omega^2 from the lowest on.
std::vector<double> eigenvalues(EquilibriumSolver<double>& solver, const std::vector<PrescribedNode>& supports,
                                const Vectors& u, int count) {
    Vectors state = u;
    const ModesResult result = solver.modes(supports, stability::view(state), {.count = count});
    if (!result.converged) {
        throw std::runtime_error("textbook problem: vibrations not found");
    }
    std::vector<double> values;
    for (const Mode& mode : result.modes) {
        values.push_back(mode.eigenvalue);
    }
    return values;
}

/// Lame's: u = cos(kx) sin(ky), v = -sin(kx) cos(ky) with k = pi moves no free face by force, omega^2 = 2 k^2 G / rho.
/// Of the lowest ones that which is most like it.
Answer lame_mode(const Material& material, int n) {
    const Lattice lattice = bar(n, 1);
    const Vectors rest = stability::rest_positions_of(lattice);
    EquilibriumSolver<double> solver(lattice, material, stability::one_thread());
    Vectors state(rest.size(), Vector3d::Zero());
    double most = 0, eigenvalue = 0;
    for (const Mode& mode : solver.modes({}, stability::view(state), {.count = 16}).modes) {
        double alike = 0;
        for (std::size_t i = 0; i < rest.size(); ++i) {
            const double x = kPi * rest[i].x(), y = kPi * rest[i].y();
            const Vector3d lame(std::cos(x) * std::sin(y), -std::sin(x) * std::cos(y), 0);
            alike += solver.masses()[i] * lame.dot(Vector3d(mode.shape[i].data()));
        }
        if (std::abs(alike) > most) {
            most = std::abs(alike);
            eigenvalue = mode.eigenvalue;
        }
    }
    return {std::sqrt(eigenvalue) / (2 * kPi), std::sqrt(shear_modulus(material) / material.density / 2)};
}

/// Held across its axis at both ends, where it may turn.
struct HingedBar {
    HingedBar(const Material& given, int n, int bar_length)
        : lattice(bar(n, bar_length)), rest(stability::rest_positions_of(lattice)),
          solver(lattice, given, stability::one_thread()), u(rest.size(), Vector3d::Zero()), length(bar_length) {
        for (std::size_t i = 0; i < rest.size(); ++i) {
            if (is_end(i)) {
                loading.supports.push_back({static_cast<std::uint32_t>(i), 3, {0, 0, 0}, {0, 0, 0}});
            }
        }
    }
    bool is_end(std::size_t i) const { return rest[i].z() < 1e-9 || rest[i].z() > length - 1e-9; }

    /// A pressure on both ends.
    Loading pressed(double pressure) const {
        const double h = lattice.cell_size();
        // Nothing else holds it along its axis; in its middle nothing moves that way.
        Loading held = loading;
        held.forces.assign(rest.size(), {0, 0, 0});
        for (std::size_t i = 0; i < rest.size(); ++i) {
            if (is_end(i)) {
                double share = h * h;
                for (const double x : {rest[i].x(), rest[i].y()}) {
                    share /= x < 1e-9 || x > 1 - 1e-9 ? 2 : 1;
                }
                held.forces[i][2] = (rest[i].z() < 1e-9 ? 1 : -1) * pressure * share;
            } else if (std::abs(rest[i].z() - length / 2) < 1e-9 && rest[i].x() < 1e-9 && rest[i].y() < 1e-9) {
                held.supports.push_back({static_cast<std::uint32_t>(i), 4, {0, 0, 0}, {0, 0, 0}});
            }
        }
        return held;
    }
    /// The lowest omega^2 under it.
    double loaded(double pressure) {
        if (pressure > 0) {
            const EquilibriumResult result = solver.solve(pressed(pressure), stability::view(u), {});
            if (result.status != EquilibriumStatus::converged) {
                throw std::runtime_error("textbook problem: " + result.message);
            }
        }
        return eigenvalues(solver, loading.supports, u, 1)[0];
    }

    Lattice lattice;
    Vectors rest;
    EquilibriumSolver<double> solver;
    Vectors u;
    Loading loading;
    double length;
};

Answer hinged_bar(const Material& material, int n) {
    constexpr int kLength = 5;
    return {std::sqrt(HingedBar(material, n, kLength).loaded(0)) / (2 * kPi),
            std::sqrt(paper::timoshenko_eigenvalue(material, 1, kPi / kLength)) / (2 * kPi)};
}

/// Euler's, of the length 20: where the lowest omega^2 of the pressed bar, which falls straight, comes to zero. A
/// secant from rest over 60 % of Euler's load to 0.97 of what it says.
Answer euler_column(const Material& material, int n) {
    constexpr int kLength = 20;
    const double exact = kPi * kPi * material.young_modulus / 12 / (kLength * kLength);
    HingedBar column(material, n, kLength);
    double before = 0, load = 0.6 * exact, at_before = column.loaded(before);
    for (int step = 0; step < 2; ++step) {
        const double at_load = column.loaded(load);
        const double zero = load + at_load * (load - before) / (at_before - at_load);
        before = std::exchange(load, step == 0 ? 0.97 * zero : zero);
        at_before = at_load;
    }
    return {load, exact};
}

/// By linear theory, about rest; of the length 40, where Euler leaves out 0.16 % of shear.
Answer euler_column_linear(const Material& material, int n) {
    constexpr int kLength = 40;
    const double exact = kPi * kPi * material.young_modulus / 12 / (kLength * kLength);
    HingedBar column(material, n, kLength);
    const BucklingResult found = column.solver.buckling(column.pressed(1), {.count = 1});
    if (!found.converged) {
        throw std::runtime_error("textbook problem: no buckling load: " + found.message);
    }
    return {found.loads[0].factor, exact};
}

/// By C3D20 on the same body, 8 cells across: the frequencies of a free cube, or of a bar of 1 x 1 x 5 clamped at z =
/// 0.
const std::vector<double>& finite_element_frequencies(const Material& material, bool clamped) {
    static std::map<bool, std::vector<double>> known;
    std::vector<double>& frequencies = known[clamped];
    if (frequencies.empty()) {
        calculix::Problem problem{calculix::brick_mesh(clamped ? bar(6, 5) : bar(8, 1), calculix::ElementType::c3d20),
                                  material,
                                  {},
                                  calculix::Geometry::linear,
                                  calculix::Law::linear};
        for (std::size_t i = 0; clamped && i < problem.mesh.rest.size(); ++i) {
            if (problem.mesh.rest[i][2] < 1e-9) {
                problem.loading.supports.push_back({static_cast<std::uint32_t>(i), 7, {0, 0, 0}, {0, 0, 0}});
            }
        }
        frequencies = calculix::frequencies(problem, 16);
    }
    return frequencies;
}

/// The first frequencies that differ: bars bend alike both ways.
double different(const std::vector<double>& frequencies, int number) {
    double last = 0;
    for (const double frequency : frequencies) {
        number -= frequency > 1.002 * last;
        last = std::max(last, frequency);
        if (number < 0) {
            return frequency;
        }
    }
    throw std::runtime_error("textbook problem: too few frequencies");
}

/// Ours of the same body.
const std::vector<double>& lattice_frequencies(const Material& material, int n, bool clamped) {
    static std::map<std::tuple<SpringForm, int, bool>, std::vector<double>> known;
    std::vector<double>& frequencies = known[{material.springs, n, clamped}];
    if (frequencies.empty()) {
        const Lattice lattice = clamped ? bar(n, 5) : bar(n, 1);
        EquilibriumSolver<double> solver(lattice, material, stability::one_thread());
        std::vector<PrescribedNode> supports;
        const Vectors rest = stability::rest_positions_of(lattice);
        for (std::size_t i = 0; clamped && i < rest.size(); ++i) {
            if (rest[i].z() < 1e-9) {
                supports.push_back({static_cast<std::uint32_t>(i), 7, {0, 0, 0}, {0, 0, 0}});
            }
        }
        for (const double value : eigenvalues(solver, supports, Vectors(rest.size(), Vector3d::Zero()), 10)) {
            frequencies.push_back(std::sqrt(value) / (2 * kPi));
        }
    }
    return frequencies;
}

Answer beside_finite_elements(const Material& material, int n, bool clamped, int number) {
    return {different(lattice_frequencies(material, n, clamped), number),
            different(finite_element_frequencies(material, clamped), number)};
}

} // namespace

std::vector<Problem> vibration_problems() {
    using enum Agreement;
    return {
        {"free cube, Lame's vibration: Hz", order, 0.03, 1.6, "cells across", {4, 8, 12}, lame_mode},
        {"hinged bar, Timoshenko: first frequency", order, 0.06, 1.5, "cells across", {2, 4, 8}, hinged_bar},
        {"column, Euler: load that buckles it", theory, 0.3, 0, "cells across", {1, 2, 4, 8}, euler_column},
        {"slender column, Euler: linear buckling load", theory, 0.3, 0, "cells across", {2, 4, 8}, euler_column_linear},
    };
}

std::vector<Problem> calculix_problems() {
    std::vector<Problem> problems;
    for (const bool clamped : {false, true}) {
        for (const int number : {0, 1, 2}) {
            problems.push_back(
                {fmt::format("{}, C3D20: frequency {}", clamped ? "clamped bar" : "free cube", number + 1),
                 Agreement::order, 1, 0, "cells across",
                 clamped ? std::vector<int>{2, 4, 8} : std::vector<int>{4, 8, 16},
                 [=](const Material& m, int n) { return beside_finite_elements(m, n, clamped, number); }});
        }
    }
    return problems;
}

} // namespace hybmss::textbook
