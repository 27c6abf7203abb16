#pragma once

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// What the equilibrium solver takes: iterations of conjugate gradients by mesh, Poisson's ratio and preconditioner,
/// and whole static solves beside the finite element program CalculiX. Cubes of 8^3 to 32^3 cells, and of 64^3 where
/// `choices.large`; `choices.threads` may have one count. Doubles.
Table solver_benchmark(const RowChoices& choices);

} // namespace hybmss::bench
