#pragma once

#include <filesystem>
#include <string>

namespace hybmss {

/// Throws std::runtime_error, one line without the path, for what is there but is no regular file: a pipe that nobody
/// writes to or an endless device would be read for ever.
void require_regular_file(const std::filesystem::path& path);

/// All its bytes. Throws std::runtime_error, one line without the path.
std::string read_regular_file(const std::filesystem::path& path);

} // namespace hybmss
