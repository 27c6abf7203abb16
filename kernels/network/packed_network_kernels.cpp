// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/network_packed_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr PackedKernels<Scalar<V>> packed_kernels() {
    return {
        {packed_springs<Accuracy::fast, V>, packed_springs<Accuracy::accurate, V>, packed_springs<Accuracy::exact, V>},
        {nullptr, packed_cells<Volume::quadratic, V>, packed_cells<Volume::mean_stretch, V>},
        packed_spring_energy<V>,
        {nullptr, packed_cell_energy<Volume::quadratic, V>, packed_cell_energy<Volume::mean_stretch, V>},
        {packed_integrate<false, V>, packed_integrate<true, V>}};
}

} // namespace

constinit const PackedKernels<float> HYBMSS_KERNEL_SET::kPackedFloat = packed_kernels<FloatBatch>();
constinit const PackedKernels<double> HYBMSS_KERNEL_SET::kPackedDouble = packed_kernels<DoubleBatch>();

} // namespace hybmss::kernels
