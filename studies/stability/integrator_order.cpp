#include "studies/stability/integrator_order.hpp"

#include "studies/stability/body_motion.hpp"

#include "hybmss/equilibrium.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <stdexcept>

namespace hybmss::stability {
namespace {

Lattice cube() {
    return Lattice::box(2, 2, 2, kCellSize);
}

Material cube_material() {
    return case_material(SpringForm::nodes, 0.4);
}

struct Vibration {
    Vectors shape; ///< m, so small that springs are linear to one part in ten million
    double omega = 0;
};

/// The slowest of K phi = omega^2 M phi that is no rigid motion.
Vibration slowest_vibration() {
    const reference::Body body = reference::assemble(cube(), cube_material());
    Eigen::MatrixXd matrix = reference::hessian(body, Vectors(body.rest.size(), Vector3d::Zero()));
    const auto root_mass = [&](Eigen::Index c) { return std::sqrt(body.mass[static_cast<std::size_t>(c / 3)]); };
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
        for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
            matrix(row, column) /= root_mass(row) * root_mass(column);
        }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
    constexpr Eigen::Index kFirst = 6; // after six rigid motions
    Vibration vibration;
    vibration.omega = std::sqrt(solver.eigenvalues()[kFirst]);
    for (std::size_t n = 0; n < body.rest.size(); ++n) {
        const auto first = static_cast<Eigen::Index>(3 * n);
        vibration.shape.push_back(solver.eigenvectors().col(kFirst).segment<3>(first) / root_mass(first));
    }
    const double scale = 1e-7 * kCellSize / greatest_length(vibration.shape);
    for (Vector3d& u : vibration.shape) {
        u *= scale;
    }
    return vibration;
}

/// A motion that starts at the shape without velocity.
struct Motion {
    std::function<void(double time_step)> step;
    std::function<Vectors()> displacements;
    std::function<double()> energy;
};

template <hybmss::Integrator integrator>
Motion small_steps(const Vibration& vibration) {
    const auto motion = std::make_shared<BodyMotion<double>>(cube(), cube_material());
    motion->set_displacements(vibration.shape);
    return {[=](double time_step) {
                motion->step({time_step, {0, 0, 0}, 0, integrator}, 1);
            },
            [=] { return motion->displacements(); }, [=] { return motion->energy(); }};
}

Motion backward_euler(const Vibration& vibration) {
    struct State {
        EquilibriumSolver<double> solver{cube(), cube_material()};
        Vectors u, v, force;
        VectorField<double> view(Vectors& field) const {
            return VectorField<double>::aos(field.front().data(), field.size());
        }
    };
    const auto state = std::make_shared<State>();
    state->u = vibration.shape;
    state->v.assign(state->u.size(), Vector3d::Zero());
    state->force = state->v;
    const auto step = [=](double time_step) {
        EquilibriumOptions options;
        options.tolerance = 1e-7;
        const EquilibriumResult result =
            state->solver.step({}, time_step, 0, state->view(state->u), state->view(state->v), options);
        if (result.status != EquilibriumStatus::converged) {
            throw std::runtime_error("backward Euler: " + result.message);
        }
    };
    const auto energy = [=] {
        double sum = state->solver.get_forces(state->view(state->u), state->view(state->force)).total();
        for (std::size_t n = 0; n < state->v.size(); ++n) {
            sum += 0.5 * state->solver.masses()[n] * state->v[n].squaredNorm();
        }
        return sum;
    };
    return {step, [=] { return state->u; }, energy};
}

double greatest_error(const Motion& motion, const Vibration& vibration, int steps_per_period) {
    const double time_step = 2 * std::numbers::pi / vibration.omega / steps_per_period;
    double greatest = 0;
    for (int step = 1; step <= 2 * steps_per_period; ++step) {
        motion.step(time_step);
        const Vectors u = motion.displacements();
        const double factor = std::cos(vibration.omega * time_step * step);
        for (std::size_t n = 0; n < u.size(); ++n) {
            greatest = std::max(greatest, (u[n] - factor * vibration.shape[n]).norm());
        }
    }
    return greatest / greatest_length(vibration.shape);
}

} // namespace

double IntegratorStudy::observed_order() const {
    return std::log2(errors[errors.size() - 2] / errors.back());
}

std::vector<IntegratorStudy> study_integrators() {
    struct Method {
        const char* name;
        Motion (*make)(const Vibration&);
    };
    constexpr int kPeriods = 20, kEnergySteps = 40, kStepsBetweenSamples = 4;
    const Vibration vibration = slowest_vibration();
    std::vector<IntegratorStudy> studies;
    for (const Method& integrator :
         {Method{"semi-implicit Euler", small_steps<Integrator::symplectic_euler>},
          Method{"leapfrog", small_steps<Integrator::leapfrog>}, Method{"backward Euler", backward_euler}}) {
        IntegratorStudy& study = studies.emplace_back();
        study.integrator = integrator.name;
        for (const int steps : {40, 80, 160, 320, 640}) {
            study.steps_per_period.push_back(steps);
            study.errors.push_back(greatest_error(integrator.make(vibration), vibration, steps));
        }
        const Motion motion = integrator.make(vibration);
        const double start = motion.energy(), time_step = 2 * std::numbers::pi / vibration.omega / kEnergySteps;
        study.energy_time_step = static_cast<double>(kStepsBetweenSamples) / kEnergySteps;
        study.energies.push_back(1);
        for (int step = 1; step <= kPeriods * kEnergySteps; ++step) {
            motion.step(time_step);
            if (step % kStepsBetweenSamples == 0) {
                study.energies.push_back(motion.energy() / start);
            }
        }
    }
    return studies;
}

void print_integrators(const std::vector<IntegratorStudy>& studies, std::ostream& out) {
    out << fmt::format("{:<20} {:>12} {:>11} {:>7}\n", "integrator", "steps/period", "error", "order");
    for (const IntegratorStudy& study : studies) {
        for (std::size_t n = 0; n < study.errors.size(); ++n) {
            out << fmt::format("{:<20} {:>12} {:>11.3e} {:>7}\n", study.integrator, study.steps_per_period[n],
                               study.errors[n],
                               n == 0 ? "" : fmt::format("{:.3f}", std::log2(study.errors[n - 1] / study.errors[n])));
        }
    }
    out << "\nenergy over the start's, 40 steps a period\n";
    for (const IntegratorStudy& study : studies) {
        const auto [least, greatest] = std::minmax_element(study.energies.begin(), study.energies.end());
        out << fmt::format("{:<20} from {:.4f} to {:.4f}; {:.4f} after {:.0f} periods\n", study.integrator, *least,
                           *greatest, study.energies.back(),
                           study.energy_time_step * static_cast<double>(study.energies.size() - 1));
    }
}

nlohmann::ordered_json integrators_json(const std::vector<IntegratorStudy>& studies) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const IntegratorStudy& study : studies) {
        all.push_back({{"integrator", study.integrator},
                       {"steps_per_period", study.steps_per_period},
                       {"errors", study.errors},
                       {"observed_order", study.observed_order()},
                       {"energy_time_step", study.energy_time_step},
                       {"energies", study.energies}});
    }
    return all;
}

} // namespace hybmss::stability
