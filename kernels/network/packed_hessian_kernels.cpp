// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/packed_hessian_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr PackedHessianKernels<Scalar<V>> packed_hessian_kernels() {
    return {{packed_spring_product<Accuracy::accurate, V>, packed_spring_product<Accuracy::exact, V>},
            {nullptr, packed_cell_product<Volume::quadratic, V>, packed_cell_product<Volume::mean_stretch, V>},
            {packed_spring_diagonal<Accuracy::accurate, V>, packed_spring_diagonal<Accuracy::exact, V>},
            {nullptr, packed_cell_diagonal<Volume::quadratic, V>, packed_cell_diagonal<Volume::mean_stretch, V>}};
}

} // namespace

constinit const PackedHessianKernels<float> HYBMSS_KERNEL_SET::kPackedHessianFloat =
    packed_hessian_kernels<FloatBatch>();
constinit const PackedHessianKernels<double> HYBMSS_KERNEL_SET::kPackedHessianDouble =
    packed_hessian_kernels<DoubleBatch>();

} // namespace hybmss::kernels
