#pragma once

/// \file
/// Voxel files: a label for each cell of a grid, as segmented images hold them.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace hybmss {

/// Labels of nx * ny * nz cubic cells: x fastest, then y, then z; 0 = no cell.
struct VoxelGrid {
    std::array<std::int64_t, 3> cells = {0, 0, 0};
    std::vector<std::uint8_t> labels;
    std::optional<double> cell_size; ///< m, where the file tells
};

/// Reads a file that is NumPy's or NRRD's by its first bytes. Throws std::runtime_error that says what is wrong,
/// without the file's name. What a header claims is held against the size of the file before memory is taken for it.
VoxelGrid read_voxels(const std::filesystem::path& path);

/// The bytes of such a file.
VoxelGrid parse_voxels(std::string_view bytes);

/// The bytes of a .npy file (format 1.0 to 3.0): a 3D array of uint8, bool or float32, in C or Fortran order; cell
/// (i, j, k) is array[i, j, k].
VoxelGrid parse_npy(std::string_view bytes);

/// The bytes of an NRRD file with attached data: uint8 or float, raw or gzip; the fastest axis is x.
/// http://teem.sourceforge.net/nrrd/format.html
VoxelGrid parse_nrrd(std::string_view bytes);

} // namespace hybmss
