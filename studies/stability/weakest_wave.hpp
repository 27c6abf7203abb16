#pragma once

/// \file
/// Which plane wave a homogeneously deformed lattice resists least, and the deformations that the stability map asks
/// about.

#include "hybmss/material.hpp"
#include "reference/body.hpp"
#include "reference/homogeneous_lattice.hpp"

#include <array>
#include <optional>
#include <string_view>

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

} // namespace hybmss::stability
