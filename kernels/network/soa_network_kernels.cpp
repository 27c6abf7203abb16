// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/network_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr SoaKernels<Scalar<V>> soa_kernels() {
    return {{network_springs<Accuracy::fast, V>, network_springs<Accuracy::accurate, V>,
             network_springs<Accuracy::exact, V>},
            {nullptr, network_cells<Volume::quadratic, V>, network_cells<Volume::mean_stretch, V>},
            network_spring_energy<V>,
            {nullptr, network_cell_energy<Volume::quadratic, V>, network_cell_energy<Volume::mean_stretch, V>},
            {network_integrate<false, V>, network_integrate<true, V>}};
}

} // namespace

constinit const SoaKernels<float> HYBMSS_KERNEL_SET::kSoaFloat = soa_kernels<FloatBatch>();
constinit const SoaKernels<double> HYBMSS_KERNEL_SET::kSoaDouble = soa_kernels<DoubleBatch>();

} // namespace hybmss::kernels
