#pragma once

/// \file
/// What the figures were measured on and with.

#include <string>
#include <utility>
#include <vector>

namespace hybmss::bench {

/// Name and value of each fact, for the context of a benchmark's JSON: CPU model, cores, instruction sets, compiler,
/// build type and version of this library. (Google Benchmark's own `library_build_type` tells of its own build only.)
std::vector<std::pair<std::string, std::string>> machine_description();

/// The same for a person, in one line.
std::string machine_line();

} // namespace hybmss::bench
