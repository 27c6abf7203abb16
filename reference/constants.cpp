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

} // namespace hybmss::reference
