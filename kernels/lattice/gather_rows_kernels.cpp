// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/gather_rows_impl.hpp"

namespace hybmss::kernels {
namespace {

template <bool face_diagonals, Accuracy accuracy, class V>
constexpr void set_planes(GatherKernels<Scalar<V>>& table) {
    constexpr int kAccuracy = static_cast<int>(accuracy);
    auto& planes = table.plane[face_diagonals];
    planes[static_cast<int>(Volume::none)][kAccuracy] = gather_plane<face_diagonals, Volume::none, accuracy, V>;
    planes[static_cast<int>(Volume::quadratic)][kAccuracy] =
        gather_plane<face_diagonals, Volume::quadratic, accuracy, V>;
    planes[static_cast<int>(Volume::mean_stretch)][kAccuracy] =
        gather_plane<face_diagonals, Volume::mean_stretch, accuracy, V>;
}

template <class V>
constexpr GatherKernels<Scalar<V>> gather_kernels() {
    GatherKernels<Scalar<V>> table{};
    set_planes<false, Accuracy::fast, V>(table);
    set_planes<false, Accuracy::accurate, V>(table);
    set_planes<false, Accuracy::exact, V>(table);
    set_planes<true, Accuracy::fast, V>(table);
    set_planes<true, Accuracy::accurate, V>(table);
    set_planes<true, Accuracy::exact, V>(table);
    table.integrate[0] = integrate_plane<false, V>;
    table.integrate[1] = integrate_plane<true, V>;
    return table;
}

} // namespace

constinit const GatherKernels<float> HYBMSS_KERNEL_SET::kGatherFloat = gather_kernels<FloatBatch>();
constinit const GatherKernels<double> HYBMSS_KERNEL_SET::kGatherDouble = gather_kernels<DoubleBatch>();

} // namespace hybmss::kernels
