#include "simulation/voxel_grid.hpp"

#include <cerrno>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <system_error>

namespace hybmss {

VoxelGrid parse_voxels(std::string_view bytes) {
    if (bytes.starts_with("\x93NUMPY")) {
        return parse_npy(bytes);
    }
    if (bytes.starts_with("NRRD")) {
        return parse_nrrd(bytes);
    }
    throw std::runtime_error("by its first bytes it is neither a NumPy array (.npy) nor NRRD");
}

VoxelGrid read_voxels(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
        throw std::runtime_error("it is a directory");
    }
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file.is_open() || file.bad()) {
        throw std::runtime_error("it cannot be read: " + std::generic_category().message(errno));
    }
    return parse_voxels(bytes);
}

} // namespace hybmss
