// Compiled once for each instruction set.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {

HYBMSS_DEFINE_KERNEL(active_layer);
HYBMSS_DEFINE_KERNEL(active_top);
HYBMSS_DEFINE_ORDERED_KERNEL(active_energy);
HYBMSS_DEFINE_ORDERED_KERNEL(active_top_energy);

} // namespace hybmss::kernels
