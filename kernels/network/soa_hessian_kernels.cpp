// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/network_hessian_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr SoaHessianKernels<Scalar<V>> soa_hessian_kernels() {
    return {{network_spring_product<Accuracy::accurate, V>, network_spring_product<Accuracy::exact, V>},
            {nullptr, network_cell_product<Volume::quadratic, V>, network_cell_product<Volume::mean_stretch, V>},
            {network_spring_diagonal<Accuracy::accurate, V>, network_spring_diagonal<Accuracy::exact, V>},
            {nullptr, network_cell_diagonal<Volume::quadratic, V>, network_cell_diagonal<Volume::mean_stretch, V>}};
}

} // namespace

constinit const SoaHessianKernels<float> HYBMSS_KERNEL_SET::kSoaHessianFloat = soa_hessian_kernels<FloatBatch>();
constinit const SoaHessianKernels<double> HYBMSS_KERNEL_SET::kSoaHessianDouble = soa_hessian_kernels<DoubleBatch>();

} // namespace hybmss::kernels
