#pragma once

/// \file
/// Everything that is measured, each by one function that makes its rows. A row takes about `choices.seconds`; two
/// things that are compared are timed in turns, a slice each in every round.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

// What the program measures: step/, effects/.

/// The explicit step of every row of step_rows() against the scalar yardstick. A state that is not finite at the end
/// ends the row with an error.
Table step_benchmark(const RowChoices& choices);
/// What a digit costs: the error of the forces against the scalar reference beside a step's time, for every precision
/// and level of accuracy.
Table accuracy_benchmark(const RowChoices& choices);
/// A cube of 20^3 cells. First a row for the step with all its seams for effects and none of them called for, against
/// the sweep of the cells alone, and one for a body whose numbers are denormal; then one for each effect of
/// simulation/run/effect_list.hpp that can be called for, against the body without it.
Table effects_benchmark(const RowChoices& choices);
/// The largest cubes of soft tissue that frames of 1/60 s and 1/1000 s hold, in contact with a plane and dragged by a
/// node; 600 frames each, 60 where `quick`.
Table realtime_benchmark(const RowChoices& choices);

// What the studies measure.

/// What the machine can do, and how much of it the lattice step takes. For each instruction set: issue rates
/// (limits/issue/...), bandwidths (limits/bandwidth/...), and the step of every model against both (limits/step/...).
Table limits_benchmark(const RowChoices& choices);
/// Springs by displacements and positions, by estimated and exact roots: "digits/avx512/float/displacement/refined" and
/// so on, each in turns with the form that the library uses.
Table digit_benchmark(const RowChoices& choices);
/// Full HybMSS on cubes of 10^3 to 128^3 cells, and of 256^3 in float where `large`, against one thread, 32^3 cells and
/// (up to these; on larger ones a few steps of it would take longer than all the rest) the yardstick.
Table scaling_benchmark(const RowChoices& choices);
/// 64 equal cubes of 4^3 to 14^3 cells in a Batch, ten steps a call, against one after the other on one thread.
Table batch_benchmark(const RowChoices& choices);
/// Cubes at rest on each other in a World, against the same without contact to each other.
Table pile_benchmark(const RowChoices& choices);
/// Bytes of a full box of 32^3 cells and a hollow ball in 64^3, in every layout. Nothing is timed.
Table memory_table(const RowChoices& choices);
/// Pairs of bodies that say together what neither says alone: models against their share of operations, random against
/// ordered numbering, large grids hardly filled.
Table ratio_benchmark(const RowChoices& choices);
/// The product K(u) p over the body's own arrays, as a solver calls it, against the step and the yardstick's product.
Table hessian_benchmark(const RowChoices& choices);
/// Cells removed from moving cubes of 16^3, 64^3 and 128^3 cells, 8, 64 and 512 at a time.
Table cutting_benchmark(const RowChoices& choices);
/// What embedding costs: a call in C against the same in C++, interleaved memory and a map against separate arrays, and
/// a body in an allocator's whole pages.
Table embedding_benchmark(const RowChoices& choices);

} // namespace hybmss::bench
