#include "layouts/read_file.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>

namespace hybmss {

void require_readable(const std::filesystem::path& path, Readable allowed) {
    std::error_code ignored; // what is missing or cannot be reached is told of when it is opened
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_directory(status)) {
        throw ReadError("it is a directory");
    }
    if (!std::filesystem::is_other(status)) {
        return;
    }
    if (allowed == Readable::regular_file) {
        throw ReadError("it is a pipe, a device or a socket; a regular file is needed");
    }
    if (!std::filesystem::is_fifo(status)) {
        throw ReadError("it is a device or a socket; a regular file or a pipe is needed");
    }
}

std::string read_file(const std::filesystem::path& path, Readable allowed, std::uintmax_t at_most) {
    constexpr std::size_t kChunk = std::size_t{1} << 20;
    require_readable(path, allowed);
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    std::string content;
    std::error_code ignored;
    if (const std::uintmax_t size = std::filesystem::file_size(path, ignored); !ignored && size <= at_most) {
        content.reserve(static_cast<std::size_t>(size) + kChunk);
    }
    // To its end, not to that size: a pipe has none, and a file may grow.
    for (std::size_t size = 0; file && size <= at_most; size += static_cast<std::size_t>(file.gcount())) {
        content.resize(size + kChunk);
        file.read(content.data() + size, kChunk);
        content.resize(size + static_cast<std::size_t>(file.gcount()));
    }
    if (!file.is_open() || file.bad()) {
        throw ReadError(std::error_code(errno != 0 ? errno : EIO, std::generic_category()));
    }
    if (content.size() > at_most) {
        throw ReadError("it is longer than the " + std::to_string(at_most) + " bytes that are read at most");
    }
    return content;
}

std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, ' ');
    return text;
}

} // namespace hybmss
