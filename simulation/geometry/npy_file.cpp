#include "layouts/read_file.hpp"
#include "simulation/geometry/voxel_grid.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

[[noreturn]] void damaged(const std::string& what) {
    throw std::runtime_error("as a .npy file it is damaged: " + what);
}

/// What follows `'key':` in the header, a Python dictionary of literals.
std::string_view value_of(std::string_view header, const std::string& key) {
    for (const char quote : {'\'', '"'}) {
        const std::size_t at = header.find(quote + key + quote);
        if (at == std::string_view::npos) {
            continue;
        }
        const std::size_t colon = header.find_first_not_of(' ', at + key.size() + 2);
        if (colon != std::string_view::npos && header[colon] == ':') {
            const std::size_t value = header.find_first_not_of(' ', colon + 1);
            return value == std::string_view::npos ? "" : header.substr(value);
        }
    }
    damaged("its header has no '" + key + "'");
}

SampleFormat parse_descr(std::string_view value) {
    const char quote = value.empty() ? ' ' : value[0];
    const std::size_t end = quote == '\'' || quote == '"' ? value.find(quote, 1) : std::string_view::npos;
    const std::string_view type = end == std::string_view::npos ? value.substr(0, 20) : value.substr(1, end - 1);
    if (type == "|u1" || type == "|b1" || type == "u1" || type == "b1") {
        return {.bytes = 1};
    }
    if (type == "<f4" || type == ">f4") {
        return {.bytes = 4, .big_endian = type[0] == '>'};
    }
    throw std::runtime_error("its values are of NumPy's type " + one_line(std::string(type)) +
                             "; allowed are uint8, bool and float32 ('|u1', '|b1', '<f4', '>f4')");
}

std::array<std::int64_t, 3> parse_shape(std::string_view value) {
    const std::size_t end = value.find(')');
    if (value.empty() || value[0] != '(' || end == std::string_view::npos) {
        damaged("its shape is not a tuple");
    }
    std::array<std::int64_t, 3> shape = {0, 0, 0};
    std::size_t axes = 0;
    for (std::string_view rest = value.substr(1, end - 1); !rest.empty();) {
        const std::size_t comma = std::min(rest.find(','), rest.size());
        std::string_view word = rest.substr(0, comma);
        rest.remove_prefix(std::min(comma + 1, rest.size()));
        word.remove_prefix(std::min(word.find_first_not_of(' '), word.size()));
        if (word.empty() && rest.empty()) {
            break; // (4,) and (4, 5, 6, ) end in a comma
        }
        std::int64_t count = 0;
        const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), count);
        if (error != std::errc() ||
            word.find_first_not_of(' ', static_cast<std::size_t>(stop - word.data())) != std::string_view::npos) {
            damaged("its shape holds \"" + one_line(std::string(word.substr(0, 20))) + "\"");
        }
        if (axes < 3) {
            shape[axes] = count;
        }
        ++axes;
    }
    if (axes != 3) {
        throw std::runtime_error("its array has " + std::to_string(axes) + " axes; a body needs 3");
    }
    return shape;
}

} // namespace

VoxelGrid parse_npy(std::string_view bytes) {
    // "\x93NUMPY", major, minor, length of the header (2 bytes, from version 2 on 4; little endian), header, data
    const auto byte = [&](std::size_t at) { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[at])); };
    if (bytes.size() < 12) {
        damaged("it ends within its header");
    }
    const std::size_t major = byte(6);
    if (major < 1 || major > 3) {
        damaged("it is of version " + std::to_string(major) + "; known are 1 to 3");
    }
    const std::size_t start = major == 1 ? 10 : 12;
    const std::size_t length = byte(8) + (byte(9) << 8) + (major == 1 ? 0 : (byte(10) << 16) + (byte(11) << 24));
    if (length > bytes.size() - start) {
        damaged("it ends within its header");
    }
    const std::string_view header = bytes.substr(start, length);
    SampleFormat format = parse_descr(value_of(header, "descr"));
    const std::string_view order = value_of(header, "fortran_order");
    if (!order.starts_with("True") && !order.starts_with("False")) {
        damaged("its fortran_order is neither True nor False");
    }
    format.x_fastest = order.starts_with("True");
    VoxelGrid grid;
    grid.cells = parse_shape(value_of(header, "shape"));
    grid.labels = read_labels(bytes.substr(start + length), grid.cells, format);
    return grid;
}

} // namespace hybmss
