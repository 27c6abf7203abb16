#include "solvers/newton/preconditioner_choice.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {

bool multigrid_pays(const Lattice& lattice, const Material& material, double reach) {
    const auto [shortest, longest] = std::minmax({lattice.cells()[0], lattice.cells()[1], lattice.cells()[2]});
    const double filled = static_cast<double>(lattice.cell_count());
    const double box = static_cast<double>(lattice.cell_scales().size());
    if (filled == 0) {
        return false;
    }
    const bool volume = resolved_volume_energy(material) != VolumeEnergy::none;
    const double stiff = volume ? std::max(volume_modulus(material) / shear_modulus(material), 0.0) : 0.0;
    const double length = static_cast<double>(longest) * longest / shortest;
    const double jacobi = 9.2 * std::min(length * std::pow(1 + stiff, 0.44), reach);
    const double multigrid = (300 + 130 * std::pow(1 + stiff, 0.48)) * box / filled;
    return jacobi > multigrid;
}

} // namespace hybmss
