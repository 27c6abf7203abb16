#pragma once

/// \file
/// What the equilibrium solver takes: iterations of conjugate gradients by mesh, Poisson's ratio and preconditioner,
/// and whole static solves beside the finite element program CalculiX.

#include "bench/row.hpp"

#include <vector>

namespace hybmss::bench {

/// Cubes of 8^3 to 32^3 cells, and of 64^3 where `large`. Doubles.
std::vector<Row> solver_benchmark(bool large, int threads);

extern const char* const kSolverIntroduction;

} // namespace hybmss::bench
