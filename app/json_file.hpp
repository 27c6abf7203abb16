#pragma once

/// \file
/// The file behind the commands' --json options.

#include "simulation/results/atomic_file.hpp"

#include <memory>
#include <string>

namespace hybmss {

/// Null for an empty path. Throws std::invalid_argument where the file cannot be written: call it before the work, so
/// that a wrong path is known at once.
std::unique_ptr<AtomicFile> open_json_file(const std::string& path);

} // namespace hybmss
