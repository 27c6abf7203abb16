#pragma once

#include <algorithm>
#include <string>

namespace hybmss {

/// Fit for one line of a message, whatever a file holds: control characters become blanks.
inline std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, ' ');
    return text;
}

} // namespace hybmss
