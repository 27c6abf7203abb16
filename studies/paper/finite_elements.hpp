#pragma once

/// \file
/// CalculiX's figures of the experiments: those kept in calculix_results.json, or run anew.

#include "studies/paper/figures.hpp"

#include <functional>
#include <iosfwd>
#include <map>
#include <string>
#include <string_view>

namespace hybmss::paper {

/// CalculiX's answers by experiment. Not for concurrent use.
class FiniteElements {
public:
    enum class Source {
        stored, ///< what calculix_results.json held when this program was built
        program ///< ccx, each experiment at most once
    };
    /// Throws std::runtime_error for Source::program where ccx is not installed, and where the kept results cannot be
    /// read.
    explicit FiniteElements(Source source);

    /// A stored experiment that is not there has `failure` set.
    const Figures& figures(const Experiment& experiment, const ElementChoice& choice = {});

    /// "CalculiX 2.20, results kept with this program" or "CalculiX 2.20".
    std::string description() const;
    Source source() const { return source_; }
    /// Everything asked for, as calculix_results.json holds it.
    void write(std::ostream& out) const;

    /// Called with the key of each run before it begins; may be empty.
    std::function<void(const std::string&)> before_run;

private:
    Source source_;
    std::string version_;
    std::map<std::string, Figures> known_;
};

/// The file's text, as it was when this program was built.
extern const std::string_view kStoredFiniteElements;

} // namespace hybmss::paper
