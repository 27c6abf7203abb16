#pragma once

#include "hybmss/force_plan.hpp"
#include "kernels/arguments.hpp"

#include <vector>

namespace hybmss {

/// The layers' energies in J, summed in their order. Stiffness is k h and lengths are u / h, so sums are energies
/// divided by h.
inline PotentialEnergy sum_of_layers(const std::vector<kernels::LayerEnergy>& layers, double cell_size) {
    PotentialEnergy sum;
    for (const kernels::LayerEnergy& layer : layers) {
        sum.springs += cell_size * layer.springs;
        sum.volume += 32 * cell_size * layer.volume;
    }
    return sum;
}

} // namespace hybmss
