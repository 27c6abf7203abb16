#include "plan/tuning/tuner.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <random>

namespace hybmss {
namespace {

// ---- timing in rounds

constexpr std::size_t kLeastRounds = 3, kMostRounds = 1000;
// With many trials three rounds may use up the budget, and three are too few to tell trials apart that differ by 5 %:
// those left get so many, for at most as much time again.
constexpr std::size_t kFinalRounds = 10;

// A slice is timed in batches: where another process takes the core, it spoils one of them.
constexpr long kBatches = 4;

/// How far behind a trial may be after a round. A mood of the machine may have met some trials alone in the first
/// rounds.
double drop_limit(std::size_t round) {
    return round <= 2 ? 2.5 : round == 3 ? 1.6 : 1.25;
}

struct Runner {
    const Trial* trial;
    long batches = 1, steps = 1; ///< batches a slice, steps a batch
    std::vector<double> seconds_a_step;
    bool running = true;
};

/// Doubling until a good part of a slice is measured: one step of a small body is far below the clock's noise. Returns
/// the seconds spent.
double calibrate(Runner& runner, double slice_seconds) {
    // The first call also warms caches and threads up.
    long steps = 1;
    double elapsed = (*runner.trial)(steps), spent = elapsed;
    while (elapsed < 0.25 * slice_seconds && steps < std::numeric_limits<long>::max() / 4) {
        steps *= 2;
        elapsed = (*runner.trial)(steps);
        spent += elapsed;
    }
    const long fill = std::max(1L, std::lround(slice_seconds / std::max(elapsed, 1e-9) * static_cast<double>(steps)));
    runner.batches = std::min(kBatches, fill);
    runner.steps = fill / runner.batches;
    return spent;
}

/// Times one slice; returns the seconds spent.
double run_slice(Runner& runner) {
    double spent = 0;
    for (long b = 0; b < runner.batches; ++b) {
        const double elapsed = (*runner.trial)(runner.steps);
        runner.seconds_a_step.push_back(elapsed / static_cast<double>(runner.steps));
        spent += elapsed;
    }
    return spent;
}

} // namespace

double fastest_quarter_mean(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t quarter = (values.size() + 3) / 4;
    return std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(quarter), 0.0) /
           static_cast<double>(quarter);
}

std::vector<TrialTiming> time_in_rounds(const std::vector<Trial>& trials, double budget, double slice_seconds,
                                        bool drop) {
    std::vector<Runner> runners;
    double spent = 0;
    for (const Trial& trial : trials) {
        runners.push_back({&trial, 1, 1, {}, true});
        spent += calibrate(runners.back(), slice_seconds);
    }
    std::size_t left = runners.size();
    for (std::size_t round = 1; round <= kMostRounds; ++round) {
        for (std::size_t r = 0; r < runners.size(); ++r) {
            // Back and forth, so that none always runs on the same neighbour's leftovers.
            Runner& runner = runners[round % 2 ? r : runners.size() - 1 - r];
            if (runner.running) {
                spent += run_slice(runner);
            }
        }
        if (drop && round >= 2) {
            const double limit = drop_limit(round);
            double best = HUGE_VAL;
            for (const Runner& runner : runners) {
                best = std::min(best, fastest_quarter_mean(runner.seconds_a_step));
            }
            for (Runner& runner : runners) {
                if (runner.running && fastest_quarter_mean(runner.seconds_a_step) > limit * best) {
                    runner.running = false;
                    --left;
                }
            }
        }
        const double most = round < kFinalRounds ? 2 * budget : budget;
        if ((drop && left <= 1) || (round >= kLeastRounds && spent >= most)) {
            break;
        }
    }
    std::vector<TrialTiming> results;
    results.reserve(runners.size());
    for (const Runner& runner : runners) {
        results.push_back({fastest_quarter_mean(runner.seconds_a_step), runner.running});
    }
    return results;
}

// ---- measuring candidates

namespace {

constexpr std::size_t kScreeningNodes = 8192; // 20^3
constexpr double kScratchBytes = 512e6;
constexpr double kScreeningLimit = 1.5; // between layouts: on a small piece they may compare otherwise
constexpr double kScreeningLimitWithin = 1.2;
constexpr double kScreeningShare = 0.3; // of the time
constexpr double kSlice = 5e-3;         // s
constexpr double kRaceShare = 0.3;      // of the time, for a race against the fixed choice on top
constexpr std::size_t kLeastRaceRounds = 9;

/// A candidate's body, with a state of its own and what a caller would bring.
template <class T>
class TimedBody {
public:
    TimedBody(std::unique_ptr<Body<T>> body, Operation operation)
        : body_(std::move(body)), operation_(operation), state_(body_->make_state(operation == Operation::step)),
          displacements_(3 * body_->node_count()), forces_(displacements_.size(), T(0)) {
        // Small and random: at rest every spring is the same number, and some processors are faster on zeros.
        std::mt19937 engine(1);
        for (T& u : displacements_) {
            u = static_cast<T>(kAmplitude * (static_cast<double>(engine()) / 2147483648.0 - 1));
        }
        body_->write(view(), 1, state_.displacement);
        const double critical = body_->critical_time_step();
        parameters_.time_step = std::isfinite(critical) && critical > 0 ? 0.2 * critical : 1e-6;
    }

    double run(long steps) {
        const auto start = std::chrono::steady_clock::now();
        if (operation_ == Operation::step) {
            body_->workers().run(body_->step_stages(state_, step_factors(parameters_)), steps);
        } else {
            // As a plan's add_forces() does.
            const auto from = view();
            const auto to = VectorField<T>::aos(forces_.data(), body_->node_count());
            std::vector<Stage> stages = body_->force_stages(state_);
            stages.insert(stages.begin(), body_->write_stage(from, 1, state_.displacement));
            stages.push_back(body_->add_stage(state_.force, to));
            for (long s = 0; s < steps; ++s) {
                body_->workers().run(stages, 1);
            }
        }
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }

    int threads() const { return body_->describe().threads; }
    double bytes_a_node() const {
        const std::size_t bytes = body_->describe().bytes + state_.bytes() + 2 * sizeof(T) * displacements_.size();
        return static_cast<double>(bytes) / static_cast<double>(std::max<std::size_t>(body_->node_count(), 1));
    }

private:
    // In the body's length unit, the cell for a lattice. A network's springs may have any length; a hundredth of a
    // millimetre is small against most.
    static constexpr double kAmplitude = 1e-5;

    VectorField<const T> view() const { return VectorField<const T>::aos(displacements_.data(), body_->node_count()); }

    std::unique_ptr<Body<T>> body_;
    Operation operation_;
    State<T> state_;
    std::vector<T> displacements_, forces_;
    StepParameters parameters_;
};

/// What timing some candidates on one body gave.
struct Timings {
    std::vector<Candidate> candidates;
    std::vector<TrialTiming> trials; ///< one a candidate, seconds per step of the whole body
    double bytes_a_node = 0;         ///< of all candidates together

    /// Of those in a layout; of all where none is named.
    double fastest(const std::string& layout = {}) const {
        double best = HUGE_VAL;
        for (std::size_t i = 0; i < candidates.size(); ++i) {
            if (layout.empty() || candidates[i].layout == layout) {
                best = std::min(best, trials[i].seconds_a_step);
            }
        }
        return best;
    }
};

template <class T>
Timings time_candidates(const TunerSubject<T>& subject, const std::vector<Candidate>& candidates, Operation operation,
                        double seconds) {
    Timings timings;
    std::vector<std::unique_ptr<TimedBody<T>>> bodies;
    std::vector<Trial> trials;
    for (const Candidate& candidate : candidates) {
        auto body = std::make_unique<TimedBody<T>>(subject.make(fixed_options({}, candidate)), operation);
        // A body may use fewer threads than asked for, and would be timed against itself.
        if (body->threads() != candidate.threads && candidates.size() > 1) {
            continue;
        }
        timings.bytes_a_node += body->bytes_a_node();
        timings.candidates.push_back(candidate);
        trials.emplace_back([timed = body.get()](long steps) { return timed->run(steps); });
        bodies.push_back(std::move(body));
    }
    timings.trials = time_in_rounds(trials, seconds, kSlice);
    return timings;
}

/// The first of those that tie, on fewer threads where that makes no difference.
Candidate choose(const Timings& timings) {
    const double tie = kTie * timings.fastest();
    const Candidate* choice = nullptr;
    for (std::size_t i = 0; i < timings.candidates.size(); ++i) {
        if (timings.trials[i].seconds_a_step <= tie && (!choice || timings.candidates[i].threads < choice->threads)) {
            choice = &timings.candidates[i];
        }
    }
    return *choice;
}

/// How many times as fast as the fixed choice a candidate is, by bodies built anew: what it won by the place of its
/// memory or by the machine's mood, it does not win twice.
template <class T>
double race(const TunerSubject<T>& subject, const Candidate& fixed_choice, const Candidate& challenger,
            Operation operation, double seconds) {
    std::vector<Trial> trials;
    for (const Candidate* candidate : {&fixed_choice, &challenger}) {
        const auto body = std::make_shared<TimedBody<T>>(subject.make(fixed_options({}, *candidate)), operation);
        trials.emplace_back([body](long steps) { return body->run(steps); });
    }
    Interleaved rounds(std::move(trials), kSlice);
    std::vector<double> ratios;
    const auto start = std::chrono::steady_clock::now();
    while (ratios.size() < kLeastRaceRounds ||
           std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds) {
        const std::vector<double> round = rounds.next();
        ratios.push_back(round[0] / round[1]);
    }
    return median(std::move(ratios));
}

/// `last`: no later timing of these candidates follows.
void append_figures(const Timings& timings, std::size_t cells, bool last, std::vector<CandidateFigure>& figures) {
    for (std::size_t i = 0; i < timings.candidates.size(); ++i) {
        const TrialTiming& trial = timings.trials[i];
        figures.push_back({name(timings.candidates[i]), 1e9 * trial.seconds_a_step / static_cast<double>(cells),
                           last && trial.finalist});
    }
}

bool same_kernel(const Candidate& a, const Candidate& b) {
    return a.layout == b.layout && a.instruction_set == b.instruction_set && a.accuracy == b.accuracy &&
           a.one_tile == b.one_tile;
}

/// The candidates, each once, with one thread.
std::vector<Candidate> with_one_thread(std::vector<Candidate> candidates) {
    std::vector<Candidate> single;
    for (Candidate& candidate : candidates) {
        candidate.threads = 1;
        if (std::find(single.begin(), single.end(), candidate) == single.end()) {
            single.push_back(candidate);
        }
    }
    return single;
}

} // namespace

template <class T>
WisdomEntry measure(const TunerSubject<T>& subject, const std::vector<Candidate>& candidates,
                    const PlanOptions& options, Operation operation) {
    WisdomEntry entry;
    double seconds = options.measure_seconds;
    std::vector<Candidate> left = candidates;
    std::size_t sample_nodes = kTunerSampleNodes;
    if (subject.nodes > kScreeningNodes) {
        const TunerSubject<T> piece = subject.sample(kScreeningNodes);
        const Timings screening =
            time_candidates(piece, with_one_thread(candidates), operation, kScreeningShare * seconds);
        seconds *= 1 - kScreeningShare;
        append_figures(screening, piece.cells, false, entry.figures);
        const double most = kScreeningLimit * screening.fastest();
        std::erase_if(left, [&](const Candidate& candidate) {
            if (candidate == candidates.front()) {
                return false; // what all others are held to
            }
            for (std::size_t i = 0; i < screening.candidates.size(); ++i) {
                if (same_kernel(screening.candidates[i], candidate)) {
                    const double in_layout = screening.fastest(candidate.layout);
                    return in_layout > most || screening.trials[i].seconds_a_step > kScreeningLimitWithin * in_layout;
                }
            }
            return true;
        });
        const double bytes_a_node = screening.bytes_a_node / static_cast<double>(screening.candidates.size()) *
                                    static_cast<double>(left.size());
        sample_nodes = std::clamp<std::size_t>(static_cast<std::size_t>(kScratchBytes / bytes_a_node), kScreeningNodes,
                                               kTunerSampleNodes);
    }
    const bool whole = subject.nodes <= sample_nodes;
    const TunerSubject<T> piece = whole ? subject : subject.sample(sample_nodes);
    const Timings timings = time_candidates(piece, left, operation, seconds);
    // A candidate's figure on the larger piece replaces that of the screening.
    std::erase_if(entry.figures, [&](const CandidateFigure& figure) {
        return std::any_of(timings.candidates.begin(), timings.candidates.end(),
                           [&](const Candidate& candidate) { return name(candidate) == figure.name; });
    });
    append_figures(timings, piece.cells, true, entry.figures);
    entry.choice = choose(timings);
    // The first of those that can be: a small body may not use the threads of the fixed choice.
    if (const Candidate& fixed_choice = timings.candidates.front();
        !(entry.choice == fixed_choice) &&
        race(piece, fixed_choice, entry.choice, operation, kRaceShare * options.measure_seconds) < kGain) {
        entry.choice = fixed_choice;
    }
    std::stable_sort(entry.figures.begin(), entry.figures.end(), [](const auto& a, const auto& b) {
        return a.finalist != b.finalist ? a.finalist : a.ns_per_cell_step < b.ns_per_cell_step;
    });
    return entry;
}

template WisdomEntry measure(const TunerSubject<float>&, const std::vector<Candidate>&, const PlanOptions&, Operation);
template WisdomEntry measure(const TunerSubject<double>&, const std::vector<Candidate>&, const PlanOptions&, Operation);

} // namespace hybmss
