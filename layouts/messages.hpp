#pragma once

/// \file
/// Numbers and lists in messages.

#include <string>
#include <vector>

namespace hybmss {

/// printf into a string, of at most 511 characters.
[[gnu::format(printf, 1, 2)]] std::string printed(const char* format, ...);

/// "a, b, c" where `between` is ", ".
std::string joined(const std::vector<std::string>& words, const char* between);

/// Throws std::invalid_argument "NAME = VALUE is not allowed: it must be ALLOWED".
[[noreturn]] void refuse_value(const char* name, double value, const std::string& allowed);

} // namespace hybmss
