#include "layouts/messages.hpp"

#include <cstdarg>
#include <cstdio>
#include <stdexcept>

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

} // namespace hybmss
