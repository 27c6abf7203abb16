// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_layer_impl.hpp"
#include "kernels/lattice/lattice_table.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
struct FlatSweep {
    using Kernel = typename LatticeKernels<Scalar<V>>::Layer;
    template <bool face_diagonals, Volume volume, Accuracy accuracy, Finish finish>
    static constexpr Kernel layer = lattice_layer<face_diagonals, volume, accuracy, finish, V>;
    template <bool face_diagonals, Accuracy accuracy, Finish finish>
    static constexpr Kernel top = lattice_top<face_diagonals, accuracy, finish, V>;
    template <bool face_diagonals, Volume volume, bool top>
    static constexpr typename LatticeKernels<Scalar<V>>::Energy energy = lattice_energy<face_diagonals, volume, top, V>;
};

} // namespace

constinit const LatticeKernels<float> HYBMSS_KERNEL_SET::kLatticeFloat =
    lattice_table<FlatSweep<FloatBatch>, FloatBatch>();
constinit const LatticeKernels<double> HYBMSS_KERNEL_SET::kLatticeDouble =
    lattice_table<FlatSweep<DoubleBatch>, DoubleBatch>();

} // namespace hybmss::kernels
