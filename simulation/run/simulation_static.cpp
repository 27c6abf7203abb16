#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <chrono>

namespace hybmss {
namespace {

/// What a Newton solve may leave unbalanced, where the scene does not say.
double default_tolerance(Precision precision) {
    return precision == Precision::float32 ? 1e-4 : 1e-8;
}

/// Why a solve failed, and what the scene may do about it.
std::string explained(const EquilibriumResult& result, const Scene& scene) {
    std::string why = result.message;
    if (volume_modulus(scene.material) < 0 && scene.material.volume_energy == VolumeEnergy::quadratic) {
        why += "; volume_energy = \"quadratic\" has no lower bound in tension at a poisson_ratio below 0.25: "
               "\"mean_stretch\" has";
    }
    return why;
}

} // namespace

EquilibriumOptions Simulation::Implementation::equilibrium_options() const {
    const double tolerance = default_tolerance(options.precision);
    EquilibriumOptions solve;
    solve.preconditioner = scene.solver.preconditioner;
    if (is_static()) {
        solve.tolerance = scene.solver.tolerance.value_or(tolerance);
        solve.first_load_step = 1.0 / scene.solver.load_steps;
        solve.load_steps = std::max(solve.load_steps, 10 * scene.solver.load_steps);
        solve.smallest_load_step = std::min(solve.smallest_load_step, solve.first_load_step);
    } else {
        // A step's own error is far larger.
        solve.tolerance = std::max(tolerance, std::min(1e-6, 0.1 * scene.solver.tolerance.value_or(1)));
    }
    return solve;
}

void Simulation::Implementation::add_work(const EquilibriumResult& result) {
    work.newton_iterations += result.newton_iterations;
    work.cg_iterations += result.cg_iterations;
    work.load_steps += result.load_steps;
    work.failed_load_steps += result.failed_load_steps;
    work.preconditioner = result.preconditioner;
}

std::string Simulation::Implementation::solve(const RunCallbacks& callbacks) {
    EquilibriumOptions solve = equilibrium_options();
    if (callbacks.progress) {
        solve.progress = [&, start = std::chrono::steady_clock::now()](const EquilibriumProgress& progress) {
            Progress report;
            report.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            report.solve = progress;
            callbacks.progress(report);
            return true;
        };
    }
    const auto loading = [&](double fraction) {
        const std::span<const PrescribedNode> held = supports.at_part(fraction);
        Loading part{{held.begin(), held.end()}, loads, scene.gravity.acceleration};
        for (std::size_t a = 0; a < 3; ++a) {
            part.acceleration[a] *= fraction;
            for (Vector3& force : part.forces) {
                force[a] *= fraction;
            }
        }
        return part;
    };
    const EquilibriumResult result = on_implicit([&](auto& d) { return d.follow(loading, solve); });
    load_fraction = result.load_fraction;
    prescribe();
    add_work(result);
    steps = work.load_steps;
    solved_residual = result.residual;
    solved = result.status == EquilibriumStatus::converged;
    if (solved) {
        return "";
    }
    return text("no equilibrium (%s): ", std::string(name(result.status)).c_str()) + explained(result, scene);
}

std::string Simulation::Implementation::implicit_step() {
    const double end = static_cast<double>(steps + 1) * time_step;
    const std::span<const PrescribedNode> held = supports.at(end);
    const Loading loading{{held.begin(), held.end()}, loads, scene.gravity.acceleration};
    const EquilibriumResult result =
        on_implicit([&](auto& d) { return d.step(loading, time_step, scene.damping.mass, equilibrium_options()); });
    add_work(result);
    if (result.status == EquilibriumStatus::converged) {
        ++steps;
        return "";
    }
    supports.at(time());
    return text("step %ld (t = %.6g s) did not converge (%s, residual %.3g): ", steps + 1, end,
                std::string(name(result.status)).c_str(), result.residual) +
           explained(result, scene);
}

} // namespace hybmss
