#pragma once

// One table of kernels for each instruction set and precision; a plan takes its kernels from it once.

#include "hybmss/instruction_set.hpp"
#include "kernels/arguments.hpp"
#include "kernels/network_kernels.hpp"

namespace hybmss::kernels {

template <class T>
struct KernelTable {
    using Layer = void (*)(const LatticeLayer<T>&);
    using Energy = LayerEnergy (*)(const LatticeLayer<T>&);

    InstructionSet instruction_set;
    int width; ///< lanes of a vector of T

    Layer layer[2][kVolumeCount][kAccuracyCount][kFinishCount]; ///< [face diagonals][volume][accuracy][finish]
    Layer top[2][kAccuracyCount][kFinishCount];
    Layer join[kFinishCount];
    Energy energy[2][kVolumeCount][2]; ///< [face diagonals][volume][top]

    void (*springs[kAccuracyCount])(const NetworkSprings<T>&, const NodeArrays<T>&, std::ptrdiff_t begin,
                                    std::ptrdiff_t end);
    void (*cells[kVolumeCount])(const NetworkCells<T>&, const NodeArrays<T>&, std::ptrdiff_t begin,
                                std::ptrdiff_t end); ///< none: null
    double (*spring_energy)(const NetworkSprings<T>&, const NodeArrays<T>&, std::ptrdiff_t begin, std::ptrdiff_t end);
    double (*cell_energy[kVolumeCount])(const NetworkCells<T>&, const NodeArrays<T>&, std::ptrdiff_t begin,
                                        std::ptrdiff_t end); ///< none: null
    void (*integrate[2])(const NodeArrays<T>&, const StepConstants<T>&, std::ptrdiff_t begin,
                         std::ptrdiff_t end); ///< [driven]

    NetworkKernels<T, SpringBlock<T>, CellBlock<T>> packed;    ///< layout packed-xyzw
    NetworkKernels<T, SpringRecord<T>, CellRecord<T>> records; ///< layout aos
};

/// The table of an available instruction set (not `automatic`).
template <class T>
const KernelTable<T>& kernel_table(InstructionSet set);

// One pair a file isa_*.cpp.
extern const KernelTable<float> kSse2Float, kAvx2Float, kAvx512Float, kNeonFloat;
extern const KernelTable<double> kSse2Double, kAvx2Double, kAvx512Double, kNeonDouble;

} // namespace hybmss::kernels
