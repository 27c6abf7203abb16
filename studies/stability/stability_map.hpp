#pragma once

/// \file
/// Which plane wave a homogeneously deformed lattice resists least; and where the lattice is stable, over Poisson's
/// ratio, form of springs, A and stretch, as a table and as JSON.

#include "hybmss/material.hpp"
#include "reference/body.hpp"
#include "reference/homogeneous_lattice.hpp"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <functional>
#include <optional>
#include <ostream>
#include <string_view>
#include <vector>

namespace hybmss::stability {

enum class Stretching {
    bar,      ///< stretched along y, the sides free: no stress along x and z
    confined, ///< stretched along y, the sides held
    dilation  ///< stretched alike along x, y and z
};
inline constexpr std::array kStretchings = {Stretching::bar, Stretching::confined, Stretching::dilation};

std::string_view name(Stretching stretching);

/// The diagonal of F. For `bar` the sides are followed from rest in small steps of the stretch: the result is empty
/// from where on no homogeneous state that is a minimum over the two side stretches continues them.
std::optional<reference::Vector3d> stretches(const Material& material, Stretching stretching, double stretch);

/// A wave's relative stiffness is its eigenvalue of D(q) over G h sum_e 4 sin^2(q_e h / 2): the same sum is what a
/// plain grid of stiffness G gives every wave, so long and short waves count alike, and at rest a long transverse wave
/// has 1. rho h^3 omega^2 is the eigenvalue itself, so the sign is that of omega^2: below zero the wave grows.
struct Wave {
    double relative_stiffness = 0;
    reference::Vector3d phase = reference::Vector3d::Zero(); ///< q h in radians; a direction where `is_long`
    bool is_long = false;                                    ///< the limit q -> 0, by the acoustic tensor
};

/// The least over the Brillouin zone: a grid of wave vectors and, apart from it, the long waves, each refined until the
/// phase is known to 1e-4. The deformation must be diagonal: one octant of the zone then stands for all.
Wave weakest_wave(const reference::HomogeneousLattice& lattice, double shear_modulus);

// ---- the map

/// The stretches that the map spans.
inline constexpr double kLeastStretch = 0.3, kGreatestStretch = 2.5;

/// The Poisson's ratios and ratios A that the hard-case suite and the map ask about.
inline constexpr std::array kPoissonRatios = {-0.9, -0.5, 0.0, 0.25, 0.4, 0.49, 0.499, 0.4999};
inline constexpr std::array kFaceDiagonalRatios = {0.0, 0.1, 1.0, 10.0};

/// The lattices that the map asks about: springs between nodes by every A, on means by the one without face diagonals
/// and the paper's.
struct MapSprings {
    SpringForm form;
    double face_diagonal_ratio;
};
std::vector<MapSprings> map_springs();

/// Stiffnesses are relative to G (see Wave); those this near to zero are rounding, and count as neutral, not unstable.
inline constexpr double kNeutral = 1e-9;

Material map_material(double poisson_ratio, double face_diagonal_ratio, VolumeEnergy volume_energy,
                      SpringForm springs = SpringForm::nodes);

/// One state: empty where the loading has no homogeneous state.
std::optional<Wave> weakest_wave_at(const Material& material, Stretching stretching, double stretch);

/// One end of the range of stable stretches around rest.
struct Threshold {
    double stretch = 1;    ///< to 1e-4; the map's end where nothing is lost
    bool reached = false;  ///< false: stable up to the map's end
    bool has_state = true; ///< false: beyond, the loading has no homogeneous state
    Wave wave;             ///< the first to grow, where there is a state
};
struct StableRange {
    Threshold low, high;
};
StableRange stable_range(const Material& material, Stretching stretching);

/// One material's ranges, in the order of kStretchings.
struct MapRow {
    Material material;
    std::array<StableRange, kStretchings.size()> ranges;
};

/// Rows for every nu, lattice and both volume energies. `progress` gets the share done.
std::vector<MapRow> stability_map(const std::function<void(double)>& progress);

/// The values of one panel of the picture.
struct MapSheet {
    MapSprings springs;
    Stretching stretching;
    std::vector<double> poisson_ratios, stretches;
    /// Of the weakest wave, with the automatic volume energy, stretches fastest; NaN where the loading has no state.
    std::vector<double> relative_stiffness;
    /// The stable range at each Poisson's ratio; that of the quadratic energy too.
    std::vector<StableRange> ranges, quadratic_ranges;
};
std::vector<MapSheet> stability_sheets(const std::function<void(double)>& progress);

/// One line a material and loading: from which stretch to which the homogeneous lattice is stable, and what ends it.
void print_map(const std::vector<MapRow>& rows, std::ostream& out);

nlohmann::ordered_json map_json(const std::vector<MapRow>& rows);
nlohmann::ordered_json sheets_json(const std::vector<MapSheet>& sheets);

} // namespace hybmss::stability
