#include "simulation/geometry/voxel_grid.hpp"

#include "layouts/messages.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

// Of the header (https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h) a dozen numbers matter here. They are read
// from the bytes themselves: Debian's libniftiio wants a file, and believes its header before it has seen the data.

namespace hybmss {
namespace {

/// Numbers at fixed places of bytes, in either order.
struct Header {
    std::string_view bytes;
    bool swapped = false;

    template <class Number>
    Number at(std::size_t place) const {
        std::array<char, sizeof(Number)> read{};
        std::memcpy(read.data(), bytes.data() + place, read.size());
        if (swapped) {
            for (std::size_t b = 0; b < read.size() / 2; ++b) {
                std::swap(read[b], read[read.size() - 1 - b]);
            }
        }
        return std::bit_cast<Number>(read);
    }
};

/// Where the fields stand in version 1 and in version 2.
struct Places {
    std::size_t size, data_type, dimensions, spacings, data, slope, intercept, units;
    bool wide; ///< counts and places have 64 bits, spacings are doubles
};
constexpr Places kFirst = {348, 70, 40, 76, 108, 112, 116, 123, false};
constexpr Places kSecond = {540, 12, 16, 104, 168, 176, 184, 500, true};

[[noreturn]] void refuse(const std::string& what, const std::string& allowed) {
    throw std::runtime_error("its NIfTI " + what + " is not supported; " + allowed);
}

/// The value of a sample.
template <class Number>
double sample(const Header& header, std::size_t place) {
    return static_cast<double>(header.at<Number>(place));
}

struct SampleType {
    int code;
    std::size_t bytes;
    double (*read)(const Header&, std::size_t);
};
constexpr SampleType kTypes[] = {{2, 1, sample<std::uint8_t>}, {256, 1, sample<std::int8_t>},
                                 {4, 2, sample<std::int16_t>}, {512, 2, sample<std::uint16_t>},
                                 {8, 4, sample<std::int32_t>}, {768, 4, sample<std::uint32_t>},
                                 {16, 4, sample<float>},       {64, 8, sample<double>}};

const SampleType& sample_type(int code) {
    for (const SampleType& type : kTypes) {
        if (type.code == code) {
            return type;
        }
    }
    refuse("data type " + std::to_string(code),
           "allowed are 8, 16 and 32 bit integers, float and double (2, 256, 4, 512, 8, 768, 16, 64)");
}

/// m.
double length_unit(int code) {
    switch (code & 7) {
    case 1:
        return 1;
    case 0: // untold: millimetres, which scanners write
    case 2:
        return 1e-3;
    case 3:
        return 1e-6;
    default:
        refuse("unit of length " + std::to_string(code & 7), "allowed are 1 (m), 2 (mm), 3 (um) and 0, taken for mm");
    }
}

} // namespace

VoxelGrid parse_nifti(std::string_view bytes) {
    std::string unpacked;
    if (bytes.starts_with("\x1f\x8b")) {
        constexpr std::size_t kMost = 9'000'000'000; // 1e9 doubles, and a header
        unpacked = gunzip(bytes, kMost);
        bytes = unpacked;
    }
    if (bytes.size() < 4) {
        throw std::runtime_error("as NIfTI it is cut short: it has no header");
    }
    Header header{bytes};
    const auto is = [&](const Places& places) {
        return header.at<std::int32_t>(0) == static_cast<std::int32_t>(places.size);
    };
    if (!is(kFirst) && !is(kSecond)) {
        header.swapped = true;
    }
    if (!is(kFirst) && !is(kSecond)) {
        throw std::runtime_error("it is no NIfTI file: its header is of neither 348 nor 540 bytes");
    }
    const Places& at = is(kFirst) ? kFirst : kSecond;
    if (bytes.size() < at.size) {
        throw std::runtime_error(
            printed("as NIfTI it is cut short: %zu bytes, its header has %zu", bytes.size(), at.size));
    }
    const std::string_view magic = bytes.substr(at.wide ? 4 : 344, 3);
    if (magic != (at.wide ? "n+2" : "n+1")) {
        refuse("form", "image and header must be in one file (.nii or .nii.gz)");
    }
    const auto dimension = [&](std::size_t n) {
        return at.wide ? header.at<std::int64_t>(at.dimensions + 8 * n)
                       : std::int64_t{header.at<std::int16_t>(at.dimensions + 2 * n)};
    };
    VoxelGrid grid;
    const std::int64_t count = dimension(0);
    for (std::size_t n = 1; n <= 7 && static_cast<std::int64_t>(n) <= count; ++n) {
        if (n <= 3) {
            grid.cells[n - 1] = dimension(n);
        } else if (dimension(n) > 1) {
            refuse("image of " + std::to_string(count) + " dimensions", "a body needs 3");
        }
    }
    const SampleType& type = sample_type(header.at<std::int16_t>(at.data_type));
    const std::size_t needed = sample_bytes(grid.cells, {.bytes = type.bytes});
    const double begin = at.wide ? static_cast<double>(header.at<std::int64_t>(at.data))
                                 : static_cast<double>(header.at<float>(at.data));
    if (!(begin >= static_cast<double>(at.size) && begin <= static_cast<double>(bytes.size()))) {
        refuse(printed("data at byte %g", begin), printed("it has %zu bytes", bytes.size()));
    }
    const auto first = static_cast<std::size_t>(begin);
    if (bytes.size() - first < needed) {
        throw std::runtime_error(printed("it is cut short: %zu bytes of values; %s of %zu bytes need %zu",
                                         bytes.size() - first, grid_text(grid.cells).c_str(), type.bytes, needed));
    }
    const auto real = [&](std::size_t place) {
        return at.wide ? header.at<double>(place) : static_cast<double>(header.at<float>(place));
    };
    std::array<double, 3> spacing{};
    const double unit = length_unit(at.wide ? header.at<std::int32_t>(at.units) : bytes[at.units]);
    for (std::size_t a = 0; a < 3; ++a) {
        spacing[a] = unit * std::abs(real(at.spacings + (a + 1) * (at.wide ? 8 : 4)));
    }
    set_spacing(grid, spacing);
    const double given = real(at.slope), slope = given != 0 && std::isfinite(given) ? given : 1,
                 intercept = slope == given && std::isfinite(real(at.intercept)) ? real(at.intercept) : 0;
    grid.labels.resize(needed / type.bytes);
    for (std::size_t cell = 0; cell < grid.labels.size(); ++cell) {
        grid.labels[cell] =
            label_of(slope * type.read(header, first + cell * type.bytes) + intercept, grid.cells, cell);
    }
    return grid;
}

} // namespace hybmss
