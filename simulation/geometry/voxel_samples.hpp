#pragma once

/// \file
/// The samples of a voxel file, whatever its format: bytes -> labels.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

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

} // namespace hybmss
