#include "studies/stability/map_report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hybmss::stability {
namespace {

std::string_view name(VolumeEnergy energy) {
    switch (energy) {
    case VolumeEnergy::quadratic:
        return "quadratic";
    case VolumeEnergy::mean_stretch:
        return "mean_stretch";
    default:
        return "automatic";
    }
}

/// q in pi/h. Waves that the loading's symmetry makes equal are shown as one: the axes that are alike in falling order.
std::array<double, 3> wave_vector(const Wave& wave, Stretching stretching) {
    std::array<double, 3> q;
    for (int axis = 0; axis < 3; ++axis) {
        q[static_cast<std::size_t>(axis)] = wave.phase[axis] / std::numbers::pi;
    }
    if (stretching == Stretching::dilation) {
        std::sort(q.begin(), q.end(), std::greater<>());
    } else if (q[0] < q[2]) {
        std::swap(q[0], q[2]);
    }
    return q;
}

std::string cause(const Threshold& threshold, Stretching stretching) {
    if (!threshold.reached) {
        return "";
    }
    if (!threshold.has_state) {
        return "no equilibrium";
    }
    if (threshold.wave.is_long) {
        return "long waves";
    }
    const auto q = wave_vector(threshold.wave, stretching);
    return fmt::format("wave ({:.2g} {:.2g} {:.2g})", q[0], q[1], q[2]);
}

std::string stretch(const Threshold& threshold, const char* beyond) {
    return threshold.reached ? fmt::format("{:.4f}", threshold.stretch)
                             : fmt::format("{}{}", beyond, threshold.stretch);
}

nlohmann::ordered_json threshold_json(const Threshold& threshold, Stretching stretching) {
    nlohmann::ordered_json json = {{"stretch", threshold.stretch}, {"reached", threshold.reached}};
    if (threshold.reached) {
        json["cause"] = cause(threshold, stretching);
    }
    if (threshold.reached && threshold.has_state && !threshold.wave.is_long) {
        json["wave_vector"] = wave_vector(threshold.wave, stretching);
    }
    return json;
}

} // namespace

void print_map(const std::vector<MapRow>& rows, std::ostream& out) {
    out << "The infinite lattice under homogeneous stretch: where no plane wave grows. Wave vectors in pi/h.\n"
           "bar: stretched along y, sides free; confined: sides held; dilation: all three alike.\n\n";
    out << fmt::format("{:<13}{:>7}{:>6}  {:<9} {:>9} {:>9}  {:<22}{:<22}\n", "volume energy", "nu", "A", "loading",
                       "from", "to", "lost below by", "lost above by");
    for (const MapRow& row : rows) {
        for (std::size_t l = 0; l < kStretchings.size(); ++l) {
            const StableRange& range = row.ranges[l];
            const std::string line =
                fmt::format("{:<13}{:>7g}{:>6g}  {:<9} {:>9} {:>9}  {:<22}{}", name(row.material.volume_energy),
                            row.material.poisson_ratio, row.material.face_diagonal_ratio, name(kStretchings[l]),
                            stretch(range.low, "<"), stretch(range.high, ">"), cause(range.low, kStretchings[l]),
                            cause(range.high, kStretchings[l]));
            out << line.substr(0, line.find_last_not_of(' ') + 1) << '\n';
        }
    }
}

nlohmann::ordered_json map_json(const std::vector<MapRow>& rows) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const MapRow& row : rows) {
        for (std::size_t l = 0; l < kStretchings.size(); ++l) {
            all.push_back({{"volume_energy", name(row.material.volume_energy)},
                           {"poisson_ratio", row.material.poisson_ratio},
                           {"face_diagonal_ratio", row.material.face_diagonal_ratio},
                           {"loading", name(kStretchings[l])},
                           {"low", threshold_json(row.ranges[l].low, kStretchings[l])},
                           {"high", threshold_json(row.ranges[l].high, kStretchings[l])}});
        }
    }
    return all;
}

nlohmann::ordered_json sheets_json(const std::vector<MapSheet>& sheets) {
    const auto limits = [](const std::vector<StableRange>& ranges) {
        nlohmann::ordered_json low = nlohmann::ordered_json::array(), high = low;
        for (const StableRange& range : ranges) {
            low.push_back(range.low.reached ? nlohmann::ordered_json(range.low.stretch) : nlohmann::ordered_json());
            high.push_back(range.high.reached ? nlohmann::ordered_json(range.high.stretch) : nlohmann::ordered_json());
        }
        return nlohmann::ordered_json{{"low", low}, {"high", high}};
    };
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const MapSheet& sheet : sheets) {
        all.push_back({{"face_diagonal_ratio", sheet.face_diagonal_ratio},
                       {"loading", name(sheet.stretching)},
                       {"poisson_ratios", sheet.poisson_ratios},
                       {"stretches", sheet.stretches},
                       {"relative_stiffness", sheet.relative_stiffness}, // NaN becomes null
                       {"limits", limits(sheet.ranges)},
                       {"quadratic_limits", limits(sheet.quadratic_ranges)}});
    }
    return all;
}

} // namespace hybmss::stability
