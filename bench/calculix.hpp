#pragma once

/// \file
/// CalculiX as a yardstick for static solves: the finite element program `ccx`, where it is installed.

#include <optional>

namespace hybmss::bench {

struct CalculixRun {
    double seconds = 0; ///< of the whole program
    double force = 0;   ///< N, the largest component of what the moved plate exerts
    int iterations = 0; ///< of Newton's method
};

/// Whether a program named ccx is on PATH.
bool has_calculix();

/// A cube of `edge`^3 elements C3D8I with edges of `cell_size`, E = 10 kPa, between two clamped plates that are brought
/// together by `strain` of the height: *STATIC with NLGEOM, its default stepping, one thread. Nothing where the run
/// fails. Works in a directory of its own under the system's temporary one, and removes it.
std::optional<CalculixRun> compress_with_calculix(int edge, double cell_size, double poisson_ratio, double strain);

} // namespace hybmss::bench
