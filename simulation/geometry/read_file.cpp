#include "simulation/geometry/read_file.hpp"

#include <cerrno>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

namespace hybmss {

void require_regular_file(const std::filesystem::path& path) {
    std::error_code ignored; // what is missing or cannot be reached is told of when it is opened
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_directory(status)) {
        throw std::runtime_error("it is a directory");
    }
    if (std::filesystem::is_other(status)) {
        throw std::runtime_error("it is a pipe, a device or a socket; a regular file is needed");
    }
}

std::string read_regular_file(const std::filesystem::path& path) {
    require_regular_file(path);
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    std::string content{std::istreambuf_iterator<char>(file), {}};
    if (!file.is_open() || file.bad()) {
        throw std::runtime_error("it cannot be read: " + std::generic_category().message(errno != 0 ? errno : EIO));
    }
    return content;
}

} // namespace hybmss
