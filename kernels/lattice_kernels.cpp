// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/lattice_layer_impl.hpp"

namespace hybmss::kernels {
namespace {

template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
constexpr void set_layers(LatticeKernels<Scalar<V>>& table) {
    auto& row = table.layer[face_diagonals][static_cast<int>(volume)][static_cast<int>(accuracy)];
    row[static_cast<int>(Finish::store)] = lattice_layer<face_diagonals, volume, accuracy, Finish::store, V>;
    row[static_cast<int>(Finish::integrate)] = lattice_layer<face_diagonals, volume, accuracy, Finish::integrate, V>;
    row[static_cast<int>(Finish::integrate_driven)] =
        lattice_layer<face_diagonals, volume, accuracy, Finish::integrate_driven, V>;
}

template <bool face_diagonals, Accuracy accuracy, class V>
constexpr void set_accuracy(LatticeKernels<Scalar<V>>& table) {
    set_layers<face_diagonals, Volume::none, accuracy, V>(table);
    set_layers<face_diagonals, Volume::quadratic, accuracy, V>(table);
    set_layers<face_diagonals, Volume::mean_stretch, accuracy, V>(table);
    auto& top = table.top[face_diagonals][static_cast<int>(accuracy)];
    top[static_cast<int>(Finish::store)] = lattice_top<face_diagonals, accuracy, Finish::store, V>;
    top[static_cast<int>(Finish::integrate)] = lattice_top<face_diagonals, accuracy, Finish::integrate, V>;
    top[static_cast<int>(Finish::integrate_driven)] =
        lattice_top<face_diagonals, accuracy, Finish::integrate_driven, V>;
}

template <bool face_diagonals, Volume volume, class V>
constexpr void set_energy(LatticeKernels<Scalar<V>>& table) {
    auto& row = table.energy[face_diagonals][static_cast<int>(volume)];
    row[0] = lattice_energy<face_diagonals, volume, false, V>;
    row[1] = lattice_energy<face_diagonals, volume, true, V>;
}

template <bool face_diagonals, class V>
constexpr void set_lattice(LatticeKernels<Scalar<V>>& table) {
    set_accuracy<face_diagonals, Accuracy::fast, V>(table);
    set_accuracy<face_diagonals, Accuracy::exact, V>(table);
    set_energy<face_diagonals, Volume::none, V>(table);
    set_energy<face_diagonals, Volume::quadratic, V>(table);
    set_energy<face_diagonals, Volume::mean_stretch, V>(table);
}

template <class V>
constexpr LatticeKernels<Scalar<V>> lattice_kernels() {
    LatticeKernels<Scalar<V>> table{};
    set_lattice<false, V>(table);
    set_lattice<true, V>(table);
    table.join[static_cast<int>(Finish::store)] = lattice_join<Finish::store, V>;
    table.join[static_cast<int>(Finish::integrate)] = lattice_join<Finish::integrate, V>;
    table.join[static_cast<int>(Finish::integrate_driven)] = lattice_join<Finish::integrate_driven, V>;
    return table;
}

} // namespace

constinit const LatticeKernels<float> HYBMSS_KERNEL_SET::kLatticeFloat = lattice_kernels<FloatBatch>();
constinit const LatticeKernels<double> HYBMSS_KERNEL_SET::kLatticeDouble = lattice_kernels<DoubleBatch>();

} // namespace hybmss::kernels
