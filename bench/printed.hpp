#pragma once

/// \file
/// printf into a string.

#include <string>

namespace hybmss::bench {

[[gnu::format(printf, 1, 2)]] std::string printed(const char* format, ...);

} // namespace hybmss::bench
