#include "simulation/geometry/voxel_grid.hpp"

#include "hybmss/lattice.hpp"
#include "layouts/messages.hpp"
#include "layouts/read_file.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <unistd.h>

namespace hybmss {
namespace {

/// The four bytes as a float; in a file they may stand in either order.
float float_at(const char* bytes, bool big_endian) {
    std::uint32_t bits = 0;
    for (std::size_t b = 0; b < 4; ++b) {
        const std::uint32_t byte = static_cast<unsigned char>(bytes[b]);
        bits |= byte << 8 * (big_endian ? 3 - b : b);
    }
    return std::bit_cast<float>(bits);
}

} // namespace

std::string grid_text(const std::array<std::int64_t, 3>& cells) {
    return std::to_string(cells[0]) + " x " + std::to_string(cells[1]) + " x " + std::to_string(cells[2]);
}

std::size_t sample_bytes(const std::array<std::int64_t, 3>& cells, const SampleFormat& format) {
    double nodes = 1;
    bool positive = true;
    for (std::int64_t n : cells) {
        positive = positive && n >= 1;
        nodes *= static_cast<double>(n) + 1;
    }
    if (!positive || nodes > Lattice::kMostNodes) {
        throw std::runtime_error("its grid is " + grid_text(cells) +
                                 "; each count must be at least 1, and the nodes at most 1e9");
    }
    return static_cast<std::size_t>(cells[0] * cells[1] * cells[2]) * format.bytes;
}

std::uint8_t label_of(double value, const std::array<std::int64_t, 3>& cells, std::size_t cell) {
    if (value >= 0 && value <= 255 && std::floor(value) == value) { // NaN fails every comparison
        return static_cast<std::uint8_t>(value);
    }
    const auto nx = static_cast<std::size_t>(cells[0]), ny = static_cast<std::size_t>(cells[1]);
    throw std::runtime_error(printed("cell (%zu, %zu, %zu) holds %g; labels are whole numbers from 0 (no cell) to 255",
                                     cell % nx, cell / nx % ny, cell / nx / ny, value));
}

void set_spacing(VoxelGrid& grid, const std::array<double, 3>& edges) {
    bool cubes = true;
    for (const double edge : edges) {
        if (!(edge > 0) || !std::isfinite(edge)) {
            throw std::runtime_error(
                printed("its voxels measure %g x %g x %g m; all must be above 0", edges[0], edges[1], edges[2]));
        }
        cubes = cubes && std::abs(edge - edges[0]) <= 1e-3 * edges[0];
    }
    if (cubes) {
        grid.cell_size = edges[0];
    } else {
        grid.spacing = edges;
    }
}

VoxelGrid resampled(const VoxelGrid& grid, double cell_size) {
    const std::array<double, 3>& spacing = grid.spacing.value();
    VoxelGrid cubes;
    cubes.cell_size = cell_size;
    for (std::size_t a = 0; a < 3; ++a) {
        const double count = std::round(static_cast<double>(grid.cells[a]) * spacing[a] / cell_size);
        cubes.cells[a] = static_cast<std::int64_t>(std::clamp(count, 1.0, 1e12));
    }
    cubes.labels.reserve(sample_bytes(cubes.cells, {.bytes = 1}));
    const auto voxel = [&](std::size_t axis, std::int64_t cell) {
        const double place = (static_cast<double>(cell) + 0.5) * cell_size / spacing[axis];
        return std::min(static_cast<std::int64_t>(place), grid.cells[axis] - 1);
    };
    for (std::int64_t k = 0; k < cubes.cells[2]; ++k) {
        for (std::int64_t j = 0; j < cubes.cells[1]; ++j) {
            const std::int64_t row = (voxel(2, k) * grid.cells[1] + voxel(1, j)) * grid.cells[0];
            for (std::int64_t i = 0; i < cubes.cells[0]; ++i) {
                cubes.labels.push_back(grid.labels[static_cast<std::size_t>(row + voxel(0, i))]);
            }
        }
    }
    return cubes;
}

std::vector<std::uint8_t> read_labels(std::string_view data, const std::array<std::int64_t, 3>& cells,
                                      const SampleFormat& format) {
    const std::size_t needed = sample_bytes(cells, format);
    if (data.size() != needed) {
        throw std::runtime_error(std::string(data.size() < needed ? "it is cut short" : "it is too long") + ": " +
                                 std::to_string(data.size()) + " bytes of values; " + grid_text(cells) + " of " +
                                 std::to_string(format.bytes) + (format.bytes == 1 ? " byte need " : " bytes need ") +
                                 std::to_string(needed));
    }
    const auto nx = static_cast<std::size_t>(cells[0]), ny = static_cast<std::size_t>(cells[1]),
               nz = static_cast<std::size_t>(cells[2]);
    std::vector<std::uint8_t> labels(nx * ny * nz);
    std::size_t cell = 0;
    for (std::size_t k = 0; k < nz; ++k) {
        for (std::size_t j = 0; j < ny; ++j) {
            for (std::size_t i = 0; i < nx; ++i, ++cell) {
                const char* sample = &data[format.bytes * (format.x_fastest ? cell : k + nz * (j + ny * i))];
                if (format.bytes == 1) {
                    labels[cell] = static_cast<std::uint8_t>(*sample);
                    continue;
                }
                labels[cell] = label_of(static_cast<double>(float_at(sample, format.big_endian)), cells, cell);
            }
        }
    }
    return labels;
}

VoxelGrid parse_voxels(std::string_view bytes) {
    if (bytes.starts_with("\x93NUMPY")) {
        return parse_npy(bytes);
    }
    if (bytes.starts_with("NRRD")) {
        return parse_nrrd(bytes);
    }
    constexpr std::string_view kNifti[] = {"\x1f\x8b", std::string_view("\x5c\x01\0\0", 4),
                                           std::string_view("\0\0\x01\x5c", 4), std::string_view("\x1c\x02\0\0", 4),
                                           std::string_view("\0\0\x02\x1c", 4)}; // gzip; 348 and 540 in either order
    if (std::ranges::any_of(kNifti, [&](std::string_view beginning) { return bytes.starts_with(beginning); })) {
        return parse_nifti(bytes);
    }
    throw std::runtime_error("by its first bytes it is neither a NumPy array (.npy) nor NRRD or NIfTI");
}

VoxelGrid read_voxels(const std::filesystem::path& path) {
    constexpr std::uintmax_t kMostBytes = 5'000'000'000; // 1e9 floats, and a header
    return parse_voxels(read_file(path, Readable::regular_file, kMostBytes));
}

double available_bytes() {
    std::ifstream meminfo("/proc/meminfo");
    std::string key;
    double kilobytes = 0;
    while (meminfo >> key) {
        if (key == "MemAvailable:" && meminfo >> kilobytes) {
            return 1024 * kilobytes;
        }
    }
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return pages > 0 && page > 0 ? static_cast<double>(pages) * static_cast<double>(page) : HUGE_VAL;
}

} // namespace hybmss
