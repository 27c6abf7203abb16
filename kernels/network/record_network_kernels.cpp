// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/network/network_records_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
constexpr RecordKernels<Scalar<V>> record_kernels() {
    return {{record_springs<V>, record_springs<V>, record_springs<V>},
            {nullptr, record_cells<Volume::quadratic, V>, record_cells<Volume::mean_stretch, V>},
            record_spring_energy<V>,
            {nullptr, record_cell_energy<Volume::quadratic, V>, record_cell_energy<Volume::mean_stretch, V>},
            {record_integrate<false, V>, record_integrate<true, V>}};
}

} // namespace

constinit const RecordKernels<float> HYBMSS_KERNEL_SET::kRecordsFloat = record_kernels<FloatBatch>();
constinit const RecordKernels<double> HYBMSS_KERNEL_SET::kRecordsDouble = record_kernels<DoubleBatch>();

} // namespace hybmss::kernels
