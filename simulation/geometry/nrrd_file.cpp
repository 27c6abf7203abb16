#include "layouts/read_file.hpp"
#include "simulation/geometry/voxel_grid.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

#include <zlib.h>

namespace hybmss {
std::string gunzip(std::string_view compressed, std::size_t at_most) {
    constexpr std::size_t kChunk = std::size_t{1} << 18;
    z_stream stream = {};
    if (inflateInit2(&stream, MAX_WBITS + 16) != Z_OK) { // + 16: gzip alone
        throw std::bad_alloc();
    }
    const std::unique_ptr<z_stream, int (*)(z_streamp)> owner(&stream, inflateEnd);
    std::string text;
    std::string chunk(kChunk, '\0');
    int status = Z_OK;
    while (text.size() <= at_most) {
        if (stream.avail_in == 0 && !compressed.empty()) {
            const std::string_view next = compressed.substr(0, std::size_t{1} << 30); // zlib counts in 32 bits
            // zlib never writes there; its interface is older than const.
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(next.data()));
            stream.avail_in = static_cast<uInt>(next.size());
            compressed.remove_prefix(next.size());
        }
        if (status == Z_STREAM_END) {
            if (stream.avail_in == 0) {
                return text;
            }
            inflateReset(&stream); // one more member
        }
        stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
        stream.avail_out = static_cast<uInt>(chunk.size());
        status = inflate(&stream, Z_NO_FLUSH);
        text.append(chunk, 0, chunk.size() - stream.avail_out);
        if (status == Z_BUF_ERROR) {
            throw std::runtime_error("its gzip stream is cut short");
        }
        if (status != Z_OK && status != Z_STREAM_END) {
            throw std::runtime_error(std::string("its gzip stream is damaged: ") +
                                     (stream.msg ? stream.msg : "no data"));
        }
    }
    return text;
}

namespace {

/// The fields of the header, with what follows it.
struct NrrdFile {
    std::map<std::string, std::string> fields; ///< names in lower case
    std::string_view data;
};

[[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& allowed) {
    throw std::runtime_error("its NRRD field \"" + field + ": " + one_line(value.substr(0, 60)) +
                             "\" is not supported; " + allowed);
}

NrrdFile parse_header(std::string_view bytes) {
    NrrdFile file;
    for (bool first = true;; first = false) {
        const std::size_t end = bytes.find('\n');
        if (end == std::string_view::npos) {
            throw std::runtime_error("as NRRD it is damaged: no empty line ends its header");
        }
        std::string_view line = bytes.substr(0, end);
        bytes.remove_prefix(end + 1);
        if (line.ends_with('\r')) {
            line.remove_suffix(1);
        }
        if (line.empty()) {
            file.data = bytes;
            return file;
        }
        const std::size_t colon = line.find(':');
        // "NRRD0005", comments, and "key:=value", which is free to the writer
        if (first || line[0] == '#' || (colon != std::string_view::npos && line.substr(colon, 2) == ":=")) {
            continue;
        }
        if (colon == std::string_view::npos) {
            throw std::runtime_error("as NRRD it is damaged: \"" + one_line(std::string(line.substr(0, 40))) +
                                     "\" is not a field");
        }
        std::string name;
        for (char c : line.substr(0, colon)) {
            name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        }
        std::string_view value = line.substr(colon + 1);
        value.remove_prefix(std::min(value.find_first_not_of(" \t"), value.size()));
        value.remove_suffix(value.size() - std::min(value.find_last_not_of(" \t") + 1, value.size()));
        file.fields[name] = std::string(value);
    }
}

const std::string& required(const NrrdFile& file, const std::string& field) {
    const auto found = file.fields.find(field);
    if (found == file.fields.end()) {
        throw std::runtime_error("as NRRD it is damaged: its header has no \"" + field + "\"");
    }
    return found->second;
}

std::string value_or_none(const NrrdFile& file, const std::string& field) {
    const auto found = file.fields.find(field);
    return found == file.fields.end() ? "" : found->second;
}

/// `count` numbers parted by blanks, commas and parentheses.
template <class Number, std::size_t count>
std::array<Number, count> numbers(const std::string& field, const std::string& value) {
    std::string words = value;
    for (char& c : words) {
        c = c == ',' || c == '(' || c == ')' ? ' ' : c;
    }
    std::istringstream stream(words);
    std::array<Number, count> read{};
    for (Number& number : read) {
        std::string word;
        stream >> word;
        const char* end = word.data() + word.size();
        if (word.empty() || std::from_chars(word.data(), end, number).ptr != end) {
            refuse(field, value, "it must hold " + std::to_string(count) + " numbers");
        }
    }
    if (std::string more; stream >> more) {
        refuse(field, value, "it must hold " + std::to_string(count) + " numbers");
    }
    return read;
}

SampleFormat sample_format(const NrrdFile& file) {
    const std::string& type = required(file, "type");
    if (type == "uchar" || type == "unsigned char" || type == "uint8" || type == "uint8_t") {
        return {.bytes = 1};
    }
    if (type != "float") {
        refuse("type", type, "allowed are uint8 (uchar) and float");
    }
    const std::string& endian = required(file, "endian");
    if (endian != "little" && endian != "big") {
        refuse("endian", endian, "allowed are little and big");
    }
    return {.bytes = 4, .big_endian = endian == "big"};
}

/// The length unit of the spacings in m; they are in m where the file names none.
double length_unit(const NrrdFile& file, const std::string& field) {
    const std::string value = value_or_none(file, field);
    static const std::map<std::string, double> known = {{"m", 1},     {"cm", 1e-2},      {"mm", 1e-3},
                                                        {"um", 1e-6}, {"\u00b5m", 1e-6}, {"microns", 1e-6}};
    double unit = 1;
    std::size_t read = 0;
    for (std::size_t at = value.find('"'); at != std::string::npos; at = value.find('"', at)) {
        const std::size_t end = value.find('"', at + 1);
        const auto found = known.find(value.substr(at + 1, end - at - 1));
        if (end == std::string::npos || found == known.end() || (read > 0 && found->second != unit)) {
            refuse(field, value, "allowed are \"m\", \"cm\", \"mm\" and \"um\", one for all axes");
        }
        unit = found->second;
        at = end + 1;
        ++read;
    }
    return unit;
}

/// The edges of a voxel in m, if told. Where the axes point in space plays no part.
std::optional<std::array<double, 3>> voxel_size(const NrrdFile& file) {
    std::array<double, 3> size{};
    std::string field = "spacings", units = "units";
    if (const std::string spacings = value_or_none(file, field); !spacings.empty()) {
        size = numbers<double, 3>(field, spacings);
    } else if (const std::string directions = value_or_none(file, field = "space directions"); !directions.empty()) {
        units = "space units";
        const auto d = numbers<double, 9>(field, directions);
        const auto dot = [&](std::size_t a, std::size_t b) {
            return d[3 * a] * d[3 * b] + d[3 * a + 1] * d[3 * b + 1] + d[3 * a + 2] * d[3 * b + 2];
        };
        for (std::size_t a = 0; a < 3; ++a) {
            size[a] = std::sqrt(dot(a, a));
        }
        for (std::size_t a = 0; a < 3; ++a) {
            if (std::abs(dot(a, (a + 1) % 3)) > 1e-3 * size[a] * size[(a + 1) % 3]) {
                refuse(field, directions, "the axes must be at right angles");
            }
        }
    } else {
        return std::nullopt;
    }
    for (double edge : size) {
        if (!(edge > 0) || !std::isfinite(edge)) {
            refuse(field, value_or_none(file, field), "it must hold three sizes above 0");
        }
    }
    const double unit = length_unit(file, units);
    return std::array{size[0] * unit, size[1] * unit, size[2] * unit};
}

} // namespace

VoxelGrid parse_nrrd(std::string_view bytes) {
    const NrrdFile file = parse_header(bytes);
    if (const std::string& dimension = required(file, "dimension"); dimension != "3") {
        refuse("dimension", dimension, "a body needs 3");
    }
    for (const char* field : {"data file", "datafile"}) {
        if (file.fields.contains(field)) {
            refuse(field, value_or_none(file, field), "the data must be in the same file");
        }
    }
    for (const char* field : {"line skip", "byte skip"}) {
        if (file.fields.contains(field) && value_or_none(file, field) != "0") {
            refuse(field, value_or_none(file, field), "the data must follow the header");
        }
    }
    const SampleFormat format = sample_format(file);
    VoxelGrid grid;
    grid.cells = numbers<std::int64_t, 3>("sizes", required(file, "sizes"));
    if (const auto edges = voxel_size(file)) {
        set_spacing(grid, *edges);
    }
    const std::string& encoding = required(file, "encoding");
    if (encoding == "raw") {
        grid.labels = read_labels(file.data, grid.cells, format);
    } else if (encoding == "gzip" || encoding == "gz") {
        grid.labels = read_labels(gunzip(file.data, sample_bytes(grid.cells, format)), grid.cells, format);
    } else {
        refuse("encoding", encoding, "allowed are raw and gzip");
    }
    return grid;
}

} // namespace hybmss
