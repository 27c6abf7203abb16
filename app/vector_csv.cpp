#include "app/vector_csv.hpp"

#include "simulation/results/atomic_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace hybmss {
namespace {

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r";
    const std::size_t first = text.find_first_not_of(kBlanks);
    return first == std::string_view::npos ? std::string_view{}
                                           : text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// from_chars knows no leading plus sign, which some programs write.
std::optional<double> number(std::string_view text) {
    text = trimmed(text);
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') {
        text.remove_prefix(1);
    }
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
        return std::nullopt;
    }
    return value;
}

std::vector<std::string_view> fields(std::string_view line) {
    std::vector<std::string_view> all;
    for (std::size_t comma = 0; comma != std::string_view::npos; line.remove_prefix(comma + 1)) {
        comma = line.find(',');
        all.push_back(line.substr(0, comma));
        if (comma == std::string_view::npos) {
            break;
        }
    }
    return all;
}

} // namespace

std::vector<std::array<double, 3>> read_vector_csv(const std::string& path, std::size_t rows) {
    errno = 0;
    std::ifstream file(path);
    if (!file) {
        throw std::invalid_argument(path + ": cannot be read: " + std::generic_category().message(errno));
    }
    std::vector<std::array<double, 3>> values;
    std::string line;
    long line_number = 0;
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument(path + ":" + std::to_string(line_number) + ": " + what);
    };
    while (std::getline(file, line)) {
        ++line_number;
        if (trimmed(line).empty()) {
            continue;
        }
        const std::vector<std::string_view> texts = fields(line);
        if (line_number == 1 && !number(texts[0])) {
            continue;
        }
        if (texts.size() != 3) {
            fail(std::to_string(texts.size()) + " values; a row has three: x,y,z");
        }
        std::array<double, 3>& row = values.emplace_back();
        for (std::size_t a = 0; a < 3; ++a) {
            const std::optional<double> value = number(texts[a]);
            if (!value || !std::isfinite(*value)) {
                fail(fmt::format("\"{}\" is not allowed; each value must be a finite number", trimmed(texts[a])));
            }
            row[a] = *value;
        }
        if (values.size() > rows) {
            fail("more rows than the body has nodes; it must be " + std::to_string(rows) + " rows, one a node");
        }
    }
    if (file.bad() || values.size() != rows) {
        fail(std::to_string(values.size()) + " rows; it must be " + std::to_string(rows) + ", one a node");
    }
    return values;
}

void write_vector_csv(const std::string& path, std::span<const std::array<double, 3>> values, int digits) {
    AtomicFile file(path);
    file.stream() << "x,y,z\n";
    for (const auto& v : values) {
        char row[120];
        std::snprintf(row, sizeof row, "%.*g,%.*g,%.*g\n", digits, v[0], digits, v[1], digits, v[2]);
        file.stream() << row;
    }
    file.commit();
}

} // namespace hybmss
