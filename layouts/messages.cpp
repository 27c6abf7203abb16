#include "layouts/messages.hpp"

#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <type_traits>

namespace hybmss {

std::string printed(const char* format, ...) {
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return text;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
    std::string all;
    for (const std::string& word : words) {
        all.append(all.empty() ? "" : between).append(word);
    }
    return all;
}

void refuse_value(const char* name, double value, const std::string& allowed) {
    throw std::invalid_argument(printed("%s = %g is not allowed: it must be ", name, value) + allowed);
}

template <class Number>
bool parse_number(std::string_view text, Number& number) {
#if !defined(__cpp_lib_to_chars)
    // A standard library whose from_chars reads integers alone.
    if constexpr (std::is_floating_point_v<Number>) {
        if (text.empty() || text.find_first_not_of("0123456789.eE+-") != text.npos || text[0] == '+') {
            return false;
        }
        const std::string word(text);
        char* end = nullptr;
        Number value = 0;
        if constexpr (std::is_same_v<Number, float>) {
            value = std::strtof(word.c_str(), &end);
        } else {
            value = std::strtod(word.c_str(), &end);
        }
        const bool read = end == word.c_str() + word.size() && std::isfinite(value);
        number = read ? value : number;
        return read;
    } else
#endif
    {
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        return error == std::errc() && end == text.data() + text.size();
    }
}
template bool parse_number(std::string_view, int&);
template bool parse_number(std::string_view, std::size_t&);
template bool parse_number(std::string_view, float&);
template bool parse_number(std::string_view, double&);

} // namespace hybmss
