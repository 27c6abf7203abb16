// Compiled once for each instruction set.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {
namespace {

/// Finishes a plane of nodes whose force is the sum of `partial` and `above` (two slabs meet there).
template <class V>
void lattice_join(const LatticeLayer<Scalar<V>>& layer) {
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        finish_nodes(layer, n, load_force<V>(layer.partial, n) + load_force<V>(layer.above, n));
    }
}

} // namespace

HYBMSS_DEFINE_KERNEL(lattice_layer);
HYBMSS_DEFINE_KERNEL(lattice_top);
HYBMSS_DEFINE_KERNEL(lattice_join);
HYBMSS_DEFINE_ORDERED_KERNEL(lattice_energy);
HYBMSS_DEFINE_ORDERED_KERNEL(lattice_top_energy);

} // namespace hybmss::kernels
