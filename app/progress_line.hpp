#pragma once

/// \file
/// One line on a terminal that tells how far a run is.

#include "hybmss/simulation/solve_to_accuracy.hpp"

#include <chrono>
#include <cstdio>
#include <string>

namespace hybmss {

/// Shows nothing unless the stream is a terminal.
class ProgressLine {
public:
    explicit ProgressLine(std::FILE* stream);
    ProgressLine(const ProgressLine&) = delete;
    ProgressLine& operator=(const ProgressLine&) = delete;
    ~ProgressLine() { clear(); }

    bool visible() const { return visible_; }
    /// How long it may take: on a terminal the line begins with it, where it is over some seconds; elsewhere one line
    /// stands at the start where it is over a minute, and no second one.
    void expect(const std::string& scene, double seconds);
    /// Rewrites the line, at most some five times a second. `before`: what to say first.
    void show(const Progress& progress, const std::string& before = "");
    /// Rewrites the line at once.
    void show(const std::string& text);
    /// Takes the line away.
    void clear();

private:
    bool is_due();

    std::FILE* stream_;
    bool visible_, shown_ = false, told_ = false;
    std::string expected_;
    std::chrono::steady_clock::time_point last_{};
};

/// Shows the meshes that a wish for an accuracy is solved on; the line must outlive the options.
void show_meshes(ProgressLine& line, const std::string& scene, double accuracy, AccuracyOptions& options);

} // namespace hybmss
