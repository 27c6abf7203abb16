#include "studies/stability/stability_map.hpp"

#include "hybmss/material.hpp"

#include <cmath>
#include <limits>

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

Material map_material(double poisson_ratio, double face_diagonal_ratio, VolumeEnergy volume_energy) {
    Material material;
    material.poisson_ratio = poisson_ratio;
    material.face_diagonal_ratio = face_diagonal_ratio;
    material.volume_energy = volume_energy;
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

std::vector<MapRow> stability_map(const std::function<void(double)>& progress) {
    constexpr std::array kEnergies = {VolumeEnergy::mean_stretch, VolumeEnergy::quadratic};
    constexpr double kCount = static_cast<double>(kEnergies.size() * kPoissonRatios.size() *
                                                  kFaceDiagonalRatios.size() * kStretchings.size());
    std::vector<MapRow> rows;
    double done = 0;
    for (const VolumeEnergy energy : kEnergies) {
        for (const double nu : kPoissonRatios) {
            for (const double ratio : kFaceDiagonalRatios) {
                MapRow& row = rows.emplace_back();
                row.material = map_material(nu, ratio, energy);
                for (std::size_t l = 0; l < kStretchings.size(); ++l) {
                    row.ranges[l] = stable_range(row.material, kStretchings[l]);
                    progress(++done / kCount);
                }
            }
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
    constexpr double kCount = static_cast<double>(kFaceDiagonalRatios.size() * kStretchings.size()) * kRatios;
    std::vector<MapSheet> sheets;
    double done = 0;
    for (const Stretching stretching : kStretchings) {
        for (const double ratio : kFaceDiagonalRatios) {
            MapSheet& sheet = sheets.emplace_back();
            sheet = {ratio, stretching, ratios, all_stretches, {}, {}, {}};
            for (const double nu : ratios) {
                const Material material = map_material(nu, ratio, VolumeEnergy::automatic);
                for (const double stretch : all_stretches) {
                    const auto wave = weakest_wave_at(material, stretching, stretch);
                    sheet.relative_stiffness.push_back(wave ? wave->relative_stiffness
                                                            : std::numeric_limits<double>::quiet_NaN());
                }
                sheet.ranges.push_back(stable_range(material, stretching));
                sheet.quadratic_ranges.push_back(
                    stable_range(map_material(nu, ratio, VolumeEnergy::quadratic), stretching));
                progress(++done / kCount);
            }
        }
    }
    return sheets;
}

} // namespace hybmss::stability
