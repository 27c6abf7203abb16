#pragma once

/// \file
/// How many vector operations a kernel of the lattice step needs, counted by running it on values that count.

#include "bench/bench_row.hpp"

namespace hybmss::bench {

/// Operations on one vector of cells; or on one cell, where divided by the width.
struct OperationCount {
    double multiplications = 0; ///< fused multiply-adds among them
    double additions = 0;
    double others = 0; ///< shuffles, maxima, comparisons, integer operations
    double estimates = 0;
    double square_roots = 0;
    double divisions = 0;
    double loads = 0;
    double stores = 0;

    /// Vector-arithmetic issue slots.
    double slots() const { return multiplications + additions + others + estimates + square_roots + divisions; }
};

struct KernelCount {
    OperationCount vector; ///< one vector of cells, in the inner loop
    int width;             ///< cells in it
    int arrays_read;       ///< arrays of the body that the kernel reads and does not write; one value a node each
    int planes_read;       ///< arrays of stiffness: the planes of a box share them, and find them in cache
    int arrays_updated;    ///< arrays of the body that it reads and writes
};

/// Counts the layer kernel with damping (that is what the benchmarks step with) for the row's model, instruction set,
/// precision and accuracy, at flat rows.
KernelCount count_operations(const BenchRow& row);

} // namespace hybmss::bench
