#include "app/progress_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

/// "[#######-------------]  35 %"
std::string bar(double fraction) {
    constexpr int kWidth = 20;
    const double part = std::clamp(fraction, 0.0, 1.0);
    const int full = static_cast<int>(part * kWidth);
    return fmt::format("[{:#<{}}{:-<{}}] {:3.0f} %", "", full, "", kWidth - full, std::floor(100 * part));
}

std::string duration_text(double seconds) {
    const double minute = 60, hour = 60 * minute, day = 24 * hour;
    return seconds < 2 * minute ? fmt::format("{:.2g} s", seconds)
           : seconds < 2 * hour ? fmt::format("{:.2g} minutes", seconds / minute)
           : seconds < 2 * day  ? fmt::format("{:.2g} hours", seconds / hour)
                                : fmt::format("{:.0f} days", seconds / day);
}

} // namespace

ProgressLine::ProgressLine(std::FILE* stream) : stream_(stream), visible_(isatty(fileno(stream)) == 1) {}

void ProgressLine::expect(const std::string& scene, double seconds) {
    constexpr double kSome = 3, kLong = 60;
    if (visible_) {
        expected_ = seconds > kSome ? "about " + duration_text(seconds) + ": " : "";
    } else if (seconds > kLong && !told_) {
        told_ = true;
        fmt::print(stream_, "hybmss: {}: it may take about {}\n", scene, duration_text(seconds));
        std::fflush(stream_);
    }
}

bool ProgressLine::is_due() {
    const auto now = std::chrono::steady_clock::now();
    if (!visible_ || now - last_ < std::chrono::milliseconds(200)) {
        return false;
    }
    last_ = now;
    return true;
}

void ProgressLine::show(const Progress& progress, const std::string& before) {
    if (!is_due()) {
        return;
    }
    shown_ = true;
    if (progress.solve) {
        const EquilibriumProgress& solve = *progress.solve;
        fmt::print(stream_,
                   "\r\033[K{}{}{} of the load, Newton {}, CG {}, residual {:.2e}, potential {:.4g} J, {:.0f} s",
                   expected_, before, bar(solve.load_fraction), solve.newton_iteration, solve.cg_iterations,
                   solve.residual, solve.potential, progress.wall_seconds);
        std::fflush(stream_);
        return;
    }
    if (progress.modes) {
        const ModesProgress& modes = *progress.modes;
        fmt::print(stream_, "\r\033[K{}{} iteration {}, {} of {} modes, {:.0f} s", before,
                   bar(static_cast<double>(modes.found) / modes.count), modes.iteration, modes.found, modes.count,
                   progress.wall_seconds);
        std::fflush(stream_);
        return;
    }
    const double left = progress.wall_seconds * static_cast<double>(progress.steps - progress.step) /
                        static_cast<double>(progress.step);
    const Energies& e = progress.energies;
    fmt::print(stream_,
               "\r\033[K{}{} step {} of {}, t = {:.4g} s, elastic {:.4g} J, kinetic {:.3g} J, at most {:.0f} s left",
               before, bar(static_cast<double>(progress.step) / static_cast<double>(progress.steps)), progress.step,
               progress.steps, progress.time, e.springs + e.volume, e.kinetic, left);
    std::fflush(stream_);
}

void ProgressLine::show(const std::string& text) {
    if (visible_) {
        shown_ = true;
        fmt::print(stream_, "\r\033[K{}", text);
        std::fflush(stream_);
    }
}

void show_meshes(ProgressLine& line, const std::string& scene, double accuracy, AccuracyOptions& options) {
    const auto name = [accuracy](const AccuracyMesh& mesh) {
        return fmt::format("accuracy = {:g}: {} x {} x {} cells{}", accuracy, mesh.cells[0], mesh.cells[1],
                           mesh.cells[2], mesh.seconds > 0 ? fmt::format(", about {:.2g} s", mesh.seconds) : "");
    };
    options.before_solve = [&line, scene, name](const AccuracyMesh& mesh) {
        line.show(name(mesh));
        if (!line.visible()) {
            line.expect(scene, mesh.seconds);
        }
    };
    options.progress = [&line, name](const AccuracyMesh& mesh, const Progress& progress) {
        line.show(progress, name(mesh) + ": ");
    };
}

void ProgressLine::clear() {
    if (shown_) {
        shown_ = false;
        fmt::print(stream_, "\r\033[K");
        std::fflush(stream_);
    }
}

} // namespace hybmss
