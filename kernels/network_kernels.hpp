#pragma once

#include "kernels/arguments.hpp"
#include "layouts/network_blocks.hpp"

namespace hybmss::kernels {

/// The kernels of a network whose nodes are packed, for springs and cells given as arrays of Springs and Cells (blocks
/// of sixteen, or single ones), entries [begin, end).
template <class T, class Springs, class Cells>
struct NetworkKernels {
    using Range = std::ptrdiff_t;
    void (*springs[kAccuracyCount])(const Springs*, const PackedNodes<T>&, Range begin, Range end);
    void (*cells[kVolumeCount])(const Cells*, const PackedNodes<T>&, Range begin, Range end); ///< none: null
    double (*spring_energy)(const Springs*, const PackedNodes<T>&, Range begin, Range end);
    double (*cell_energy[kVolumeCount])(const Cells*, const PackedNodes<T>&, Range begin, Range end); ///< none: null
    /// Nodes [begin, end), multiples of four: integrates them and zeroes their forces for the next step; [driven].
    void (*integrate[2])(const PackedNodes<T>&, const StepConstants<T>&, Range begin, Range end);
};

/// Layout packed-xyzw.
template <class T>
using PackedKernels = NetworkKernels<T, SpringBlock<T>, CellBlock<T>>;
/// Layout aos.
template <class T>
using RecordKernels = NetworkKernels<T, SpringRecord<T>, CellRecord<T>>;

/// The kernels of a network as structure of arrays, layout coloured-soa; springs, cells or nodes [begin, end).
template <class T>
struct SoaKernels {
    using Range = std::ptrdiff_t;
    void (*springs[kAccuracyCount])(const NetworkSprings<T>&, const NodeArrays<T>&, Range begin, Range end);
    void (*cells[kVolumeCount])(const NetworkCells<T>&, const NodeArrays<T>&, Range begin, Range end); ///< none: null
    double (*spring_energy)(const NetworkSprings<T>&, const NodeArrays<T>&, Range begin, Range end);
    double (*cell_energy[kVolumeCount])(const NetworkCells<T>&, const NodeArrays<T>&, Range begin,
                                        Range end);                                              ///< none: null
    void (*integrate[2])(const NodeArrays<T>&, const StepConstants<T>&, Range begin, Range end); ///< [driven]
};

} // namespace hybmss::kernels
