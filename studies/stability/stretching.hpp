#pragma once

/// \file
/// The homogeneous deformations that the stability map asks about.

#include "hybmss/material.hpp"
#include "reference/body.hpp"

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

} // namespace hybmss::stability
