#pragma once

#include "kernels/arguments.hpp"
#include "layouts/network/network_blocks.hpp"

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

/// Runs of springs and what they refer to (network_blocks.hpp); those from the same low nodes follow each other.
template <class T>
struct SpringRuns {
    const SpringRun* runs;
    const SpringRunShape<T>* shapes;
    const LaneValues<T>* stiffnesses;
};
template <class T>
struct CellRuns {
    const CellRun* runs;
    const CellRunShape<T>* shapes;
    const LaneValues<T>* kappas;
};

/// The kernels for runs [begin, end) of a network whose nodes are packed.
template <class T>
struct RunKernels {
    using Range = std::ptrdiff_t;
    int vector_lanes; ///< of the vectors that the runs must be laid out for
    void (*springs[kAccuracyCount])(const SpringRuns<T>&, const PackedNodes<T>&, Range begin, Range end);
    void (*cells[kVolumeCount])(const CellRuns<T>&, const PackedNodes<T>&, Range begin, Range end); ///< none: null
    double (*spring_energy)(const SpringRuns<T>&, const PackedNodes<T>&, Range begin, Range end);
    double (*cell_energy[kVolumeCount])(const CellRuns<T>&, const PackedNodes<T>&, Range begin,
                                        Range end); ///< none: null
};

/// Layout packed-xyzw: its runs, and its blocks.
template <class T>
using PackedKernels = NetworkKernels<T, SpringBlock<T>, CellBlock<T>>;
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
