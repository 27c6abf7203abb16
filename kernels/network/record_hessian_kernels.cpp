// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/record_hessian_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr RecordHessianKernels<Scalar<V>> record_hessian_kernels() {
    return {{record_spring_product<V>, record_spring_product<V>},
            {nullptr, record_cell_product<Volume::quadratic, V>, record_cell_product<Volume::mean_stretch, V>},
            {record_spring_diagonal<V>, record_spring_diagonal<V>},
            {nullptr, record_cell_diagonal<Volume::quadratic, V>, record_cell_diagonal<Volume::mean_stretch, V>}};
}

} // namespace

constinit const RecordHessianKernels<float> HYBMSS_KERNEL_SET::kRecordsHessianFloat =
    record_hessian_kernels<FloatBatch>();
constinit const RecordHessianKernels<double> HYBMSS_KERNEL_SET::kRecordsHessianDouble =
    record_hessian_kernels<DoubleBatch>();

} // namespace hybmss::kernels
