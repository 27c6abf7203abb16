#include "plan/tuning/planned_body.hpp"

#include "layouts/messages.hpp"
#include "plan/tuning/candidates.hpp"
#include "plan/tuning/tuner.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace hybmss {
namespace {

double figure_of(const std::vector<CandidateFigure>& figures, const std::string& candidate) {
    const auto found = std::find_if(figures.begin(), figures.end(),
                                    [&](const CandidateFigure& figure) { return figure.name == candidate; });
    return found == figures.end() ? 0 : found->ns_per_cell_step;
}

/// "6.53 ns a cell and step, 1.31 times as fast as the fixed choice flat-rows/..."
std::string comparison(const WisdomEntry& entry, const Candidate& fixed_choice) {
    const double chosen = figure_of(entry.figures, name(entry.choice));
    const double fixed = figure_of(entry.figures, name(fixed_choice));
    if (chosen <= 0) {
        return "the choice for larger bodies, with the threads that are of use here";
    }
    std::string all = printed("%.3g ns a cell and step", chosen);
    if (entry.choice == fixed_choice) {
        return all + ", the fixed choice too";
    }
    if (fixed > 0) {
        all += printed(", %.2f times as fast as the fixed choice ", fixed / chosen) + name(fixed_choice);
    }
    return all;
}

template <class T>
class Planner {
public:
    Planner(const TunerSubject<T>& subject, const PlanOptions& options, Operation operation)
        : subject_(subject), options_(options), operation_(operation),
          candidates_(candidates(subject.layouts, options, subject.nodes)),
          key_((operation == Operation::step ? "step " : "forces ") + subject.body_class + " " + wish_class(options)) {}

    PlannedBody<T> planned() const {
        const bool stored = options_.effort == Effort::stored;
        if (stored && !options_.wisdom) {
            throw std::invalid_argument("effort = stored is not allowed without wisdom: name some, or take another "
                                        "effort (estimate, measure)");
        }
        if (const double seconds = options_.measure_seconds; !stored && !(seconds > 0 && std::isfinite(seconds))) {
            refuse_value("measure_seconds", seconds, "finite and above 0");
        }
        if (const std::optional<WisdomEntry> entry = known()) {
            return make(entry->choice, "wisdom for this class of body: " + comparison(*entry, candidates_.front()),
                        entry->figures);
        }
        if (stored) {
            throw std::invalid_argument("effort = stored: none of the " + std::to_string(options_.wisdom->entries()) +
                                        " entries of the wisdom fits \"" + key_ +
                                        "\": measure it first (hybmss tune), or take another effort");
        }
        if (candidates_.size() == 1) {
            return make(candidates_.front(), "the options leave this candidate alone", {});
        }
        const auto start = std::chrono::steady_clock::now();
        WisdomEntry entry = measure(subject_, candidates_, options_, operation_);
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        PlannedBody<T> planned = make(entry.choice,
                                      printed("measured now (%zu candidates, %.2g s): ", candidates_.size(), seconds) +
                                          comparison(entry, candidates_.front()),
                                      entry.figures);
        if (options_.wisdom) {
            WisdomStore::put(*options_.wisdom, key_, std::move(entry));
        }
        return planned;
    }

private:
    /// What the wisdom says, if it is a candidate: wisdom is not trusted to name what the options rule out. Threads are
    /// cut to those of use: bodies of one class differ a little in size.
    std::optional<WisdomEntry> known() const {
        if (!options_.wisdom) {
            return std::nullopt;
        }
        std::optional<WisdomEntry> entry = WisdomStore::find(*options_.wisdom, key_);
        const Candidate* fitting = nullptr;
        for (const Candidate& candidate : candidates_) {
            Candidate alike = candidate;
            alike.threads = entry ? entry->choice.threads : 0;
            if (entry && alike == entry->choice && candidate.threads <= entry->choice.threads &&
                (!fitting || fitting->threads < candidate.threads)) {
                fitting = &candidate;
            }
        }
        if (!fitting) {
            return std::nullopt;
        }
        entry->choice.threads = fitting->threads; // all else is alike
        return entry;
    }

    PlannedBody<T> make(const Candidate& choice, std::string reason, std::vector<CandidateFigure> figures) const {
        const PlanOptions fixed = fixed_options(options_, choice);
        return {subject_.make(fixed), fixed, options_.effort, std::move(reason), std::move(figures)};
    }

    const TunerSubject<T>& subject_;
    const PlanOptions& options_;
    Operation operation_;
    std::vector<Candidate> candidates_;
    std::string key_;
};

/// No subject is made for an estimate: its class costs a pass over the body. Nor for a layout that is not known:
/// make_body refuses it.
bool is_fixed(const PlanOptions& options, bool of_network) {
    return options.effort == Effort::estimate || !(options.layout.empty() || is_layout(options.layout, of_network));
}

/// The options with `accuracy` in place of `force_error`.
template <class T>
PlanOptions with_level(const PlanOptions& options) {
    PlanOptions same = options;
    if (options.force_error != 0) {
        constexpr Precision kOwn = sizeof(T) == sizeof(float) ? Precision::float32 : Precision::float64;
        const double error = options.force_error, least = force_error_bound(Accuracy::accurate, kOwn);
        if (!(error >= least)) {
            refuse_value("force_error", error, printed("0 or at least %g in ", least) + std::string(name(kOwn)));
        }
        same.accuracy = error >= force_error_bound(Accuracy::fast, kOwn) ? Accuracy::fast : Accuracy::accurate;
        same.force_error = 0;
    }
    return same;
}

template <class T>
PlannedBody<T> fixed(std::unique_ptr<Body<T>> body, const PlanOptions& options) {
    return {std::move(body), options, options.effort, "the fixed choice for such a body; nothing was timed", {}};
}

} // namespace

template <class T>
PlanDescription PlannedBody<T>::describe() const {
    PlanDescription description = body->describe();
    description.choice = choice;
    if (effort == Effort::estimate) {
        description.choice.instruction_set = description.instruction_set;
        description.choice.threads = description.threads;
    }
    description.choice.effort = Effort::estimate;
    description.choice.wisdom = nullptr;
    description.choice.task_runner = nullptr;
    description.effort = effort;
    description.reason = reason;
    description.candidates = figures;
    return description;
}

template <class T>
PlannedBody<T> plan_body(const Lattice& lattice, const Material& material, const PlanOptions& given,
                         Operation operation) {
    PlanOptions options = with_level<T>(given);
    const std::string estimated = operation == Operation::step ? estimated_step_layout(lattice, options.accuracy)
                                                               : estimated_layout(lattice, options.accuracy);
    // A body without nodes takes no time.
    if (is_fixed(options, false) || lattice.cell_count() == 0) {
        options.layout = options.layout.empty() ? estimated : options.layout;
        return fixed(make_body<T>(lattice, material, options), options);
    }
    validate(material);
    return Planner<T>(subject_of<T>(lattice, material, estimated), options, operation).planned();
}

template <class T>
PlannedBody<T> plan_body(const Network& network, const PlanOptions& given, Operation operation) {
    const PlanOptions options = with_level<T>(given);
    if (is_fixed(options, true) || network.masses.empty()) {
        return fixed(make_body<T>(network, options), options);
    }
    validate(network);
    return Planner<T>(subject_of<T>(network), options, operation).planned();
}

template struct PlannedBody<float>;
template struct PlannedBody<double>;
template PlannedBody<float> plan_body(const Lattice&, const Material&, const PlanOptions&, Operation);
template PlannedBody<double> plan_body(const Lattice&, const Material&, const PlanOptions&, Operation);
template PlannedBody<float> plan_body(const Network&, const PlanOptions&, Operation);
template PlannedBody<double> plan_body(const Network&, const PlanOptions&, Operation);

} // namespace hybmss
