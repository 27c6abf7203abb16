#pragma once

namespace hybmss {

/// The exponent lambda with which the displacement leaves a clamped edge where a free surface meets it at a right
/// angle, u ~ r^lambda, the smallest root in (0, 1] of
///   (3 - 4 nu) sin^2(lambda pi / 2) = 4 (1 - nu)^2 - lambda^2
/// (Williams 1952, plane strain). Errors of functionals and of L2 fall with h^(2 lambda), of H1 with h^lambda, where no
/// other order is below.
double clamped_edge_exponent(double poisson_ratio);

} // namespace hybmss
