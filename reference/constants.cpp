#include "reference/constants.hpp"

namespace hybmss::reference {

// G = E / (2 (1 + nu))
double shear_modulus(double young_modulus, double poisson_ratio) {
    return young_modulus / (2 * (1 + poisson_ratio));
}

// kappa = G (4 nu - 1) / (1 - 2 nu)
double kappa(double young_modulus, double poisson_ratio) {
    return shear_modulus(young_modulus, poisson_ratio) * (4 * poisson_ratio - 1) / (1 - 2 * poisson_ratio);
}

// (5.12)  k_c = 3 G h / (4 + 3 A)
double cube_diagonal_stiffness(double shear_modulus, double ratio, double cell_size) {
    return 3 * shear_modulus * cell_size / (4 + 3 * ratio);
}

// (5.12)  k_f = A k_c
double face_diagonal_stiffness(double shear_modulus, double ratio, double cell_size) {
    return ratio * cube_diagonal_stiffness(shear_modulus, ratio, cell_size);
}

// (5.12)  k_e = G h (8 + 3 A) / (4 + 3 A)
double edge_stiffness(double shear_modulus, double ratio, double cell_size) {
    return shear_modulus * cell_size * (8 + 3 * ratio) / (4 + 3 * ratio);
}

// k_b = 4/3 E h / (1 - nu^2): a bent cell of a plate. Its strain y kappa along x is g_3.X = kappa h^2/4, and the free
//   sides leave 1/2 E/(1 - nu^2) (kappa_x^2 + kappa_z^2 + 2 nu kappa_x kappa_z) h^5/12 of the two curvatures.
// k_t = 4/3 G h: with the shear strains gamma_xy = 4/h^2 (t_1 + t_2) Z and so on, t_i = g_i.X_i, the mean of Z^2 being
//   h^2/12, a cell without a warp of its own has 1/2 k_t ((t_1 + t_2)^2 + (t_2 + t_3)^2 + (t_3 + t_1)^2), which is
//   alpha = beta = 1 in 1/2 k_t [alpha (t_1^2 + t_2^2 + t_3^2) + beta (t_1 + t_2 + t_3)^2].
// A twisted plate has t = tau (1, 1, -1), and that energy is 1/2 k_t 4 tau^2, exact: 3 alpha + beta = 4.
// A twisted square bar of 2 x 2 cells has t = tau (0, 1, -1) in each, and its nodes do not warp, by symmetry. The
// cells'
//   means see 3/4 of its polar moment I, so its stiffness is G I (3/4 + alpha/4), and should be G J, J = 0.84346 I with
//   the warp of the section (Saint-Venant): alpha = 4 J/I - 3.
// k_4 = 4/9 (E + 2G) h: a cell deformed by u = s_x s_y s_z g_4, with s = 2x/h and so on inside, has one stretch, free
//   across, and two shears of the size 2 g_4/h, each with the mean square 1/9.
HourglassStiffness hourglass_stiffness(double young_modulus, double poisson_ratio, double cell_size) {
    constexpr double kTorsionOfTheSquare = 0.14057701495515552; // J / a^4; I / a^4 = 1/6
    constexpr double kAlpha = 4 * 6 * kTorsionOfTheSquare - 3;
    const double g = shear_modulus(young_modulus, poisson_ratio);
    const double bending = 4.0 / 3 * young_modulus * cell_size / (1 - poisson_ratio * poisson_ratio);
    const double twisting = 4.0 / 3 * g * cell_size;
    return {bending, poisson_ratio * bending, kAlpha * twisting, (4 - 3 * kAlpha) * twisting,
            4.0 / 9 * (young_modulus + 2 * g) * cell_size};
}

} // namespace hybmss::reference
