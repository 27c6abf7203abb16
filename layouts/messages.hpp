#pragma once

/// \file
/// Numbers and lists in messages, and numbers in texts.

#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// printf into a string, of at most 511 characters.
[[gnu::format(printf, 1, 2)]] std::string printed(const char* format, ...);

/// "a, b, c" where `between` is ", ".
std::string joined(const std::vector<std::string>& words, const char* between);

/// Throws std::invalid_argument "NAME = VALUE is not allowed: it must be ALLOWED".
[[noreturn]] void refuse_value(const char* name, double value, const std::string& allowed);

/// Whether all of the text is one number that the type can hold, without blanks or a plus sign; sets it then. Of int,
/// std::size_t, float, double.
template <class Number>
bool parse_number(std::string_view text, Number& number);

} // namespace hybmss
