#pragma once

// The one list of kernels: fills a table for a batch type. Included by the isa_*.cpp files alone.

#include "kernels/kernel_table.hpp"
#include "kernels/lattice_layer_impl.hpp"
#include "kernels/network_impl.hpp"
#include "kernels/network_packed_impl.hpp"
#include "kernels/network_records_impl.hpp"

namespace hybmss::kernels {
namespace {

template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
constexpr void set_layers(KernelTable<Scalar<V>>& table) {
    auto& row = table.layer[face_diagonals][static_cast<int>(volume)][static_cast<int>(accuracy)];
    row[static_cast<int>(Finish::store)] = lattice_layer<face_diagonals, volume, accuracy, Finish::store, V>;
    row[static_cast<int>(Finish::integrate)] = lattice_layer<face_diagonals, volume, accuracy, Finish::integrate, V>;
    row[static_cast<int>(Finish::integrate_driven)] =
        lattice_layer<face_diagonals, volume, accuracy, Finish::integrate_driven, V>;
}

template <bool face_diagonals, Accuracy accuracy, class V>
constexpr void set_accuracy(KernelTable<Scalar<V>>& table) {
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
constexpr void set_energy(KernelTable<Scalar<V>>& table) {
    auto& row = table.energy[face_diagonals][static_cast<int>(volume)];
    row[0] = lattice_energy<face_diagonals, volume, false, V>;
    row[1] = lattice_energy<face_diagonals, volume, true, V>;
}

template <bool face_diagonals, class V>
constexpr void set_lattice(KernelTable<Scalar<V>>& table) {
    set_accuracy<face_diagonals, Accuracy::fast, V>(table);
    set_accuracy<face_diagonals, Accuracy::exact, V>(table);
    set_energy<face_diagonals, Volume::none, V>(table);
    set_energy<face_diagonals, Volume::quadratic, V>(table);
    set_energy<face_diagonals, Volume::mean_stretch, V>(table);
}

template <class V>
constexpr KernelTable<Scalar<V>> make_table(InstructionSet set) {
    KernelTable<Scalar<V>> table{};
    table.instruction_set = set;
    table.width = kWidth<V>;
    set_lattice<false, V>(table);
    set_lattice<true, V>(table);
    table.join[static_cast<int>(Finish::store)] = lattice_join<Finish::store, V>;
    table.join[static_cast<int>(Finish::integrate)] = lattice_join<Finish::integrate, V>;
    table.join[static_cast<int>(Finish::integrate_driven)] = lattice_join<Finish::integrate_driven, V>;
    table.springs[static_cast<int>(Accuracy::fast)] = network_springs<Accuracy::fast, V>;
    table.springs[static_cast<int>(Accuracy::exact)] = network_springs<Accuracy::exact, V>;
    table.cells[static_cast<int>(Volume::quadratic)] = network_cells<Volume::quadratic, V>;
    table.cells[static_cast<int>(Volume::mean_stretch)] = network_cells<Volume::mean_stretch, V>;
    table.spring_energy = network_spring_energy<V>;
    table.cell_energy[static_cast<int>(Volume::quadratic)] = network_cell_energy<Volume::quadratic, V>;
    table.cell_energy[static_cast<int>(Volume::mean_stretch)] = network_cell_energy<Volume::mean_stretch, V>;
    table.integrate[0] = network_integrate<false, V>;
    table.integrate[1] = network_integrate<true, V>;
    table.packed = packed_kernels<V>();
    table.records = record_kernels<V>();
    return table;
}

} // namespace
} // namespace hybmss::kernels
