#include "hybmss/equilibrium.hpp"

#include "dynamics/effects/spring_damping.hpp"
#include "plan/tuning/planned_body.hpp"
#include "solvers/modes/lowest_modes.hpp"
#include "solvers/multigrid/banded.hpp"
#include "solvers/multigrid/float_multigrid.hpp"
#include "solvers/newton/coarser_mesh.hpp"
#include "solvers/newton/load_stepping.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <type_traits>

namespace hybmss {
namespace {

void require(bool good, const char* what, double value, const char* allowed) {
    if (!good) {
        std::ostringstream message;
        message << what << " = " << value << " is not allowed: it must be " << allowed;
        throw std::invalid_argument(message.str());
    }
}

void validate(const EquilibriumOptions& options) {
    require(options.tolerance > 0 && options.tolerance < 1, "tolerance", options.tolerance, "inside (0, 1)");
    require(options.newton_iterations >= 1, "newton_iterations", options.newton_iterations, "at least 1");
    require(options.load_steps >= 1, "load_steps", options.load_steps, "at least 1");
    require(options.first_load_step > 0 && options.first_load_step <= 1, "first_load_step", options.first_load_step,
            "in (0, 1]");
    require(options.smallest_load_step > 0 && options.smallest_load_step <= 1, "smallest_load_step",
            options.smallest_load_step, "in (0, 1]");
    require(options.largest_load_step > 0 && options.largest_load_step <= 1, "largest_load_step",
            options.largest_load_step, "in (0, 1]");
}

void validate(const ModesOptions& options) {
    require(options.count >= 1, "count", options.count, "at least 1");
    require(options.tolerance > 0 && options.tolerance < 1, "tolerance", options.tolerance, "inside (0, 1)");
    require(options.iterations >= 1, "iterations", options.iterations, "at least 1");
}

/// Supports, loads, pressures and what cells grow by, times a factor.
Loading scaled(const Loading& loading, double factor) {
    Loading part = loading;
    const auto scale = [factor](std::array<double, 3>& vector) {
        for (double& x : vector) {
            x *= factor;
        }
    };
    for (PrescribedNode& held : part.supports) {
        scale(held.displacement);
    }
    for (std::array<double, 3>& force : part.forces) {
        scale(force);
    }
    scale(part.acceleration);
    for (double& pressure : part.pressures) {
        pressure *= factor;
    }
    for (RestStretch& stretches : part.rest_stretches) {
        for (double& s : stretches) {
            s = 1 + factor * (s - 1);
        }
    }
    return part;
}

} // namespace

std::string_view name(EquilibriumStatus status) {
    switch (status) {
    case EquilibriumStatus::converged:
        return "converged";
    case EquilibriumStatus::iterations_exhausted:
        return "iterations exhausted";
    case EquilibriumStatus::no_descent:
        return "no descent";
    case EquilibriumStatus::unbounded:
        return "unbounded";
    case EquilibriumStatus::inverted:
        return "inverted";
    case EquilibriumStatus::not_finite:
        return "not finite";
    case EquilibriumStatus::stopped:
        return "stopped";
    }
    return "";
}

std::string_view name(PreconditionerKind kind) {
    switch (kind) {
    case PreconditionerKind::automatic:
        return "automatic";
    case PreconditionerKind::block_jacobi:
        return "block-jacobi";
    case PreconditionerKind::multigrid:
        return "multigrid";
    }
    return "";
}

PreconditionerKind parse_preconditioner(std::string_view text) {
    for (const auto kind :
         {PreconditionerKind::automatic, PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
        if (name(kind) == text) {
            return kind;
        }
    }
    throw std::invalid_argument("preconditioner \"" + std::string(text) +
                                "\" is not known: it must be automatic, block-jacobi or multigrid");
}

double Mode::frequency() const {
    return std::copysign(std::sqrt(std::abs(eigenvalue)), eigenvalue) / (2 * std::numbers::pi);
}

template <class T>
struct EquilibriumSolver<T>::Implementation {
    /// What only preconditions is float.
    using Cycles = std::conditional_t<std::is_same_v<T, double>, FloatMultigrid, Multigrid>;

    Implementation(PlannedBody<T> made, const PlanOptions& given, const BodyScales& scales, const SolidCells& solid,
                   Sections sections)
        : planned(std::move(made)), wishes(given), body(planned.body.get()), state(body->make_state(false)),
          potential(*body, scales, solid, std::move(sections)), stepping(potential.space()) {}

    void read(VectorField<const T> displacement) {
        body->write(displacement, 1 / body->length_unit(), state.displacement);
        const FieldView<T> u{state.displacement};
        const double largest = potential.space().largest([](const T& x) { return x < 0 ? -x : x; }, u);
        if (!std::isfinite(largest)) {
            throw std::invalid_argument("displacements: they must be finite");
        }
    }
    void set(const Loading& loading) {
        potential.prescribe(loading.supports);
        potential.load(loading.forces, loading.acceleration);
        potential.set_pressures(loading.pressures, loading.supports);
        potential.move_obstacles(loading.obstacles);
        if (!loading.rest_stretches.empty()) {
            potential.set_rest_stretches(loading.rest_stretches);
        }
    }
    /// What pressures, cells of another size and contact store at the state, J.
    void read_effects() {
        stored_by_pressure = potential.pressure() ? potential.pressure()->value(state) : 0;
        stored_by_actuation = potential.actuation() ? potential.actuation()->energy(state) : 0;
        stored_by_contact = potential.contact() ? potential.contact()->value(state) : 0;
    }
    /// `reach`: of a step, see multigrid_pays_in_step().
    Preconditioner<T>& choose(PreconditionerKind kind, std::optional<double> reach = std::nullopt) {
        const bool pays = kind == PreconditionerKind::automatic && lattice &&
                          (reach ? multigrid_pays_in_step(lattice->first, lattice->second, *reach)
                                 : multigrid_pays(lattice->first, lattice->second));
        if (kind != PreconditionerKind::multigrid && !pays) {
            return block_jacobi;
        }
        if (!lattice) {
            throw std::invalid_argument("preconditioner \"multigrid\" is for lattices: this body is a network");
        }
        if (!multigrid) {
            if constexpr (std::is_same_v<T, double>) {
                multigrid = std::make_unique<FloatMultigrid>(*body, lattice->first, lattice->second, planned.choice);
            } else {
                multigrid = std::make_unique<Multigrid>(*body, lattice->first, lattice->second);
            }
        }
        return *multigrid;
    }
    /// What suits a pull of every node besides does not suit slender bodies without.
    Preconditioner<T>& choose_static(PreconditionerKind kind) {
        if (potential.contact() && kind == PreconditionerKind::automatic) {
            // Coarse levels in float leave motions that nothing holds to chance; a banded matrix knows supports alone.
            return potential.held_axes() == 7 ? choose(kind) : block_jacobi;
        }
        if (kind != PreconditionerKind::automatic || !lattice || !banded_pays(lattice->first)) {
            return choose(kind);
        }
        if (!banded) {
            banded = std::make_unique<Banded<T>>(*body, lattice->first, lattice->second);
        }
        return *banded;
    }
    EquilibriumResult follow(const std::function<Loading(double)>& path, VectorField<T> displacement,
                             const EquilibriumOptions& options) {
        if (body->node_count() == 0) { // a body cut away to nothing is in equilibrium; a residual would be 0/0
            EquilibriumResult nothing;
            nothing.load_fraction = 1;
            return nothing;
        }
        potential.release();
        std::optional<EquilibriumResult> result;
        if (options.nested && lattice && !potential.pressure() && !potential.actuation() && !potential.contact() &&
            CoarserMesh::pays(lattice->first) && !banded_pays(lattice->first)) {
            result = from_coarser(path, displacement, options);
        }
        if (!result) {
            body->write(displacement, 1 / body->length_unit(), state.displacement);
            result = follow_here(path, options);
        }
        read_effects();
        body->read(state.displacement, body->length_unit(), displacement);
        return *result;
    }
    EquilibriumResult follow_here(const std::function<Loading(double)>& path, const EquilibriumOptions& options,
                                  bool near_end = false) {
        potential.prescribe(path(1).supports);
        Preconditioner<T>& preconditioner = choose_static(options.preconditioner);
        return stepping.follow(
            potential, preconditioner, state, [&](double fraction) { set(path(fraction)); }, options, near_end);
    }
    /// From the equilibrium of the coarser mesh, in one step; nothing where there is none, or it leads nowhere.
    std::optional<EquilibriumResult> from_coarser(const std::function<Loading(double)>& path,
                                                  VectorField<T> displacement, const EquilibriumOptions& options) {
        // A solution of the coarse body is as far from that of the fine one, in every place.
        constexpr double kCoarseTolerance = 1e-4;
        // What the coarse body takes is given back before the fine one's multigrid is made.
        auto coarser_mesh = std::make_unique<CoarserMesh>(lattice->first);
        const CoarserMesh& coarser = *coarser_mesh;
        std::vector<double> start(3 * body->node_count());
        for (std::size_t n = 0; n < body->node_count(); ++n) {
            const auto at = static_cast<std::ptrdiff_t>(n) * displacement.stride;
            start[3 * n] = static_cast<double>(displacement.x[at]);
            start[3 * n + 1] = static_cast<double>(displacement.y[at]);
            start[3 * n + 2] = static_cast<double>(displacement.z[at]);
        }
        const std::vector<double> before = coarser.injected(start);
        std::vector<double> moved = before;
        auto solver = std::make_unique<EquilibriumSolver<double>>(coarser.lattice(), lattice->second, wishes);
        EquilibriumOptions coarse_options = options;
        coarse_options.tolerance = std::max(options.tolerance, kCoarseTolerance);
        coarse_options.leave_saddles = false;
        const EquilibriumResult coarse = solver->follow(
            [&](double fraction) {
                const Loading loading = path(fraction);
                set(loading); // which checks it
                return coarser.restricted(loading, body->masses());
            },
            VectorField<double>::aos(moved.data(), solver->node_count()), coarse_options);
        solver.reset();
        if (coarse.status == EquilibriumStatus::stopped) {
            // Nothing has been tried of the body itself: a solve that stops at once says all that is to be said.
            body->write(displacement, 1 / body->length_unit(), state.displacement);
            EquilibriumOptions at_once = options;
            at_once.progress = [](const EquilibriumProgress&) { return false; };
            return follow_here(path, at_once);
        }
        if (coarse.status != EquilibriumStatus::converged || coarse.min_cell_volume_ratio <= 0) {
            return std::nullopt;
        }
        for (std::size_t i = 0; i < moved.size(); ++i) {
            moved[i] -= before[i];
        }
        {
            const std::vector<double> change = coarser.interpolated(moved);
            coarser_mesh.reset();
            std::vector<T> guess(start.size());
            for (std::size_t i = 0; i < start.size(); ++i) {
                guess[i] = static_cast<T>(start[i] + change[i]);
            }
            start = std::vector<double>();
            body->write(VectorField<const T>::aos(guess.data(), body->node_count()), 1 / body->length_unit(),
                        state.displacement);
        }
        if (potential.volume_ratios(state).min <= 0) {
            return std::nullopt;
        }
        EquilibriumOptions whole = options;
        whole.first_load_step = whole.smallest_load_step = whole.largest_load_step = 1;
        EquilibriumResult result = follow_here(path, whole, true);
        if (result.status != EquilibriumStatus::converged && result.status != EquilibriumStatus::stopped) {
            return std::nullopt;
        }
        result.coarser_meshes = coarse.coarser_meshes + 1;
        return result;
    }

    PlannedBody<T> planned;
    PlanOptions wishes; ///< of coarser meshes too
    const Body<T>* body;
    State<T> state;
    Potential<T> potential;
    LoadStepping<T> stepping;
    BlockJacobi<T> block_jacobi;
    std::optional<std::pair<Lattice, Material>> lattice; ///< where the body is one
    std::unique_ptr<Cycles> multigrid;                   ///< made when it is first asked for
    std::unique_ptr<Banded<T>> banded;                   ///< likewise
    std::vector<T> target;
    double stiffness_damping = 0, dissipated = 0, stored_by_pressure = 0, stored_by_actuation = 0,
           stored_by_contact = 0;
};

template <class T>
EquilibriumSolver<T>::EquilibriumSolver(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(plan_body<T>(lattice, material, options, Operation::forces),
                                                       options, BodyScales::of(lattice, material),
                                                       SolidCells::of(lattice), Sections::of(lattice))) {
    implementation_->lattice.emplace(lattice, material);
}
template <class T>
EquilibriumSolver<T>::EquilibriumSolver(const Network& network, const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(plan_body<T>(network, options, Operation::forces), options,
                                                       BodyScales::of(network), SolidCells::of(network),
                                                       Sections::of(network))) {}
template <class T>
EquilibriumSolver<T>::EquilibriumSolver(EquilibriumSolver&&) noexcept = default;
template <class T>
EquilibriumSolver<T>& EquilibriumSolver<T>::operator=(EquilibriumSolver&&) noexcept = default;
template <class T>
EquilibriumSolver<T>::~EquilibriumSolver() = default;

template <class T>
std::size_t EquilibriumSolver<T>::node_count() const {
    return implementation_->body->node_count();
}
template <class T>
std::span<const double> EquilibriumSolver<T>::masses() const {
    return implementation_->body->masses();
}

template <class T>
EquilibriumResult EquilibriumSolver<T>::solve(const Loading& loading, VectorField<T> displacement,
                                              const EquilibriumOptions& options) {
    Implementation& i = *implementation_;
    validate(options);
    i.body->check(displacement); // it is written in the end
    i.read(displacement);
    std::vector<RestStretch> sizes;
    if (const ActuatedBody<T>* const actuation = i.potential.actuation();
        actuation && !loading.rest_stretches.empty()) {
        sizes.assign(actuation->stretches().begin(), actuation->stretches().end());
    }
    i.set(loading);
    Loading part = loading;
    std::vector<std::array<double, 3>> start;
    for (const PrescribedNode& p : loading.supports) {
        const auto at = static_cast<std::ptrdiff_t>(p.node) * displacement.stride;
        start.push_back({static_cast<double>(displacement.x[at]), static_cast<double>(displacement.y[at]),
                         static_cast<double>(displacement.z[at])});
    }
    return i.follow(
        [&](double fraction) {
            for (std::size_t n = 0; n < start.size(); ++n) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const double end = loading.supports[n].displacement[c];
                    part.supports[n].displacement[c] =
                        fraction == 1 ? end : start[n][c] + fraction * (end - start[n][c]);
                }
            }
            for (std::size_t n = 0; n < loading.forces.size(); ++n) {
                for (std::size_t c = 0; c < 3; ++c) {
                    part.forces[n][c] = fraction * loading.forces[n][c];
                }
            }
            for (std::size_t c = 0; c < 3; ++c) {
                part.acceleration[c] = fraction * loading.acceleration[c];
            }
            for (std::size_t f = 0; f < loading.pressures.size(); ++f) {
                part.pressures[f] = fraction * loading.pressures[f];
            }
            for (std::size_t cell = 0; cell < sizes.size(); ++cell) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const double end = loading.rest_stretches[cell][c];
                    part.rest_stretches[cell][c] =
                        fraction == 1 ? end : sizes[cell][c] + fraction * (end - sizes[cell][c]);
                }
            }
            return part;
        },
        displacement, options);
}

template <class T>
EquilibriumResult EquilibriumSolver<T>::follow(const std::function<Loading(double fraction)>& path,
                                               VectorField<T> displacement, const EquilibriumOptions& options) {
    Implementation& i = *implementation_;
    validate(options);
    i.body->check(displacement); // it is written in the end
    i.read(displacement);
    return i.follow(path, displacement, options);
}

// Backward Euler: v_new = (u_new - u)/dt, so m (u_new - u - dt v)/dt^2 + c m (u_new - u)/dt = f(u_new) + loads: the
// pull of the strength a = 1/dt^2 + c/dt towards u + v / (dt a).
template <class T>
EquilibriumResult EquilibriumSolver<T>::step(const Loading& loading, double time_step, double mass_damping,
                                             VectorField<T> displacement, VectorField<T> velocity,
                                             const EquilibriumOptions& options) {
    Implementation& i = *implementation_;
    validate(options);
    require(time_step > 0 && std::isfinite(time_step), "time_step", time_step, "finite and > 0");
    require(mass_damping >= 0 && std::isfinite(mass_damping), "mass_damping", mass_damping, "finite and at least 0");
    i.body->check(displacement); // both are written in the end
    i.body->check(velocity, {displacement});
    i.read(displacement);
    i.set(loading);
    const double strength = 1 / (time_step * time_step) + mass_damping / time_step;
    const T reach = static_cast<T>(1 / (time_step * strength));
    const std::size_t count = node_count();
    i.target.resize(3 * count);
    const T* const u[3] = {displacement.x, displacement.y, displacement.z};
    T* const v[3] = {velocity.x, velocity.y, velocity.z};
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t n = 0; n < count; ++n) {
            const auto at = static_cast<std::ptrdiff_t>(n);
            i.target[3 * n + c] = u[c][at * displacement.stride] + reach * v[c][at * velocity.stride];
        }
    }
    i.potential.pull(strength, VectorField<T>::aos(i.target.data(), count));
    i.potential.damp(i.stiffness_damping / time_step, displacement);

    EquilibriumResult result;
    // Multigrid's coarse levels know nothing of damped springs.
    const bool damped = i.stiffness_damping > time_step && options.preconditioner == PreconditionerKind::automatic;
    Preconditioner<T>& preconditioner = i.choose(damped ? PreconditionerKind::block_jacobi : options.preconditioner,
                                                 time_step / i.body->critical_time_step());
    MinimiserOptions limits;
    limits.tolerance = options.tolerance;
    // Where supports move, nodes beside them must come along; else Newton's method begins where the body is.
    if (i.potential.prescribed_to_move(i.state)) {
        result.cg_iterations = i.stepping.minimiser().predict(i.potential, preconditioner, i.state);
        limits.preconditioner_is_made = true;
    }
    limits.iterations = options.newton_iterations;
    if (options.progress) {
        limits.progress = [&](int iteration, long cg, double residual, double energy) {
            return options.progress({1, 1, iteration, result.cg_iterations + cg, residual, energy});
        };
    }
    MinimiserResult found = i.stepping.minimiser().minimise(i.potential, preconditioner, i.state, limits);
    if (found.status == EquilibriumStatus::converged) {
        i.stepping.minimiser().keep_momentum(i.potential, i.state, options.tolerance, found);
    }
    result.status = found.status;
    result.residual = found.residual;
    result.potential = found.potential;
    result.load_fraction = 1;
    result.load_steps = 1;
    result.newton_iterations = found.iterations;
    result.cg_iterations += found.cg_iterations;
    result.negative_curvatures = found.negative_curvatures;
    result.preconditioner = preconditioner.name();
    if (found.status != EquilibriumStatus::converged) {
        std::ostringstream text;
        text << name(found.status) << " (";
        if (std::isfinite(found.residual)) {
            text << "residual " << found.residual << ", ";
        }
        text << "tolerance " << options.tolerance << ")";
        result.message = text.str();
    }
    if (found.status == EquilibriumStatus::converged) {
        i.dissipated += i.potential.dissipation(i.state);
        i.read_effects();
    }
    // v_new = (u_new - u) / dt, before u is overwritten.
    for (std::size_t n = 0; n < count; ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            v[c][static_cast<std::ptrdiff_t>(n) * velocity.stride] =
                -u[c][static_cast<std::ptrdiff_t>(n) * displacement.stride];
        }
    }
    i.body->read(i.state.displacement, i.body->length_unit(), displacement);
    const T rate = static_cast<T>(1 / time_step);
    for (std::size_t n = 0; n < count; ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            T& value = v[c][static_cast<std::ptrdiff_t>(n) * velocity.stride];
            value = rate * (value + u[c][static_cast<std::ptrdiff_t>(n) * displacement.stride]);
        }
    }
    return result;
}

template <class T>
ModesResult EquilibriumSolver<T>::modes(std::span<const PrescribedNode> supports, VectorField<const T> displacement,
                                        const ModesOptions& options) {
    Implementation& i = *implementation_;
    validate(options);
    i.read(displacement);
    i.potential.prescribe(supports);
    i.potential.set_pressures(options.pressures, supports);
    return lowest_modes<T>(
        i.potential, i.state,
        [&](bool moves) -> Preconditioner<T>& {
            return moves ? i.choose(options.preconditioner) : i.choose_static(options.preconditioner);
        },
        options);
}

template <class T>
BucklingResult EquilibriumSolver<T>::buckling(const Loading& loading, const ModesOptions& options) {
    Implementation& i = *implementation_;
    validate(options);
    if constexpr (std::is_same_v<T, float>) {
        throw std::invalid_argument("buckling loads are found by differences that float does not hold: they want an "
                                    "EquilibriumSolver<double>");
    }
    const std::size_t count = node_count();
    std::vector<T> u(3 * count, T(0));
    const VectorField<T> field = VectorField<T>::aos(u.data(), count);
    BucklingResult nothing;
    // Moves by a thousandth of a spring's length at most: differences between both signs are off by the square of the
    // strains that makes, and by rounding over them.
    constexpr double kMove = 1e-3;
    EquilibriumOptions solve_options;
    solve_options.preconditioner = options.preconditioner;
    solve_options.tolerance = 1e-10;
    const auto equilibrium = [&](double part) {
        std::fill(u.begin(), u.end(), T(0));
        return solve(scaled(loading, part), field, solve_options);
    };
    const double wanted = kMove * i.potential.length() * i.body->length_unit();
    double part = 1e-6;
    for (int attempt = 0;; ++attempt) {
        const EquilibriumResult found = equilibrium(part);
        const bool good = found.status == EquilibriumStatus::converged || found.residual < 1e-6;
        double most = 0;
        for (const T x : u) {
            most = std::max(most, std::abs(static_cast<double>(x)));
        }
        if (good && most == 0) {
            nothing.message = "the loading moves nothing";
            return nothing;
        }
        if (good && most <= 2 * wanted && most >= wanted / 2) {
            break;
        }
        if (attempt == 10) {
            nothing.message = "no equilibrium under a small part of the loading: " + found.message;
            return nothing;
        }
        part *= good ? std::clamp(wanted / most, 1e-9, 1e9) : 1e-6;
    }
    State<T> rest = i.body->make_state(false), loaded = i.body->make_state(false);
    i.body->write(VectorField<const T>(field), 1 / i.body->length_unit(), loaded.displacement);
    equilibrium(-part);
    i.read(VectorField<const T>(field)); // the reversed one
    std::fill(u.begin(), u.end(), T(0));
    i.body->write(VectorField<const T>(field), 1 / i.body->length_unit(), rest.displacement);
    i.potential.prescribe(loading.supports);
    return buckling_loads<T>(
        i.potential, rest, i.state, loaded, part,
        [&](double of_loading) {
            if (i.potential.pressure()) {
                i.potential.set_pressures(scaled(loading, of_loading).pressures, loading.supports);
            }
        },
        i.choose_static(options.preconditioner), options);
}

template <class T>
std::vector<T> EquilibriumSolver<T>::memory() const {
    const Implementation& i = *implementation_;
    return i.multigrid ? i.multigrid->memory() : std::vector<T>();
}

template <class T>
void EquilibriumSolver<T>::set_memory(std::span<const T> values) {
    Implementation& i = *implementation_;
    if (values.empty()) {
        i.multigrid.reset();
        return;
    }
    if (values.size() != 3 * node_count()) {
        throw std::invalid_argument("memory of " + std::to_string(values.size()) + " values given: the body's " +
                                    std::to_string(node_count()) + " nodes have three each");
    }
    static_cast<typename Implementation::Cycles&>(i.choose(PreconditionerKind::multigrid))
        .set_memory(i.potential.space(), values);
}

template <class T>
void EquilibriumSolver<T>::damp_springs(double stiffness_damping) {
    require(stiffness_damping >= 0 && std::isfinite(stiffness_damping), "stiffness_damping", stiffness_damping,
            "finite and at least 0");
    implementation_->stiffness_damping = stiffness_damping;
}

template <class T>
void EquilibriumSolver<T>::press(std::span<const SurfaceFace> faces, std::span<const double> pressures) {
    implementation_->potential.press(faces, pressures);
    implementation_->stored_by_pressure = 0;
}

template <class T>
void EquilibriumSolver<T>::set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles) {
    Implementation& i = *implementation_;
    i.potential.set_obstacles(surface, obstacles);
    i.stored_by_contact = 0;
}

template <class T>
void EquilibriumSolver<T>::actuate(std::span<const std::uint32_t> cells) {
    Implementation& i = *implementation_;
    std::unique_ptr<ActuatedBody<T>> actuation;
    if (!cells.empty()) {
        if (!i.lattice) {
            throw std::invalid_argument("cells of another size at rest are those of lattices: this body is a network");
        }
        actuation = std::make_unique<ActuatedBody<T>>(*i.body, i.lattice->first, i.lattice->second, cells,
                                                      std::vector<RestStretch>(cells.size(), {1, 1, 1}));
    }
    i.potential.actuate(std::move(actuation));
    i.stored_by_actuation = 0;
}

template <class T>
std::vector<ObstacleReading> EquilibriumSolver<T>::obstacle_readings(VectorField<const T> displacement) {
    Implementation& i = *implementation_;
    i.body->write(displacement, 1 / i.body->length_unit(), i.state.displacement);
    return i.potential.contact() ? i.potential.contact()->readings(i.state) : std::vector<ObstacleReading>();
}

template <class T>
std::vector<EffectEnergy> EquilibriumSolver<T>::effect_energies() const {
    const Implementation& i = *implementation_;
    std::vector<EffectEnergy> effects;
    if (i.stiffness_damping > 0) {
        effects.push_back({"stiffness damping", 0, i.dissipated});
    }
    if (i.potential.pressure()) {
        effects.push_back({"pressure", i.stored_by_pressure, 0});
    }
    if (i.potential.actuation()) {
        effects.push_back({"actuation", i.stored_by_actuation, 0});
    }
    if (i.potential.contact()) {
        effects.push_back({"contact", i.stored_by_contact, 0});
    }
    return effects;
}

template <class T>
std::vector<double> EquilibriumSolver<T>::effect_memory() const {
    std::vector<double> memory;
    for (const EffectEnergy& effect : effect_energies()) {
        memory.push_back(effect.stored + effect.dissipated); // one of which is 0
    }
    return memory;
}

template <class T>
void EquilibriumSolver<T>::set_effect_memory(std::span<const double> memory) {
    Implementation& i = *implementation_;
    const std::size_t expected = effect_memory().size();
    if (memory.size() != expected) {
        throw std::invalid_argument("memory of effects: " + std::to_string(memory.size()) + " numbers given, " +
                                    std::to_string(expected) + " expected");
    }
    const double* next = memory.data();
    if (i.stiffness_damping > 0) {
        i.dissipated = *next++;
    }
    if (i.potential.pressure()) {
        i.stored_by_pressure = *next++;
    }
    if (i.potential.actuation()) {
        i.stored_by_actuation = *next++;
    }
    if (i.potential.contact()) {
        i.stored_by_contact = *next;
    }
}

template <class T>
void EquilibriumSolver<T>::get_effect_forces(VectorField<const T> displacement, VectorField<const T> velocity,
                                             VectorField<T> force) {
    Implementation& i = *implementation_;
    NodeVector<T> v = i.potential.space().make(), scratch = i.potential.space().make(), f = i.potential.space().make();
    i.body->write(displacement, 1 / i.body->length_unit(), i.state.displacement);
    i.body->write(velocity, 1 / i.body->length_unit(), v.field);
    if (i.stiffness_damping > 0) {
        add_damping_forces(*i.body, i.state, v.field, i.stiffness_damping, scratch.field, f.field);
    }
    if (const PressurePotential<T>* const pressure = i.potential.pressure(); pressure && pressure->acts()) {
        pressure->add_forces(i.state, f.field);
    }
    if (i.potential.actuation()) {
        i.potential.actuation()->add_forces(*i.body, i.state, 1, f.field);
    }
    if (i.potential.contact()) {
        i.potential.contact()->add_gradient(i.state, scratch.field);
        i.potential.space().add_multiple(-1, scratch, f);
    }
    i.body->read(f.field, 1, force);
}

template <class T>
PotentialEnergy EquilibriumSolver<T>::get_forces(VectorField<const T> displacement, VectorField<T> force) {
    Implementation& i = *implementation_;
    i.body->check(force, {displacement});
    i.body->write(displacement, 1 / i.body->length_unit(), i.state.displacement);
    i.body->compute_forces(i.state);
    i.body->read(i.state.force, 1, force);
    return i.body->energy(i.state);
}

template <class T>
PlanDescription EquilibriumSolver<T>::describe() const {
    PlanDescription description = implementation_->planned.describe();
    description.bytes += implementation_->state.bytes();
    return description;
}

template <class T>
double EquilibriumSolver<T>::estimate_seconds() {
    using Clock = std::chrono::steady_clock;
    Implementation& i = *implementation_;
    const VectorSpace<T>& space = i.potential.space();
    if (node_count() == 0) {
        return 0;
    }
    NodeVector<T> direction = space.make(), product = space.make();
    i.potential.linearise(i.state);
    i.potential.multiply(direction, product);
    const Clock::time_point start = Clock::now();
    double seconds = 0;
    int products = 0;
    while (products < 3 || (seconds < 0.01 && products < 1000)) {
        i.potential.multiply(direction, product);
        ++products;
        seconds = std::chrono::duration<double>(Clock::now() - start).count();
    }
    const double expected =
        i.lattice ? expected_products(i.lattice->first, i.lattice->second) : 10 * std::cbrt(node_count());
    return expected * seconds / products;
}

template class EquilibriumSolver<float>;
template class EquilibriumSolver<double>;

} // namespace hybmss
