#include "studies/paper/beam_theory.hpp"

#include <cmath>

namespace hybmss::paper {

BeamTheory beam_theory(const Experiment& beam) {
    const Scene s = scene(beam);
    const double width = static_cast<double>(s.body.cells[0]) * s.body.cell_size;
    const double length = static_cast<double>(s.body.cells[2]) * s.body.cell_size;
    const double load = s.material.density * std::abs(s.gravity.acceleration[1]); // N/m^3
    const double nu = s.material.poisson_ratio, k = 10 * (1 + nu) / (12 + 11 * nu);
    // A / I = 12 / width^2
    return {load * 12 / (width * width) * std::pow(length, 4) / (8 * s.material.young_modulus),
            load * length * length / (2 * k * shear_modulus(s.material))};
}

} // namespace hybmss::paper
