#include "studies/stability/stability_map.hpp"

#include "hybmss/material.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hybmss::stability {
namespace {

constexpr double kScanStep = 0.05, kStretchTolerance = 1e-5;

bool stable(const std::optional<Wave>& wave) {
    return wave && wave->relative_stiffness >= -kNeutral;
}

/// From rest towards `end`: the first unstable stretch of a scan, then bisected.
Threshold threshold(const Material& material, Stretching stretching, double end) {
    const double sign = end > 1 ? 1 : -1;
    double good = 1, bad = end;
    // A little beyond rest first: a lattice without face diagonals is lost at once on one side.
    double next = 1 + sign * 1e-4;
    std::optional<Wave> wave;
    for (;;) {
        wave = weakest_wave_at(material, stretching, next);
        if (!stable(wave)) {
            bad = next;
            break;
        }
        good = next;
        if (next == end) {
            return {end, false, true, {}};
        }
        next = sign > 0 ? std::min(next + kScanStep, end) : std::max(next - kScanStep, end);
    }
    while (std::abs(bad - good) > kStretchTolerance) {
        const double middle = (good + bad) / 2;
        const auto there = weakest_wave_at(material, stretching, middle);
        (stable(there) ? good : bad) = middle;
        if (!stable(there)) {
            wave = there;
        }
    }
    // At rest itself every material is stable, or neutral.
    const bool at_rest = std::abs(good - 1) < 1e-4;
    return {at_rest ? 1 : (good + bad) / 2, true, wave.has_value(), wave.value_or(Wave{})};
}

} // namespace

Material map_material(double poisson_ratio, double face_diagonal_ratio, VolumeEnergy volume_energy,
                      SpringForm springs) {
    Material material;
    material.poisson_ratio = poisson_ratio;
    material.face_diagonal_ratio = face_diagonal_ratio;
    material.volume_energy = volume_energy;
    material.springs = springs;
    return material;
}

std::optional<Wave> weakest_wave_at(const Material& material, Stretching stretching, double stretch) {
    const auto diagonal = stretches(material, stretching, stretch);
    if (!diagonal) {
        return std::nullopt;
    }
    return weakest_wave(reference::HomogeneousLattice(material, diagonal->asDiagonal()), shear_modulus(material));
}

StableRange stable_range(const Material& material, Stretching stretching) {
    return {threshold(material, stretching, kLeastStretch), threshold(material, stretching, kGreatestStretch)};
}

std::vector<MapSprings> map_springs() {
    std::vector<MapSprings> all;
    for (const double ratio : kFaceDiagonalRatios) {
        all.push_back({SpringForm::nodes, ratio});
    }
    for (const double ratio : {0.0, 1.0}) {
        all.push_back({SpringForm::means, ratio});
    }
    return all;
}

std::vector<MapRow> stability_map(const std::function<void(double)>& progress) {
    constexpr std::array kEnergies = {VolumeEnergy::mean_stretch, VolumeEnergy::quadratic};
    std::vector<MapRow> rows;
    for (const VolumeEnergy energy : kEnergies) {
        for (const double nu : kPoissonRatios) {
            for (const auto& [form, ratio] : map_springs()) {
                rows.push_back({map_material(nu, ratio, energy, form), {}});
            }
        }
    }
    double done = 0;
    for (MapRow& row : rows) {
        for (std::size_t l = 0; l < kStretchings.size(); ++l) {
            row.ranges[l] = stable_range(row.material, kStretchings[l]);
            progress(++done / static_cast<double>(rows.size() * kStretchings.size()));
        }
    }
    return rows;
}

std::vector<MapSheet> stability_sheets(const std::function<void(double)>& progress) {
    constexpr int kRatios = 30, kStretches = 29;
    std::vector<double> ratios, all_stretches;
    for (int n = 0; n < kRatios; ++n) {
        ratios.push_back(n + 1 < kRatios ? -0.95 + 0.05 * n : 0.499);
    }
    for (int s = 0; s < kStretches; ++s) {
        all_stretches.push_back(0.4 + 0.05 * s);
    }
    const std::vector<MapSprings> lattices = map_springs();
    const double count = static_cast<double>(lattices.size() * kStretchings.size()) * kRatios;
    std::vector<MapSheet> sheets;
    double done = 0;
    for (const Stretching stretching : kStretchings) {
        for (const MapSprings& springs : lattices) {
            const auto material = [&](double nu, VolumeEnergy energy) {
                return map_material(nu, springs.face_diagonal_ratio, energy, springs.form);
            };
            MapSheet& sheet = sheets.emplace_back();
            sheet = {springs, stretching, ratios, all_stretches, {}, {}, {}};
            for (const double nu : ratios) {
                const Material automatic = material(nu, VolumeEnergy::automatic);
                for (const double stretch : all_stretches) {
                    const auto wave = weakest_wave_at(automatic, stretching, stretch);
                    sheet.relative_stiffness.push_back(wave ? wave->relative_stiffness
                                                            : std::numeric_limits<double>::quiet_NaN());
                }
                sheet.ranges.push_back(stable_range(automatic, stretching));
                sheet.quadratic_ranges.push_back(stable_range(material(nu, VolumeEnergy::quadratic), stretching));
                progress(++done / count);
            }
        }
    }
    return sheets;
}

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

std::string_view name(SpringForm form) {
    return form == SpringForm::means ? "means" : "nodes";
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
    out << fmt::format("{:<13} {:<7}{:>7}{:>6}  {:<9} {:>9} {:>9}  {:<22}{:<22}\n", "volume energy", "springs", "nu",
                       "A", "loading", "from", "to", "lost below by", "lost above by");
    for (const MapRow& row : rows) {
        for (std::size_t l = 0; l < kStretchings.size(); ++l) {
            const StableRange& range = row.ranges[l];
            const std::string line =
                fmt::format("{:<13} {:<7}{:>7g}{:>6g}  {:<9} {:>9} {:>9}  {:<22}{}", name(row.material.volume_energy),
                            name(row.material.springs), row.material.poisson_ratio, row.material.face_diagonal_ratio,
                            name(kStretchings[l]), stretch(range.low, "<"), stretch(range.high, ">"),
                            cause(range.low, kStretchings[l]), cause(range.high, kStretchings[l]));
            out << line.substr(0, line.find_last_not_of(' ') + 1) << '\n';
        }
    }
}

nlohmann::ordered_json map_json(const std::vector<MapRow>& rows) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const MapRow& row : rows) {
        for (std::size_t l = 0; l < kStretchings.size(); ++l) {
            all.push_back({{"volume_energy", name(row.material.volume_energy)},
                           {"springs", name(row.material.springs)},
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
        all.push_back({{"springs", name(sheet.springs.form)},
                       {"face_diagonal_ratio", sheet.springs.face_diagonal_ratio},
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
