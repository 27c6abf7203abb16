#pragma once

/// \file
/// One line on a terminal that tells how far a run is.

#include "hybmss/simulation/simulation.hpp"

#include <chrono>
#include <cstdio>
#include <string>

namespace hybmss {

/// Shows nothing unless the stream is a terminal.
class ProgressLine {
public:
    explicit ProgressLine(std::FILE* stream);

    bool visible() const { return visible_; }
    /// Rewrites the line, at most some five times a second.
    void show(const Progress& progress);
    void show(const std::string& text);
    /// Takes the line away.
    void clear();

private:
    bool is_due();

    std::FILE* stream_;
    bool visible_, shown_ = false;
    std::chrono::steady_clock::time_point last_{};
};

} // namespace hybmss
