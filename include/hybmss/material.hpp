#pragma once

/// \file
/// An isotropic material and the constants that follow from it.

#include "hybmss/export.h"

namespace hybmss {

/// Which function phi(J) of the cell volume ratio J the volume energy kappa V0 phi(J) uses.
enum class VolumeEnergy {
    automatic,    ///< quadratic where kappa >= 0, mean_stretch where kappa < 0
    quadratic,    ///< phi = (J - 1)^2 / 2, the energy of Golec et al. (5.1)
    mean_stretch, ///< phi = 9/2 (cbrt(J) - 1)^2, continued linearly below J = 1/8
    none          ///< springs only (the paper's HybMSS-CF)
};

/// What the springs of a lattice's cells join.
enum class SpringForm {
    nodes, ///< corners: every spring of the paper, a network
    means  ///< the cell's mean vectors a, b, c and their sums; an energy of their own holds the patterns of its corners
           ///< that these do not see (HybMSS-M)
};

/// How springs stiffen as they are stretched or pressed: with the strain e = |d|/l - 1 a spring of stiffness k stores
///
///     k l^2 (e^2/2 + quadratic e^3/3 + cubic e^4/4),  force k l (e + quadratic e^2 + cubic e^3),
///
/// so small strains find the material's moduli, whatever the constants. Allowed is what leaves the energy convex in e
/// for all that e can be, e >= -1: 1 + 2 quadratic e + 3 cubic e^2 >= 0. Then no spring ever gives way as it is pulled,
/// and for nu >= 1/4 or cubic > 0 the energy is bounded below. cubic is at most 1e6. With cubic = 0 that is quadratic
/// in [0, 1/2]; `quadratic` alone tells stretched from pressed springs, `cubic` alone does not.
struct SpringStiffening {
    double quadratic = 0, cubic = 0;
    bool any() const { return quadratic != 0 || cubic != 0; }
    bool operator==(const SpringStiffening&) const = default;
};

/// What `quadratic` may be beside a `cubic` >= 0.
struct StiffeningRange {
    double least, most;
};
HYBMSS_EXPORT StiffeningRange quadratic_stiffening(double cubic);

/// Throws std::invalid_argument that names the value and what is allowed.
HYBMSS_EXPORT void validate(const SpringStiffening& stiffening);

/// The largest slope 1 + 2 quadratic e + 3 cubic e^2 of the force over strains |e| <= `strain`, <= 1: by at most so
/// much are springs within it stiffer than at rest, along themselves and across.
HYBMSS_EXPORT double largest_stiffening(const SpringStiffening& stiffening, double strain);

/// What keeps cells from being crushed: below the volume ratio J0 a cell of the volume V0 stores
///
///     G V0 beta (J0 - J)^3 / (3 J0^2)
///
/// beside its other energies, also where it is turned inside out. Above J0 that is zero, with its first two
/// derivatives. Springs do not tell a cell from its mirror image; this energy does.
struct CrushResistance {
    double stiffness = 0; ///< beta, >= 0, <= 1e6; 0: none
    double ratio = 0.7;   ///< J0, inside (0, 1)
    bool any() const { return stiffness != 0; }
    bool operator==(const CrushResistance&) const = default;
};

/// An isotropic elastic material, SI units.
struct Material {
    double young_modulus = 1e4;       ///< E in Pa, > 0, <= 1e18
    double poisson_ratio = 0.25;      ///< nu, in (-1, 1/2)
    double density = 1000.0;          ///< kg/m^3, > 0, <= 1e12
    double face_diagonal_ratio = 1.0; ///< A = k_f / k_c >= 0, <= 1e6; 0 leaves the face diagonals out (HybMSS-FD)
    VolumeEnergy volume_energy = VolumeEnergy::automatic;
    SpringStiffening stiffening = {}; ///< of all springs
    SpringForm springs = SpringForm::nodes;
    CrushResistance crush = {}; ///< of lattices
    bool operator==(const Material&) const = default;
};

/// The stiffness of each kind of spring in the inside of a lattice, N/m. Golec et al. (5.12).
struct SpringConstants {
    double edge;          ///< k_e; one cell's share is k_e / 4
    double face_diagonal; ///< k_f; one cell's share is k_f / 2
    double cube_diagonal; ///< k_c
};

/// What holds a cell with springs on means against bending and twist, N/m. With the patterns of its corners' positions,
/// s = -1 on a low side, +1 on a high,
///
///     g_1 = 1/8 sum s_y s_z x,  g_2 = 1/8 sum s_x s_z x,  g_3 = 1/8 sum s_x s_y x,  g_4 = 1/8 sum s_x s_y s_z x
///
/// that are zero at rest and in every homogeneous deformation, and p_ia = g_i . a / h, ... the cell stores
///
///     1/2 bending sum over (p_3a, p_1c), (p_3b, p_2c), (p_2a, p_1b) of (p^2 + q^2 + 2 coupling p q)
///     + 1/2 twist (p_1a^2 + p_2b^2 + p_3c^2) + 1/2 joint_twist (p_1a + p_2b + p_3c)^2 + 1/2 fourth |g_4|^2
struct PatternConstants {
    double bending;     ///< 4/3 E h / (1 - nu^2): bars and plates of any thickness bend as they should
    double coupling;    ///< nu
    double twist;       ///< 4/3 G h alpha: a bar of 2 x 2 cells twists as it should
    double joint_twist; ///< 4/3 G h (4 - 3 alpha): so do plates of any thickness
    double fourth;      ///< 4/9 (E + 2 G) h: what a solid stores that is deformed so
};

/// Throws std::invalid_argument that names the value and its allowed range.
HYBMSS_EXPORT void validate(const Material& material);

/// G = E / (2 (1 + nu)), Pa.
HYBMSS_EXPORT double shear_modulus(const Material& material);

/// kappa = G (4 nu - 1) / (1 - 2 nu), Pa: the bulk modulus that the springs lack; zero at nu = 1/4.
HYBMSS_EXPORT double volume_modulus(const Material& material);

/// G beta / J0^2, Pa: of a crushed cell the factor of V0 (J0 - J)^3 / 3. Zero without resistance.
HYBMSS_EXPORT double crush_modulus(const Material& material);

/// (5.12) for cells of the edge `cell_size` in m.
HYBMSS_EXPORT SpringConstants spring_constants(const Material& material, double cell_size);

HYBMSS_EXPORT PatternConstants pattern_constants(const Material& material, double cell_size);

/// What `automatic` means for this material: quadratic, mean_stretch, or none where kappa is zero.
HYBMSS_EXPORT VolumeEnergy resolved_volume_energy(const Material& material);

} // namespace hybmss
