#pragma once

/// \file
/// Isotropic elasticity by any two of its moduli.

#include "hybmss/export.h"

#include <optional>

namespace hybmss {

/// What is known of an isotropic material: any two.
struct ElasticModuli {
    std::optional<double> young_modulus = {}; ///< E, Pa
    std::optional<double> poisson_ratio = {}; ///< nu
    std::optional<double> shear_modulus = {}; ///< G, Pa
    std::optional<double> bulk_modulus = {};  ///< K, Pa
    std::optional<double> lame_modulus = {};  ///< Lame's first, lambda = K - 2 G / 3, Pa
};

struct YoungAndPoisson {
    double young_modulus, poisson_ratio;
};

/// E and nu by the two that are given. Throws std::invalid_argument for another count than two, a number that is not
/// finite, and where E comes out not above 0 or nu not inside (-1, 1/2): with both that were given and what they make.
HYBMSS_EXPORT YoungAndPoisson young_and_poisson(const ElasticModuli& known);

} // namespace hybmss
