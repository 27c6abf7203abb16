// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/network_runs_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr RunKernels<Scalar<V>> run_kernels() {
    return {kWidth<V>,
            {run_springs<Accuracy::fast, V>, run_springs<Accuracy::accurate, V>, run_springs<Accuracy::exact, V>},
            {nullptr, run_cells<Volume::quadratic, V>, run_cells<Volume::mean_stretch, V>},
            run_spring_energy<V>,
            {nullptr, run_cell_energy<Volume::quadratic, V>, run_cell_energy<Volume::mean_stretch, V>}};
}

} // namespace

constinit const RunKernels<float> HYBMSS_KERNEL_SET::kRunsFloat = run_kernels<FloatBatch>();
constinit const RunKernels<double> HYBMSS_KERNEL_SET::kRunsDouble = run_kernels<DoubleBatch>();

} // namespace hybmss::kernels
