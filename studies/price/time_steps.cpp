#include "studies/price/price_tables.hpp"

#include "studies/paper/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <tuple>

namespace hybmss::price {
namespace {

using Vector3 = std::array<double, 3>;
using Field = std::vector<Vector3>;

constexpr int kPeriods = 2, kSamplesPerPeriod = 8, kRounds = 3;
constexpr double kQuick = 0.5;           // s
constexpr double kDampingRatio = 0.2;    // of the slowest bending, where it is damped
constexpr double kLargestExplicit = 0.9; // of the stable step at rest: the beam stiffens where it is compressed

Scene falling_beam() {
    Scene scene = paper::scene({.kind = paper::Kind::beam, .poisson_ratio = 0.3, .young_modulus = 1e7});
    scene.solver.duration = 1; // not used: steps are counted
    return scene;
}

/// Euler and Bernoulli's, in which 3.516 / L^2 sqrt(E I / (rho A)) is the slowest.
double period(const Scene& scene) {
    const double w = scene.body.cell_size * static_cast<double>(scene.body.cells[0]),
                 length = scene.body.cell_size * static_cast<double>(scene.body.cells[2]);
    return 2 * std::numbers::pi * length * length /
           (3.516 * std::sqrt(scene.material.young_modulus * w * w / (12 * scene.material.density)));
}

struct Motion {
    std::string failure;
    double seconds = 0;
    std::vector<Field> displacements; ///< by sample
    std::vector<double> energies, kinetic;
};

/// What moves the beam, and how.
struct Stepping {
    SolverMethod method;
    Precision precision;
    bool damped = false;
};

Motion move(const Stepping& way, int steps_between_samples) {
    Scene scene = falling_beam();
    scene.solver.method = way.method;
    scene.solver.time_step = period(scene) / (kSamplesPerPeriod * steps_between_samples);
    scene.damping.mass = way.damped ? kDampingRatio * 2 * (2 * std::numbers::pi / period(scene)) : 0;
    SimulationOptions options;
    options.precision = way.precision;
    options.plan.threads = 1;
    Simulation simulation(std::move(scene), options);
    Motion motion;
    for (int sample = 0; sample < kPeriods * kSamplesPerPeriod; ++sample) {
        const auto start = std::chrono::steady_clock::now();
        try {
            simulation.step(steps_between_samples);
        } catch (const std::runtime_error& error) {
            motion.failure = error.what();
            return motion;
        }
        motion.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        motion.displacements.push_back(simulation.displacements());
        const Energies e = simulation.energies();
        motion.kinetic.push_back(e.kinetic);
        motion.energies.push_back(e.springs + e.volume + e.kinetic + e.external);
    }
    return motion;
}

double size(const Field& u) {
    double sum = 0;
    for (const Vector3& v : u) {
        sum += v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    }
    return std::sqrt(sum / static_cast<double>(u.size()));
}

/// s a + t b
Field combined(double s, const Field& a, double t, const Field& b) {
    Field c = a;
    for (std::size_t n = 0; n < c.size(); ++n) {
        for (std::size_t i = 0; i < 3; ++i) {
            c[n][i] = s * a[n][i] + t * b[n][i];
        }
    }
    return c;
}

std::vector<Field> limit(int steps_between_samples, bool damped) {
    const Stepping way{SolverMethod::leapfrog, Precision::float64, damped};
    const Motion coarse = move(way, steps_between_samples), fine = move(way, 2 * steps_between_samples);
    std::vector<Field> fields;
    for (std::size_t s = 0; s < fine.displacements.size(); ++s) {
        fields.push_back(combined(4.0 / 3, fine.displacements[s], -1.0 / 3, coarse.displacements[s]));
    }
    return fields;
}

void measure(const Motion& motion, const std::vector<Field>& limit, TimeStepPoint& point) {
    double greatest = 0;
    for (std::size_t s = 0; s < limit.size(); ++s) {
        greatest = std::max(greatest, size(limit[s]));
        point.error = std::max(point.error, size(combined(1, motion.displacements[s], -1, limit[s])));
    }
    point.error /= greatest;
    // It starts at rest and undeformed: the whole energy is zero.
    const double kinetic = *std::max_element(motion.kinetic.begin(), motion.kinetic.end());
    double means[kPeriods] = {};
    for (std::size_t s = 0; s < motion.energies.size(); ++s) {
        point.energy = std::max(point.energy, std::abs(motion.energies[s]) / kinetic);
        means[s / kSamplesPerPeriod] += motion.energies[s] / kSamplesPerPeriod;
    }
    point.drift = (means[kPeriods - 1] - means[0]) / kinetic;
}

} // namespace

std::vector<TimeStepPoint> measure_time_steps(int halvings, const std::function<void(const std::string&)>& progress) {
    Scene probe = falling_beam();
    probe.solver.method = SolverMethod::symplectic_euler;
    const double critical = Simulation(probe).critical_time_step(), between = period(probe) / kSamplesPerPeriod;
    const int largest = static_cast<int>(std::ceil(between / (kLargestExplicit * critical)));
    progress("time steps: the limit");
    const std::vector<Field> references[] = {limit(largest << halvings, false), limit(largest << halvings, true)};

    constexpr Stepping kWays[] = {{SolverMethod::symplectic_euler, Precision::float64},
                                  {SolverMethod::symplectic_euler, Precision::float32},
                                  {SolverMethod::symplectic_euler, Precision::float64, true},
                                  {SolverMethod::leapfrog, Precision::float64},
                                  {SolverMethod::leapfrog, Precision::float32},
                                  {SolverMethod::leapfrog, Precision::float64, true},
                                  {SolverMethod::backward_euler, Precision::float64},
                                  {SolverMethod::backward_euler, Precision::float32}};
    std::vector<TimeStepPoint> points;
    for (int halving = 0; halving < halvings; ++halving) {
        const std::size_t first = points.size();
        std::vector<int> counts;
        for (const Stepping& way : kWays) {
            // The implicit one begins at an eighth of a period.
            counts.push_back(explicit_in_time(way.method) ? largest << halving : 1 << halving);
            TimeStepPoint& point = points.emplace_back();
            point.method = way.method;
            point.precision = way.precision;
            point.damped = way.damped;
            point.time_step = between / counts.back();
            point.of_critical = point.time_step / critical;
        }
        for (int round = 0; round < kRounds; ++round) {
            for (std::size_t p = first; p < points.size(); ++p) {
                TimeStepPoint& point = points[p];
                if (round > 0 && (point.seconds > kQuick || !point.failure.empty())) {
                    continue;
                }
                progress(fmt::format("time steps: {}, {:.3g} s", name(point.method), point.time_step));
                const Motion motion = move({point.method, point.precision, point.damped}, counts[p - first]);
                point.failure = motion.failure;
                point.seconds = round == 0 ? motion.seconds : std::min(point.seconds, motion.seconds);
                if (round == 0 && motion.failure.empty()) {
                    measure(motion, references[point.damped], point);
                }
            }
        }
    }
    std::stable_sort(points.begin(), points.end(), [](const TimeStepPoint& a, const TimeStepPoint& b) {
        const auto key = [](const TimeStepPoint& p) {
            return std::tuple(p.method, p.damped, p.precision == Precision::float32);
        };
        return key(a) < key(b);
    });
    return points;
}

paper::Table time_step_table(const std::vector<TimeStepPoint>& points) {
    using paper::Cell;
    paper::Table table{
        "time-steps",
        "The price of time steps",
        {"The paper's beam, 4 x 4 x 24 cells, E = 10 MPa, nu = 0.3, falls from rest under its weight for two periods "
         "of "
         "its slowest bending, without damping or with a fifth of what would stop that, by mass. Error: the greatest "
         "distance (RMS over nodes) from the limit of small "
         "steps at 16 times, over the greatest displacement. Energy: the greatest change of the whole, over the "
         "greatest kinetic energy; drift: its mean in the second period less that in the first. Seconds of the steps "
         "alone, on one thread, the integrators in turns. Expected order: 2 for leapfrog, else 1."},
        {{"method", "method"},
         {"precision", "type"},
         {"damped", "damped"},
         {"time_step", "step, s", -3},
         {"of_critical", "of the stable one", -3},
         {"seconds", "s", -3},
         {"error", "error, %", -3},
         {"order", "order", 2},
         {"energy", "energy, %", -3},
         {"energy_order", "order", 2},
         {"drift", "drift, %", -2}},
        {},
        {}};
    const TimeStepPoint* before = nullptr;
    for (const TimeStepPoint& point : points) {
        const bool same = before != nullptr && before->method == point.method && before->precision == point.precision &&
                          before->damped == point.damped && before->failure.empty();
        const auto order = [&](double TimeStepPoint::*value) {
            return same ? Cell(std::log(before->*value / point.*value) / std::log(before->time_step / point.time_step))
                        : Cell();
        };
        table.rows.push_back({std::string(name(point.method)), std::string(name(point.precision)),
                              std::string(point.damped ? "yes" : "no"), point.time_step, point.of_critical,
                              point.seconds});
        if (point.failure.empty()) {
            auto& row = table.rows.back();
            row.insert(row.end(), {100 * point.error, order(&TimeStepPoint::error)});
            if (point.damped) { // which takes energy out
                row.resize(table.columns.size());
            } else {
                row.insert(row.end(), {100 * point.energy, order(&TimeStepPoint::energy), 100 * point.drift});
            }
        } else {
            table.rows.back().push_back(std::string("failed"));
            table.rows.back().resize(table.columns.size());
        }
        before = &point;
    }
    // The best of the implicit one beside the explicit ones' largest step.
    const TimeStepPoint *of_first_order = nullptr, *of_second_order = nullptr, *implicit_point = nullptr;
    for (const TimeStepPoint& point : points) {
        if (point.precision == Precision::float64 && point.failure.empty() && !point.damped) {
            const TimeStepPoint*& best = point.method == SolverMethod::symplectic_euler ? of_first_order
                                         : point.method == SolverMethod::leapfrog       ? of_second_order
                                                                                        : implicit_point;
            best = best != nullptr && explicit_in_time(point.method) ? best : &point;
        }
    }
    if (of_first_order != nullptr && of_second_order != nullptr && implicit_point != nullptr) {
        table.remarks.push_back(fmt::format(
            "Near the stable step semi-implicit Euler has {:.2g} % of error in {:.2g} s, leapfrog {:.2g} % in {:.2g} "
            "s; "
            "backward Euler's smallest step here {:.2g} % in {:.2g} s: it takes energy out of whatever is faster than "
            "its step.",
            100 * of_first_order->error, of_first_order->seconds, 100 * of_second_order->error,
            of_second_order->seconds, 100 * implicit_point->error, implicit_point->seconds));
    }
    table.remarks.emplace_back(
        "In float the smallest steps gain less: every step rounds displacements and velocities.");
    return table;
}

} // namespace hybmss::price
