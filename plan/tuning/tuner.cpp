#include "plan/tuning/tuner.hpp"

#include "plan/tuning/tuner_race.hpp"
#include "plan/tuning/tuner_sample.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <random>

namespace hybmss {
namespace {

constexpr std::size_t kSieveNodes = 8192; // 20^3
constexpr double kScratchBytes = 512e6;
constexpr double kSieveBehind = 1.5;
constexpr double kSieveShare = 0.3; // of the time
constexpr double kVariantsShare = 0.25;
constexpr double kSlice = 5e-3; // s
// Of one kernel, where two bodies happen to lie in memory makes this much: a tile size or a split integration must gain
// more to be chosen.
constexpr double kVariantTie = 1.05;

/// A candidate's body, with a state of its own and what a caller would bring.
template <class T>
class Contestant {
public:
    Contestant(std::unique_ptr<Body<T>> body, Operation operation)
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
            body_->workers().run(body_->step_stages(state_, parameters_), steps);
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

/// One race among candidates on one body.
template <class T>
struct Heat {
    std::vector<Candidate> candidates;
    std::vector<RaceResult> results; ///< one a candidate, seconds per step of the whole body
    double bytes_a_node = 0;         ///< of all candidates together
};

template <class T>
Heat<T> run_heat(const TunerSubject<T>& subject, const std::vector<Candidate>& candidates, Operation operation,
                 double seconds) {
    Heat<T> heat;
    std::vector<std::unique_ptr<Contestant<T>>> contestants;
    std::vector<Trial> trials;
    for (const Candidate& candidate : candidates) {
        auto contestant = std::make_unique<Contestant<T>>(subject.make(fixed_options({}, candidate)), operation);
        // A body may use fewer threads than asked for, and would race against itself.
        if (contestant->threads() != candidate.threads && candidates.size() > 1) {
            continue;
        }
        heat.bytes_a_node += contestant->bytes_a_node();
        heat.candidates.push_back(candidate);
        trials.emplace_back([body = contestant.get()](long steps) { return body->run(steps); });
        contestants.push_back(std::move(contestant));
    }
    heat.results = race(trials, seconds, kSlice);
    return heat;
}

double fastest(const std::vector<RaceResult>& results) {
    double best = HUGE_VAL;
    for (const RaceResult& result : results) {
        best = std::min(best, result.seconds_a_step);
    }
    return best;
}

/// The first of those that tie, on fewer threads where that makes no difference.
template <class T>
Candidate choose(const Heat<T>& heat, double tie_ratio) {
    const double tie = tie_ratio * fastest(heat.results);
    const Candidate* choice = nullptr;
    for (std::size_t i = 0; i < heat.candidates.size(); ++i) {
        if (heat.results[i].seconds_a_step <= tie && (!choice || heat.candidates[i].threads < choice->threads)) {
            choice = &heat.candidates[i];
        }
    }
    return *choice;
}

template <class T>
void append_figures(const Heat<T>& heat, std::size_t cells, bool last, std::vector<CandidateFigure>& figures) {
    for (std::size_t i = 0; i < heat.candidates.size(); ++i) {
        figures.push_back({name(heat.candidates[i]), 1e9 * heat.results[i].seconds_a_step / static_cast<double>(cells),
                           last && heat.results[i].finalist});
    }
}

/// Figures of the last heats: one of the same candidate on a larger piece, or later, replaces the one before.
template <class T>
void replace_figures(const Heat<T>& heat, std::size_t cells, std::vector<CandidateFigure>& figures) {
    std::erase_if(figures, [&](const CandidateFigure& figure) {
        return std::any_of(heat.candidates.begin(), heat.candidates.end(),
                           [&](const Candidate& candidate) { return name(candidate) == figure.name; });
    });
    append_figures(heat, cells, true, figures);
}

bool same_kernel(const Candidate& a, const Candidate& b) {
    return a.layout == b.layout && a.instruction_set == b.instruction_set && a.accuracy == b.accuracy;
}

} // namespace

template <class T>
WisdomEntry measure(const TunerSubject<T>& subject, const std::vector<Candidate>& candidates,
                    const PlanOptions& options, Operation operation) {
    WisdomEntry entry;
    const double variants_seconds = kVariantsShare * options.measure_seconds;
    double seconds = options.measure_seconds - variants_seconds;
    std::vector<Candidate> left;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(left),
                 [&](const Candidate& candidate) { return is_plain(candidate, options); });
    std::size_t sample_nodes = kTunerSampleNodes;
    if (subject.nodes > kSieveNodes) {
        std::vector<Candidate> single;
        for (Candidate candidate : left) {
            candidate.threads = 1;
            if (std::find(single.begin(), single.end(), candidate) == single.end()) {
                single.push_back(candidate);
            }
        }
        const TunerSubject<T> piece = subject.sample(kSieveNodes);
        const Heat<T> heat = run_heat(piece, single, operation, kSieveShare * seconds);
        seconds *= 1 - kSieveShare;
        append_figures(heat, piece.cells, false, entry.figures);
        const double most = kSieveBehind * fastest(heat.results);
        std::erase_if(left, [&](const Candidate& candidate) {
            for (std::size_t i = 0; i < heat.candidates.size(); ++i) {
                if (same_kernel(heat.candidates[i], candidate)) {
                    return heat.results[i].seconds_a_step > most;
                }
            }
            return true;
        });
        const double bytes_a_node =
            heat.bytes_a_node / static_cast<double>(heat.candidates.size()) * static_cast<double>(left.size());
        sample_nodes = std::clamp<std::size_t>(static_cast<std::size_t>(kScratchBytes / bytes_a_node), kSieveNodes,
                                               kTunerSampleNodes);
    }
    const bool whole = subject.nodes <= sample_nodes;
    const TunerSubject<T> piece = whole ? subject : subject.sample(sample_nodes);
    const Heat<T> heat = run_heat(piece, left, operation, seconds);
    replace_figures(heat, piece.cells, entry.figures);
    entry.choice = choose(heat, kRaceTie);

    std::vector<Candidate> variants = {entry.choice}; // first: what ties with it does not replace it
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(variants), [&](const Candidate& candidate) {
        return same_kernel(candidate, entry.choice) && candidate.threads == entry.choice.threads &&
               candidate != entry.choice;
    });
    if (variants.size() > 1) {
        const Heat<T> last = run_heat(piece, variants, operation, variants_seconds);
        replace_figures(last, piece.cells, entry.figures);
        entry.choice = choose(last, kVariantTie);
    }
    std::stable_sort(entry.figures.begin(), entry.figures.end(), [](const auto& a, const auto& b) {
        return a.finalist != b.finalist ? a.finalist : a.ns_per_cell_step < b.ns_per_cell_step;
    });
    return entry;
}

template WisdomEntry measure(const TunerSubject<float>&, const std::vector<Candidate>&, const PlanOptions&, Operation);
template WisdomEntry measure(const TunerSubject<double>&, const std::vector<Candidate>&, const PlanOptions&, Operation);

} // namespace hybmss
