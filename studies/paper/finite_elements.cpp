#include "studies/paper/finite_elements.hpp"

#include "studies/calculix/program.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <ostream>
#include <stdexcept>

namespace hybmss::paper {
namespace {

std::string key(const Experiment& experiment, const ElementChoice& choice) {
    return paper::key(experiment) + " " + paper::name(choice);
}

/// CalculiX prints seven digits; sums of them carry no more.
double rounded(double value) {
    return std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr);
}

} // namespace

FiniteElements::FiniteElements(Source source) : source_(source) {
    if (source == Source::program) {
        if (!calculix::is_installed()) {
            throw std::runtime_error(calculix::kNotInstalled);
        }
        version_ = calculix::version();
        return;
    }
    try {
        const auto stored = nlohmann::json::parse(kStoredFiniteElements);
        version_ = stored.at("calculix").get<std::string>();
        for (const auto& [name, entry] : stored.at("results").items()) {
            Figures& figures = known_[name];
            figures.failure = entry.value("failure", "");
            figures.volume_change = entry.value("volume_change", 0.0);
            figures.response = entry.value("response", 0.0);
            figures.seconds = entry.value("seconds", 0.0);
            for (const auto& u : entry.value("pictured", nlohmann::json::array())) {
                figures.pictured.push_back(u.get<std::array<double, 3>>());
            }
        }
    } catch (const nlohmann::json::exception& error) {
        throw std::runtime_error(std::string("studies/paper/calculix_results.json: ") + error.what());
    }
}

const Figures& FiniteElements::figures(const Experiment& experiment, const ElementChoice& choice) {
    const std::string name = key(experiment, choice);
    const auto [entry, is_new] = known_.try_emplace(name);
    if (is_new && source_ == Source::program) {
        if (before_run) {
            before_run(name);
        }
        entry->second = solve_finite_elements(experiment, choice);
    } else if (is_new) {
        entry->second.failure = "no result of CalculiX is kept for " + name;
    }
    return entry->second;
}

std::string FiniteElements::description() const {
    return "CalculiX " + version_ + (source_ == Source::stored ? ", results kept with this program" : "");
}

void FiniteElements::write(std::ostream& out) const {
    // A line an experiment: differences stay readable.
    out << "{\"command\": \"hybmss-study paper --calculix --store "
           "studies/paper/calculix_results.json\",\n\"calculix\": \""
        << version_ << "\",\n\"results\": {";
    const char* separator = "\n";
    for (const auto& [name, figures] : known_) {
        nlohmann::ordered_json entry;
        if (figures.good()) {
            entry["volume_change"] = rounded(figures.volume_change);
            entry["response"] = rounded(figures.response);
            entry["seconds"] = rounded(figures.seconds);
            for (const auto& u : figures.pictured) {
                entry["pictured"].push_back({rounded(u[0]), rounded(u[1]), rounded(u[2])});
            }
        } else {
            entry["failure"] = figures.failure;
        }
        out << separator << nlohmann::json(name).dump() << ": " << entry.dump();
        separator = ",\n";
    }
    out << "\n}}\n";
}

} // namespace hybmss::paper
