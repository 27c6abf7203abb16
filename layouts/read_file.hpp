#pragma once

/// \file
/// Files as they come: read whole, never without end, and told of in one line.

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace hybmss {

enum class Readable {
    regular_file,
    file_or_pipe, ///< also a pipe, as /dev/stdin may be; it is waited for
};

/// Why a file was not read, in one line without its name: "it is a directory", "it cannot be read: Permission denied".
struct ReadError : std::runtime_error {
    explicit ReadError(const std::string& why) : std::runtime_error(why), reason(why) {}
    explicit ReadError(std::error_code code)
        : std::runtime_error("it cannot be read: " + code.message()), reason(code.message()) {}

    std::string reason; ///< for "FILE: cannot be read: "
};

/// Throws ReadError for what is there but may not be read: a directory, an endless device, or a pipe that nobody may
/// ever write to.
void require_readable(const std::filesystem::path& path, Readable allowed);

/// All its bytes. Throws ReadError as require_readable(), where it cannot be opened or read, and where there are more
/// than `at_most`.
std::string read_file(const std::filesystem::path& path, Readable allowed, std::uintmax_t at_most);

/// Fit for one line of a message, whatever a file holds: control characters become blanks.
std::string one_line(std::string text);

} // namespace hybmss
