#include "simulation/geometry/voxel_grid.hpp"

#include "hybmss/lattice.hpp"
#include "layouts/messages.hpp"
#include "layouts/read_file.hpp"

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
                const float value = float_at(sample, format.big_endian);
                // NaN fails every comparison.
                if (!(value >= 0 && value <= 255 && std::floor(value) == value)) {
                    throw std::runtime_error(
                        printed("cell (%zu, %zu, %zu) holds %g; labels are whole numbers from 0 (no cell) to 255", i, j,
                                k, static_cast<double>(value)));
                }
                labels[cell] = static_cast<std::uint8_t>(value);
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
    throw std::runtime_error("by its first bytes it is neither a NumPy array (.npy) nor NRRD");
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
