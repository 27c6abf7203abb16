// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/run_hessian_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr RunHessianKernels<Scalar<V>> run_hessian_kernels() {
    return {{run_spring_product<Accuracy::accurate, V>, run_spring_product<Accuracy::exact, V>},
            {nullptr, run_cell_product<Volume::quadratic, V>, run_cell_product<Volume::mean_stretch, V>},
            {run_spring_diagonal<Accuracy::accurate, V>, run_spring_diagonal<Accuracy::exact, V>},
            {nullptr, run_cell_diagonal<Volume::quadratic, V>, run_cell_diagonal<Volume::mean_stretch, V>}};
}

} // namespace

constinit const RunHessianKernels<float> HYBMSS_KERNEL_SET::kRunsHessianFloat = run_hessian_kernels<FloatBatch>();
constinit const RunHessianKernels<double> HYBMSS_KERNEL_SET::kRunsHessianDouble = run_hessian_kernels<DoubleBatch>();

} // namespace hybmss::kernels
