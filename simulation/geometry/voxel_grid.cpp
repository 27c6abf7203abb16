#include "simulation/geometry/voxel_grid.hpp"

#include "simulation/geometry/read_file.hpp"

#include <stdexcept>

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
    return parse_voxels(read_regular_file(path));
}

} // namespace hybmss
