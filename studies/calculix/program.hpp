#pragma once

/// \file
/// CalculiX run as a program: `ccx`, where it is installed (Debian package calculix-ccx).

#include "studies/calculix/problem.hpp"

#include <string>

namespace hybmss::calculix {

/// Whether a program named ccx is on PATH.
bool is_installed();

/// What to say where it is not.
inline constexpr const char* kNotInstalled = "CalculiX is not installed: no ccx on PATH (Debian package calculix-ccx)";

/// What the program calls its version, e.g. "2.20"; "" where it is not installed.
std::string version();

/// Solves the problem on one thread, in a directory of its own under the system's temporary one, which is removed.
/// Throws std::runtime_error in one line where ccx is not installed or fails.
Solution solve(const Problem& problem);

} // namespace hybmss::calculix
