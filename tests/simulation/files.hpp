#pragma once

/// \file
/// Voxel files written by hand, in every order and endianness, and the arrays of .vtu files read back.

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss::test {

using Shape = std::array<int, 3>;

/// Different in every cell of a small grid, some 0, so that a swapped axis cannot go unseen.
inline int label_at(int i, int j, int k) {
    return (i + 3 * j + 11 * k) % 50 * 5;
}

enum class Layout { x_fastest, z_fastest };
enum class Values { uint8, little_float, big_float };

/// The values alone.
inline std::string samples(const Shape& n, Layout layout, Values values,
                           const std::function<int(int, int, int)>& at = label_at) {
    std::string bytes;
    const Shape order = layout == Layout::x_fastest ? Shape{2, 1, 0} : Shape{0, 1, 2}; // slowest axis first
    const auto size = [&](int axis) { return n[static_cast<std::size_t>(order[static_cast<std::size_t>(axis)])]; };
    Shape cell{};
    for (int a = 0; a < size(0); ++a) {
        for (int b = 0; b < size(1); ++b) {
            for (int c = 0; c < size(2); ++c) {
                cell[static_cast<std::size_t>(order[0])] = a;
                cell[static_cast<std::size_t>(order[1])] = b;
                cell[static_cast<std::size_t>(order[2])] = c;
                const int label = at(cell[0], cell[1], cell[2]);
                if (values == Values::uint8) {
                    bytes += static_cast<char>(label);
                    continue;
                }
                const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(label));
                for (int byte = 0; byte < 4; ++byte) {
                    bytes += static_cast<char>(bits >> 8 * (values == Values::big_float ? 3 - byte : byte) & 0xffu);
                }
            }
        }
    }
    return bytes;
}

/// What numpy.save writes before the values.
inline std::string npy_header(const std::string& descr, const std::string& order, const std::string& shape,
                              int version = 1) {
    const std::string text =
        "{'descr': '" + descr + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }   \n";
    std::string bytes = "\x93NUMPY";
    bytes += static_cast<char>(version);
    bytes += '\0';
    for (std::size_t b = 0; b < (version == 1 ? 2u : 4u); ++b) {
        bytes += static_cast<char>(text.size() >> 8 * b & 0xffu);
    }
    return bytes + text;
}

inline std::string shape_text(const Shape& n, const char* between) {
    return std::to_string(n[0]) + between + std::to_string(n[1]) + between + std::to_string(n[2]);
}

/// A .npy file of uint8 in C order.
inline std::string npy(const Shape& n, const std::function<int(int, int, int)>& at = label_at) {
    // One string that grows: g++ 12 sees an overlap in "(" + text + ")" that there is not.
    std::string shape = "(";
    shape.append(shape_text(n, ", ")).append(")");
    return npy_header("|u1", "False", shape) + samples(n, Layout::z_fastest, Values::uint8, at);
}

inline std::string nrrd_header(const std::string& type, const Shape& n, const std::string& encoding,
                               const std::string& more = "") {
    return "NRRD0004\n# written by hand\ntype: " + type + "\ndimension: 3\nsizes: " + shape_text(n, " ") +
           "\nencoding: " + encoding + "\n" + more + "author:=nobody\n\n";
}

inline std::string gzipped(const std::string& bytes) {
    z_stream stream = {};
    if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
        throw std::runtime_error("zlib");
    }
    std::string packed(deflateBound(&stream, bytes.size()), '\0');
    std::string source = bytes;
    stream.next_in = reinterpret_cast<Bytef*>(source.data());
    stream.avail_in = static_cast<uInt>(source.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

/// The appended array `name` of a .vtu file.
template <class T>
std::vector<T> vtu_array(const std::string& vtu, const std::string& name) {
    const std::size_t declared = vtu.find("Name=\"" + name + "\"");
    EXPECT_NE(declared, std::string::npos) << name;
    const std::size_t offset_at = vtu.find("offset=\"", declared) + 8;
    const std::size_t offset = std::stoul(vtu.substr(offset_at));
    const char* const kStart = "<AppendedData encoding=\"raw\">\n_";
    const char* data = vtu.data() + vtu.find(kStart) + std::strlen(kStart) + offset;
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, data, sizeof bytes);
    std::vector<T> values(bytes / sizeof(T));
    std::memcpy(values.data(), data + sizeof bytes, bytes);
    return values;
}

} // namespace hybmss::test
