// Compiled once for each instruction set.
#include "kernels/compiled_set.hpp"
#include "kernels/network/packed_hessian.hpp"

namespace hybmss::kernels {

HYBMSS_DEFINE_KERNEL(packed_spring_product);
HYBMSS_DEFINE_COMMON_KERNEL(packed_cell_product);
HYBMSS_DEFINE_COMMON_KERNEL(packed_spring_diagonal);
HYBMSS_DEFINE_COMMON_KERNEL(packed_cell_diagonal);
HYBMSS_DEFINE_ORDERED_KERNEL(packed_stiffening_energy);

} // namespace hybmss::kernels
