// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/active_rows_impl.hpp"
#include "kernels/lattice/lattice_table.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
struct ActiveSweep {
    using Kernel = typename LatticeKernels<Scalar<V>>::Layer;
    template <bool face_diagonals, Volume volume, Accuracy accuracy, Finish finish>
    static constexpr Kernel layer = active_layer<face_diagonals, volume, accuracy, finish, V>;
    template <bool face_diagonals, Accuracy accuracy, Finish finish>
    static constexpr Kernel top = active_top<face_diagonals, accuracy, finish, V>;
    template <bool face_diagonals, Volume volume, bool top>
    static constexpr typename LatticeKernels<Scalar<V>>::Energy energy = active_energy<face_diagonals, volume, top, V>;
};

} // namespace

constinit const LatticeKernels<float> HYBMSS_KERNEL_SET::kActiveFloat =
    lattice_table<ActiveSweep<FloatBatch>, FloatBatch>();
constinit const LatticeKernels<double> HYBMSS_KERNEL_SET::kActiveDouble =
    lattice_table<ActiveSweep<DoubleBatch>, DoubleBatch>();

} // namespace hybmss::kernels
