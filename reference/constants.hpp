#pragma once

/// \file
/// Elastic moduli and spring constants, from numbers alone: nothing here is shared with the library's own constants.

namespace hybmss::reference {

/// G = E / (2 (1 + nu)), Pa.
double shear_modulus(double young_modulus, double poisson_ratio);

/// kappa = G (4 nu - 1) / (1 - 2 nu), Pa.
double kappa(double young_modulus, double poisson_ratio);

/// (5.12), N/m, in the inside of a lattice of cells with the edge `cell_size`; ratio is A = k_f / k_c.
double edge_stiffness(double shear_modulus, double ratio, double cell_size);
double face_diagonal_stiffness(double shear_modulus, double ratio, double cell_size);
double cube_diagonal_stiffness(double shear_modulus, double ratio, double cell_size);

/// Of one cell of HybMSS-M, N/m: what holds the patterns of its corners that its mean edges do not see
/// (reference/springs.hpp). The same for every ratio A.
struct HourglassStiffness {
    double bending;   ///< k_b
    double coupling;  ///< nu k_b, of the bendings about two axes
    double twisting;  ///< alpha k_t
    double twist_sum; ///< beta k_t
    double fourth;    ///< k_4
};
HourglassStiffness hourglass_stiffness(double young_modulus, double poisson_ratio, double cell_size);

} // namespace hybmss::reference
