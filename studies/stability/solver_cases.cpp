/// The solvers on uneven and meagre bodies, from scrambled states, in float, with bad numbers, and at long implicit
/// steps.

#include "studies/stability/static_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss::stability {
namespace {

Vectors at_rest(const Lattice& lattice) {
    return Vectors(rest_positions_of(lattice).size(), Vector3d::Zero());
}

double greatest_difference(const Vectors& a, const Vectors& b) {
    double greatest = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        greatest = std::max(greatest, (a[n] - b[n]).norm());
    }
    return greatest;
}

void require_minimum(const StaticSolve& end) {
    require(end.check.falling_directions == 0,
            fmt::format("the energy falls in {} directions", end.check.falling_directions));
}

Outcome answer(const Lattice& lattice, const Material& material, const Loading& loading) {
    const StaticSolve end = solve(lattice, material, loading, at_rest(lattice));
    if (!end.converged()) {
        return unsolved(end, lattice);
    }
    require_minimum(end);
    require(end.result.min_cell_volume_ratio > 0, "cells are inverted");
    return solved(end, fmt::format("a stable equilibrium; {} load steps, {} Newton iterations", end.result.load_steps,
                                   end.result.newton_iterations));
}

/// A column whose lower half is a millionth as stiff: it takes the whole strain.
Outcome stiffness_contrast(SpringForm springs) {
    Lattice lattice = Lattice::box(3, 6, 3, kCellSize);
    for (int k = 0; k < 3; ++k) {
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 3; ++i) {
                lattice.set_cell_scale(i, j, k, 1e-6f);
            }
        }
    }
    const Loading loading = plates(lattice, PlateMotion::compression, 0.1);
    const StaticSolve end = solve(lattice, case_material(springs, 0.4), loading, at_rest(lattice));
    if (!end.converged()) {
        return unsolved(end, lattice);
    }
    require_minimum(end);
    const double share = end.displacements[lattice.grid_node_index(1, 4, 1)].y() / (-0.1 * 6 * kCellSize);
    require(std::abs(share - 1) < 1e-4, fmt::format("the stiff half moved by {:.6f} of the plate's way", share));
    return solved(end, fmt::format("the stiff half moves with the plate, but for {:.0e}", std::abs(share - 1)));
}

/// A slender rod whose weight, across it, bends it by a good part of its length.
Outcome bent_rod(const Material& material) {
    const Lattice lattice = Lattice::box(1, 30, 1, kCellSize);
    Loading loading = held_below(lattice);
    loading.acceleration = {0.002, 0, 0};
    return answer(lattice, material, loading);
}

/// Cells on a string: each touches the next by an edge or a corner only, the last is pulled: along the string, or
/// across, so that it must first turn in its joints, which nothing resists.
Outcome pulled_chain(SpringForm springs, bool by_corner, bool across) {
    Lattice lattice = Lattice::box(by_corner ? 3 : 1, 3, 3, kCellSize);
    for (int k = 0; k < 3; ++k) {
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < lattice.cells()[0]; ++i) {
                lattice.set_cell_scale(i, j, k, j == k && (!by_corner || i == j) ? 1.0f : 0.0f);
            }
        }
    }
    Loading loading = held_below(lattice);
    loading.forces.assign(lattice.nodes().size(), {0, 0, 0});
    loading.forces.back() = {by_corner && !across ? 20.0 : 0.0, 20, across ? 5.0 : 20.0};
    return answer(lattice, case_material(springs, 0.4), loading);
}

Outcome empty_lattice(SpringForm springs) {
    const Lattice empty = Lattice::from_cells(1, 1, 1, kCellSize, {0.0f});
    EquilibriumSolver<double> solver(empty, case_material(springs, 0.4));
    const EquilibriumResult result = solver.solve({}, {});
    require(result.status == EquilibriumStatus::converged, result.message);
    require(solver.node_count() == 0 && result.potential == 0, "it has nodes or an energy");
    return right("no nodes, no energy: at rest");
}

/// The static solver in float against double at a strain of 1e-7.
Outcome small_strain(SpringForm springs) {
    const Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    const Loading loading = plates(lattice, PlateMotion::compression, 1e-7);
    const StaticSolve precise = solve(lattice, case_material(springs, 0.4), loading, at_rest(lattice));
    require(precise.converged(), precise.result.message);
    EquilibriumSolver<float> solver(lattice, case_material(springs, 0.4));
    std::vector<float> u(3 * solver.node_count());
    EquilibriumOptions options;
    options.tolerance = 1e-5; // a float sum of some dozen forces
    const EquilibriumResult result =
        solver.solve(loading, VectorField<float>::aos(u.data(), solver.node_count()), options);
    if (result.status != EquilibriumStatus::converged) {
        return error(result.message);
    }
    Vectors there;
    for (std::size_t n = 0; n < solver.node_count(); ++n) {
        there.push_back(Eigen::Map<const Eigen::Vector3f>(u.data() + 3 * n).cast<double>());
    }
    const double off = greatest_difference(there, precise.displacements) / greatest_length(precise.displacements);
    require(off < 1e-4, fmt::format("off by {:.1e} of the displacements", off));
    Outcome outcome = right(fmt::format("off by {:.1e} of the displacements from double", off));
    outcome.residual = result.residual;
    outcome.iterations = result.cg_iterations;
    return outcome;
}

enum class Scramble { random, flat, mirrored };

/// The nodes at y = 0 stay at rest: they are held in some cases, and must then drive nothing.
Vectors scrambled(const Vectors& rest, Scramble scramble) {
    Vectors u = random_vectors(rest.size(), (scramble == Scramble::random ? 2 : 1e-3) * kCellSize, 61);
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (rest[n].y() == 0) {
            u[n].setZero();
        } else if (scramble != Scramble::random) {
            u[n].y() -= (scramble == Scramble::flat ? 1 : 2) * rest[n].y();
        }
    }
    return u;
}

/// Let go from a scrambled state, nothing driving it: the energy must not have risen, and the end be stable.
Outcome recover(const Material& material, Scramble scramble) {
    const Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    Vectors start = scrambled(rest_positions_of(lattice), scramble);
    EquilibriumSolver<double> solver(lattice, material);
    Vectors force(start.size());
    const double before = solver.get_forces(view(start), view(force)).total();
    EquilibriumOptions options;
    options.newton_iterations = 2000;
    options.load_steps = 1; // there is no load to be cut
    const StaticSolve end = solve(lattice, material, held_below(lattice), start, options);
    if (!end.converged()) {
        return unsolved(end, lattice);
    }
    require(end.result.potential <= before, "the energy has risen");
    require_minimum(end);
    const bool rests = end.result.potential < 1e-12 * before && end.result.min_cell_volume_ratio > 0.999;
    return solved(end, rests ? "back at rest, up to a rigid motion"
                             : fmt::format("another stable equilibrium, energy {:.1e} of the start's",
                                           end.result.potential / before));
}

/// Backward Euler at a hundred times the explicit limit: the pressed cube settles where the static solver says.
Outcome long_steps(const Material& material) {
    const Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    constexpr double kStrain = 0.2;
    const StaticSolve fixed =
        solve(lattice, material, plates(lattice, PlateMotion::compression, kStrain), at_rest(lattice));
    require(fixed.converged(), fixed.result.message);
    const double dt = 100 * BodyMotion<double>(lattice, material).critical_time_step();
    EquilibriumSolver<double> solver(lattice, material);
    Vectors u = at_rest(lattice), v = u;
    long products = 0;
    constexpr int kDriven = 20, kSteps = 100;
    for (int step = 1; step <= kSteps; ++step) {
        const double strain = kStrain * std::min(step, kDriven) / kDriven;
        const EquilibriumResult result =
            solver.step(plates(lattice, PlateMotion::compression, strain), dt, 1, view(u), view(v));
        require(result.status == EquilibriumStatus::converged, fmt::format("step {}: {}", step, result.message));
        products += result.cg_iterations;
    }
    const double off = greatest_difference(u, fixed.displacements) / greatest_length(fixed.displacements);
    require(off < 1e-4, fmt::format("off by {:.1e} of the displacements", off));
    Outcome outcome = right(fmt::format("after {} steps off by {:.1e} from the static solver", kSteps, off));
    outcome.min_cell_volume_ratio = least_volume_ratio(lattice, u);
    outcome.iterations = products;
    return outcome;
}

/// Backward Euler from random displacements without other damping: each step minimises
/// W(u) + m/2dt^2 |u - u_0 - dt v_0|^2, so W + T cannot rise by more than the start's motion allows; from rest and all
/// the way down it must fall.
Outcome scrambled_steps(const Material& material) {
    const Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    EquilibriumSolver<double> solver(lattice, material);
    Vectors u = scrambled(rest_positions_of(lattice), Scramble::random), v = at_rest(lattice), force = v;
    const double dt = 100 * BodyMotion<double>(lattice, material).critical_time_step();
    const auto energy = [&] {
        double sum = solver.get_forces(view(u), view(force)).total();
        for (std::size_t n = 0; n < v.size(); ++n) {
            sum += 0.5 * solver.masses()[n] * v[n].squaredNorm();
        }
        return sum;
    };
    const double start = energy();
    double greatest = 0;
    long products = 0;
    constexpr int kSteps = 50;
    EquilibriumOptions options;
    options.tolerance = 1e-6; // forces fall far below those that rounding of the start's was measured by
    for (int step = 0; step < kSteps; ++step) {
        const EquilibriumResult result = solver.step({}, dt, 0, view(u), view(v), options);
        require(result.status == EquilibriumStatus::converged, fmt::format("step {}: {}", step, result.message));
        greatest = std::max(greatest, energy() / start);
        products += result.cg_iterations;
    }
    require(greatest <= 1 + 1e-9, fmt::format("the energy rose to {:.3f} of the start's", greatest));
    Outcome outcome = right(fmt::format("never above {:.1e} of the start's energy; {:.1e} after {} steps", greatest,
                                        energy() / start, kSteps));
    outcome.min_cell_volume_ratio = least_volume_ratio(lattice, u);
    outcome.iterations = products;
    return outcome;
}

enum class Place { support, load, gravity };

Outcome bad_loading(SpringForm springs, double value, Place place) {
    const Lattice lattice = Lattice::box(2, 2, 2, kCellSize);
    Loading loading = held_below(lattice);
    if (place == Place::support) {
        loading.supports.front().displacement = {value, 0, 0};
    } else if (place == Place::load) {
        loading.forces.assign(lattice.nodes().size(), {0, 0, 0});
        loading.forces.back() = {0, value, 0};
    } else {
        loading.acceleration = {0, value, 0};
    }
    Vectors u = at_rest(lattice);
    EquilibriumSolver<double> solver(lattice, case_material(springs, 0.4));
    const EquilibriumResult result = solver.solve(loading, view(u));
    require(result.status != EquilibriumStatus::converged, "converged");
    for (const Vector3d& x : u) {
        require(x.allFinite(), "the state left behind is not finite");
    }
    return error(result.message);
}

void append_recoveries(std::vector<HardCase>& cases, SpringForm springs) {
    struct From {
        Scramble scramble;
        const char* name;
    };
    constexpr From kFrom[] = {
        {Scramble::random, "random by 2 edges"}, {Scramble::flat, "flat"}, {Scramble::mirrored, "mirror image"}};
    for (const double nu : {0.0, 0.25, 0.4, 0.49}) {
        for (const From& from : kFrom) {
            const Scramble scramble = from.scramble;
            cases.push_back({fmt::format("solver: from {}, nu = {:g}", from.name, nu),
                             "a stable equilibrium, energy not risen, or an error", Wanted::answer_or_error, nu == 0.4,
                             [=] { return recover(case_material(springs, nu), scramble); }});
        }
    }
    for (const double nu : {0.0, 0.25, 0.49}) {
        cases.push_back({fmt::format("solver: backward Euler, 100 critical steps, compression by 20 %, nu = {:g}", nu),
                         "settles to the static equilibrium to 1e-4", Wanted::answer, nu == 0.25,
                         [=] { return long_steps(case_material(springs, nu)); }});
    }
    for (const double nu : {0.25, 0.49}) {
        cases.push_back({fmt::format("solver: backward Euler, 100 critical steps, random by 2 edges, nu = {:g}", nu),
                         "the energy does not rise", Wanted::answer, nu == 0.25,
                         [=] { return scrambled_steps(case_material(springs, nu)); }});
    }
}

} // namespace

void append_solver_cases(std::vector<HardCase>& cases, SpringForm springs) {
    const auto add = [&](const std::string& name, const char* asked, std::function<Outcome()> run) {
        cases.push_back({"solver: " + name, asked, Wanted::answer, true, std::move(run)});
    };
    const char* const equilibrium = "a stable equilibrium";
    add("stiffness contrast 1e6", equilibrium, [=] { return stiffness_contrast(springs); });
    for (const double nu : {-0.5, 0.25, 0.49}) {
        const Material material = case_material(springs, nu);
        add(fmt::format("single cell pulled by 20 %, nu = {:g}", nu), equilibrium, [=] {
            const Lattice cell = Lattice::box(1, 1, 1, kCellSize);
            return answer(cell, material, plates(cell, PlateMotion::tension, 0.2));
        });
        cases.push_back({fmt::format("solver: rod of 1x30x1 cells bent by its weight, nu = {:g}", nu), equilibrium,
                         Wanted::answer, nu < 0.49, [=] { return bent_rod(material); }});
    }
    for (const bool by_corner : {false, true}) {
        const char* const joint = by_corner ? "corners" : "edges";
        add(fmt::format("cells joined by {}, pulled along", joint), equilibrium,
            [=] { return pulled_chain(springs, by_corner, false); });
        cases.push_back({fmt::format("solver: cells joined by {}, pulled across", joint),
                         "a stable equilibrium, or an error: the joints resist no load, however small",
                         Wanted::answer_or_error, true, [=] { return pulled_chain(springs, by_corner, true); }});
    }
    add("empty lattice", "is nothing", [=] { return empty_lattice(springs); });
    add("strain 1e-7 in float", "as in double to 1e-4", [=] { return small_strain(springs); });
    append_recoveries(cases, springs);
    struct Where {
        Place place;
        const char* name;
    };
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                     kInfinity = std::numeric_limits<double>::infinity();
    for (const Where& where : {Where{Place::support, "support displaced by"}, Where{Place::load, "load of"},
                               Where{Place::gravity, "gravity of"}}) {
        for (const double value : {kNan, kInfinity, 1e300}) {
            const Place place = where.place;
            cases.push_back({fmt::format("solver: {} {:g}", where.name, value), "an error", Wanted::error, true,
                             [=] { return bad_loading(springs, value, place); }});
        }
    }
}

} // namespace hybmss::stability
