#pragma once

// Fills the table of a layout that sweeps a lattice. `Sweep` names its kernels: layer, top and energy.

#include "kernels/lattice/lattice_kernels.hpp"
#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {
namespace {

template <class Sweep, bool face_diagonals, Accuracy accuracy, Finish finish, class T>
constexpr void set_finish(LatticeKernels<T>& table) {
    constexpr int kAccuracy = static_cast<int>(accuracy), kFinish = static_cast<int>(finish);
    auto& layer = table.layer[face_diagonals];
    layer[static_cast<int>(Volume::none)][kAccuracy][kFinish] =
        Sweep::template layer<face_diagonals, Volume::none, accuracy, finish>;
    layer[static_cast<int>(Volume::quadratic)][kAccuracy][kFinish] =
        Sweep::template layer<face_diagonals, Volume::quadratic, accuracy, finish>;
    layer[static_cast<int>(Volume::mean_stretch)][kAccuracy][kFinish] =
        Sweep::template layer<face_diagonals, Volume::mean_stretch, accuracy, finish>;
    table.top[face_diagonals][kAccuracy][kFinish] = Sweep::template top<face_diagonals, accuracy, finish>;
}

template <class Sweep, bool face_diagonals, Accuracy accuracy, class T>
constexpr void set_accuracy(LatticeKernels<T>& table) {
    set_finish<Sweep, face_diagonals, accuracy, Finish::store>(table);
    set_finish<Sweep, face_diagonals, accuracy, Finish::integrate>(table);
    set_finish<Sweep, face_diagonals, accuracy, Finish::integrate_driven>(table);
}

template <class Sweep, bool face_diagonals, Volume volume, class T>
constexpr void set_energy(LatticeKernels<T>& table) {
    auto& row = table.energy[face_diagonals][static_cast<int>(volume)];
    row[0] = Sweep::template energy<face_diagonals, volume, false>;
    row[1] = Sweep::template energy<face_diagonals, volume, true>;
}

template <class Sweep, bool face_diagonals, class T>
constexpr void set_lattice(LatticeKernels<T>& table) {
    set_accuracy<Sweep, face_diagonals, Accuracy::fast>(table);
    set_accuracy<Sweep, face_diagonals, Accuracy::accurate>(table);
    set_accuracy<Sweep, face_diagonals, Accuracy::exact>(table);
    set_energy<Sweep, face_diagonals, Volume::none>(table);
    set_energy<Sweep, face_diagonals, Volume::quadratic>(table);
    set_energy<Sweep, face_diagonals, Volume::mean_stretch>(table);
}

template <class Sweep, class V>
constexpr LatticeKernels<Scalar<V>> lattice_table() {
    LatticeKernels<Scalar<V>> table{};
    set_lattice<Sweep, false>(table);
    set_lattice<Sweep, true>(table);
    table.join[static_cast<int>(Finish::store)] = lattice_join<Finish::store, V>;
    table.join[static_cast<int>(Finish::integrate)] = lattice_join<Finish::integrate, V>;
    table.join[static_cast<int>(Finish::integrate_driven)] = lattice_join<Finish::integrate_driven, V>;
    table.integrate[false] = integrate_plane<false, V>;
    table.integrate[true] = integrate_plane<true, V>;
    table.width = kWidth<V>;
    return table;
}

} // namespace
} // namespace hybmss::kernels
