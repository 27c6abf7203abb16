#include "hybmss/batch.hpp"

#include "dynamics/explicit_dynamics_implementation.hpp"
#include "dynamics/shared_out.hpp"
#include "plan/bodies/step_factors.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {
namespace {

template <class T>
void check(std::span<ExplicitDynamics<T>* const> bodies) {
    std::vector<std::pair<ExplicitDynamics<T>*, std::size_t>> named;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!bodies[i]) {
            throw std::invalid_argument("bodies[" + std::to_string(i) + "] is null: it must point to a body");
        }
        named.emplace_back(bodies[i], i);
    }
    std::sort(named.begin(), named.end());
    const auto twice =
        std::adjacent_find(named.begin(), named.end(), [](const auto& a, const auto& b) { return a.first == b.first; });
    if (twice != named.end()) {
        throw std::invalid_argument("bodies[" + std::to_string((twice + 1)->second) + "] is bodies[" +
                                    std::to_string(twice->second) + "] too: each must be named once");
    }
}

template <class T>
void check(const StepParameters& parameters) {
    // For what it throws.
    static_cast<void>(step_constants<T>(step_factors(parameters), 1));
}

} // namespace

std::string to_string(const BatchDescription& d) {
    return std::to_string(d.bodies) + " bodies: " + std::to_string(d.side_by_side) + " side by side in " +
           std::to_string(d.vectors) + " vectors, " + std::to_string(d.bodies - d.side_by_side) + " one by one";
}

/// The bodies of a call are units of work: one alone, or those that are alike in the lanes of a row. A row stays from
/// call to call, for as long as all of its bodies are named in their places and none has become another.
template <class T>
struct Batch<T>::Implementation : SharedOut {
    using Inside = typename ExplicitDynamics<T>::Implementation;

    struct Unit {
        std::vector<std::size_t> bodies;       ///< by their place in the call, and by lane
        std::shared_ptr<BodiesAbreast<T>> row; ///< null of one alone
        std::size_t like = 0;                  ///< whose masses and stiffnesses all rows of a kind take, in cache
        const void* alone = nullptr;           ///< which it is
        bool could = false;                    ///< it might have a place in a row if there were others
        bool abreast = false;                  ///< in this call
    };

    Implementation(int threads, BatchLayout wanted) : SharedOut(threads), layout(wanted) {}

    /// Whether a body can be a lane.
    bool can(const Inside& body) const {
        // In larger bodies few lanes are void, and one by one they stay in the second cache (docs/report/batch.md).
        constexpr std::size_t kMostBytes = std::size_t{1} << 20;
        const std::size_t lanes = body.body->abreast(), size = body.state.displacement[0].size();
        return layout != BatchLayout::one_by_one && lanes > 1 && body.effects.empty() && !body.watched &&
               (layout == BatchLayout::side_by_side || 6 * sizeof(T) * lanes * size <= kMostBytes);
    }

    /// `inside(i)`: of body i of n, wherever its state is.
    template <class Bodies>
    bool all_in_place(std::size_t n, const Bodies& inside) const {
        std::size_t named = 0;
        for (const Unit& unit : units) {
            named += unit.bodies.size();
            if (named > n) {
                return false;
            }
            for (std::size_t lane = 0; lane < unit.bodies.size(); ++lane) {
                const Inside& body = inside(unit.bodies[lane]);
                if (unit.row ? body.seat.row != unit.row || body.seat.lane != lane || body.seat.cuts != body.cuts ||
                                   !body.effects.empty() || body.watched
                             : unit.alone != &body || unit.could != can(body)) {
                    return false;
                }
            }
        }
        return named == n;
    }

    /// Makes the units; all bodies are at home.
    template <class Bodies, class Parameters>
    void find_units(std::size_t n, const Bodies& inside, const Parameters& parameters) {
        units.clear();
        std::vector<std::vector<std::size_t>> kinds; // bodies that are alike
        for (std::size_t i = 0; i < n; ++i) {
            Inside& body = inside(i);
            body.seat = {};
            if (!can(body)) {
                units.push_back({{i}, nullptr, i, &body});
                continue;
            }
            const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](const std::vector<std::size_t>& others) {
                const Inside& first = inside(others.front());
                return parameters(others.front()) == parameters(i) && first.half == body.half &&
                       first.body->steps_like(*body.body);
            });
            (kind != kinds.end() ? *kind : kinds.emplace_back()).push_back(i);
        }
        for (const std::vector<std::size_t>& kind : kinds) {
            const Body<T>& body = *inside(kind.front()).body;
            const std::size_t lanes = body.abreast();
            const std::size_t enough = layout == BatchLayout::side_by_side ? 2 : (3 * lanes + 3) / 4;
            for (std::size_t first = 0; first < kind.size(); first += lanes) {
                const std::vector<std::size_t> bodies(
                    kind.begin() + static_cast<std::ptrdiff_t>(first),
                    kind.begin() + static_cast<std::ptrdiff_t>(std::min(first + lanes, kind.size())));
                if (bodies.size() < enough) {
                    for (const std::size_t i : bodies) {
                        units.push_back({{i}, nullptr, i, &inside(i), true});
                    }
                    continue;
                }
                const auto row = std::make_shared<BodiesAbreast<T>>(body.state_abreast());
                for (std::size_t lane = 0; lane < bodies.size(); ++lane) {
                    inside(bodies[lane]).seat = {row, lane, false, inside(bodies[lane]).cuts};
                }
                units.push_back({bodies, row, kind.front()});
            }
        }
    }

    /// Brings the bodies of a row that are elsewhere to their places.
    template <class Bodies>
    static void sit_down(Unit& unit, const Bodies& inside) {
        const auto sits = [&](std::size_t i) { return inside(i).seat.taken; };
        if (std::all_of(unit.bodies.begin(), unit.bodies.end(), sits)) {
            return;
        }
        BodiesAbreast<T>& row = *unit.row;
        const std::size_t lanes = row.state.bodies;
        row.prescribed.clear();
        row.loaded.clear();
        for (std::size_t lane = 0; lane < unit.bodies.size(); ++lane) {
            const Inside& body = inside(unit.bodies[lane]);
            for (PrescribedComponent<T> p : body.prescribed) {
                p.index = lanes * p.index + lane;
                row.prescribed.push_back(p);
            }
            for (LoadedComponent<T> p : body.loaded) {
                p.index = lanes * p.index + lane;
                row.loaded.push_back(p);
            }
        }
        for (const std::size_t i : unit.bodies) {
            if (!sits(i)) {
                inside(i).sit_down();
            }
        }
    }

    /// `at(i)`, `parameters(i)`: body i of n, and how it steps.
    template <class At, class Parameters>
    void step(std::size_t n, const At& at, const Parameters& parameters, long count) {
        if (count < 0 && n > 0) {
            at(0).step(parameters(0), count); // for what it throws
        }
        const auto inside = [&](std::size_t i) -> Inside& { return at(i).implementation_.wherever(); };
        if (!all_in_place(n, inside)) {
            for (std::size_t i = 0; i < n; ++i) {
                static_cast<void>(*at(i).implementation_); // comes home
            }
            find_units(n, inside, parameters);
        }
        description = {n, 0, 0};
        for (Unit& unit : units) {
            const std::size_t first = unit.bodies.front();
            const bool leapfrog = parameters(first).integrator == Integrator::leapfrog;
            unit.abreast = unit.row && (leapfrog || !inside(first).half) &&
                           std::all_of(unit.bodies.begin(), unit.bodies.end(), [&](std::size_t i) {
                               return parameters(i) == parameters(first) && inside(i).half == inside(first).half;
                           });
            description.side_by_side += unit.abreast ? unit.bodies.size() : 0;
            description.vectors += unit.abreast;
        }
        this->run(units.size(), [&](std::size_t u) {
            Unit& unit = units[u];
            if (!unit.abreast) {
                for (const std::size_t i : unit.bodies) {
                    at(i).step(parameters(i), count);
                }
                return;
            }
            sit_down(unit, inside);
            const std::size_t first = unit.bodies.front();
            BodiesAbreast<T>& row = *unit.row;
            take_steps<T>(*inside(unit.like).body, row.state, parameters(first), inside(first).half,
                          {{}, row.prescribed, row.loaded}, count);
            row.all_finite.reset();
            for (const std::size_t i : unit.bodies) {
                inside(i).took(parameters(first), count);
            }
        });
    }

    BatchLayout layout;
    std::vector<Unit> units;
    BatchDescription description;
};

template <class T>
Batch<T>::Batch(int threads, BatchLayout layout) : implementation_(std::make_unique<Implementation>(threads, layout)) {}
template <class T>
Batch<T>::Batch(Batch&&) noexcept = default;
template <class T>
Batch<T>& Batch<T>::operator=(Batch&&) noexcept = default;
template <class T>
Batch<T>::~Batch() = default;

template <class T>
int Batch<T>::threads() const {
    return implementation_->workers().threads();
}

template <class T>
BatchDescription Batch<T>::describe() const {
    return implementation_->description;
}

template <class T>
void Batch<T>::step(std::span<ExplicitDynamics<T>> bodies, const StepParameters& parameters, long count) {
    check<T>(parameters);
    implementation_->step(
        bodies.size(), [&](std::size_t i) -> ExplicitDynamics<T>& { return bodies[i]; },
        [&](std::size_t) -> const StepParameters& { return parameters; }, count);
}

template <class T>
void Batch<T>::step(std::span<ExplicitDynamics<T>* const> bodies, std::span<const StepParameters> parameters,
                    long count) {
    if (parameters.size() != bodies.size()) {
        throw std::invalid_argument("parameters of " + std::to_string(parameters.size()) + " bodies given for " +
                                    std::to_string(bodies.size()) + ": there must be as many of them");
    }
    check<T>(bodies);
    for (const StepParameters& p : parameters) {
        check<T>(p);
    }
    implementation_->step(
        bodies.size(), [&](std::size_t i) -> ExplicitDynamics<T>& { return *bodies[i]; },
        [&](std::size_t i) -> const StepParameters& { return parameters[i]; }, count);
}

template class Batch<float>;
template class Batch<double>;

} // namespace hybmss
