#pragma once

/// \file
/// Voxel files: a label for each cell of a grid, as segmented images hold them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// Labels of nx * ny * nz cubic cells: x fastest, then y, then z; 0 = no cell.
struct VoxelGrid {
    std::array<std::int64_t, 3> cells = {0, 0, 0};
    std::vector<std::uint8_t> labels;
    std::optional<double> cell_size; ///< m, where the file tells it, and voxels are cubes
    /// m; where the file tells of voxels that are no cubes.
    std::optional<std::array<double, 3>> spacing = {};
};

/// Sets cell_size, to a thousandth, or else `spacing`. Throws std::runtime_error unless all are finite and above 0.
void set_spacing(VoxelGrid& grid, const std::array<double, 3>& edges);

/// Cubes with edges of `cell_size` in place of voxels of other forms, each with the label of the voxel that its centre
/// is in. Their number is rounded, to at least 1. Throws std::runtime_error as sample_bytes() does.
VoxelGrid resampled(const VoxelGrid& grid, double cell_size);

/// Reads a file that is NumPy's, NRRD's or NIfTI's by its first bytes. Throws std::runtime_error that says what is
/// wrong, without the file's name. What a header claims is held against the size of the file before memory is taken for
/// it.
VoxelGrid read_voxels(const std::filesystem::path& path);

/// The bytes of such a file.
VoxelGrid parse_voxels(std::string_view bytes);

/// The bytes of a .npy file (format 1.0 to 3.0): a 3D array of uint8, bool or float32, in C or Fortran order; cell
/// (i, j, k) is array[i, j, k].
VoxelGrid parse_npy(std::string_view bytes);

/// The bytes of an NRRD file with attached data: uint8 or float, raw or gzip; the fastest axis is x.
/// http://teem.sourceforge.net/nrrd/format.html
VoxelGrid parse_nrrd(std::string_view bytes);

/// The bytes of a NIfTI file of version 1 or 2, packed by gzip or not; integers, float or double, scaled as it says.
/// The fastest axis is x; where the axes point in space plays no part. Millimetres where it names no unit.
VoxelGrid parse_nifti(std::string_view bytes);

/// What the gzip stream (one member or several) holds. Grows with what is really there, and stops soon after `at_most`
/// bytes. Throws std::runtime_error where the stream is damaged or cut short.
std::string gunzip(std::string_view compressed, std::size_t at_most);

/// A sample as a label. Throws std::runtime_error for what is no whole number from 0 to 255; `cell` in the grid's
/// order.
std::uint8_t label_of(double value, const std::array<std::int64_t, 3>& cells, std::size_t cell);

/// How samples lie in a file.
struct SampleFormat {
    std::size_t bytes = 1; ///< 1: unsigned integers; 4: IEEE floats
    bool big_endian = false;
    bool x_fastest = true; ///< else z is
};

/// Bytes that the samples of a grid take. Throws std::runtime_error unless every count is at least 1 and a Lattice can
/// number the nodes.
std::size_t sample_bytes(const std::array<std::int64_t, 3>& cells, const SampleFormat& format);

/// The labels, x fastest. Throws std::runtime_error where `data` is not exactly the samples of this grid, or holds a
/// value that is no label: labels are whole numbers from 0 to 255.
std::vector<std::uint8_t> read_labels(std::string_view data, const std::array<std::int64_t, 3>& cells,
                                      const SampleFormat& format);

/// "4 x 5 x 6"
std::string grid_text(const std::array<std::int64_t, 3>& cells);

/// Memory that the machine could give now, in bytes.
double available_bytes();

} // namespace hybmss
