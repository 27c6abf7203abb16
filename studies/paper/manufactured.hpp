#pragma once

/// \file
/// A smooth problem whose solution is known: how fast the lattice's error falls with the cell size.

#include "hybmss/material.hpp"

#include <vector>

namespace hybmss::paper {

/// The lattice's error on a unit cube of cells^3, relative to the solution's own norm.
struct ConvergenceStep {
    int cells = 0;
    double displacement = 0; ///< L2: over the nodes
    double gradient = 0;     ///< H1 seminorm: cell gradients against those in the cells' centres
};

/// Small plane waves u = sum of A sin(k.x + phi), prescribed on the whole boundary, held inside by the body force
///   b = -(lambda + G) grad div u - G lap u,   each wave: ((lambda + G) k (A.k) + G |k|^2 A) sin(k.x + phi).
/// Every node gets b h^3. Throws std::runtime_error where a solve fails.
std::vector<ConvergenceStep> manufactured_convergence(const Material& material, const std::vector<int>& cells);

/// log(e1 / e2) / log(n2 / n1) of two errors.
double observed_order(double coarse_error, int coarse, double fine_error, int fine);

} // namespace hybmss::paper
