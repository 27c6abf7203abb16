#pragma once

/// \file
/// Decompression of gzip streams.

#include <cstddef>
#include <string>
#include <string_view>

namespace hybmss {

/// What the gzip stream (one member or several) holds. Grows with what is really there, and stops soon after `at_most`
/// bytes. Throws std::runtime_error where the stream is damaged or cut short.
std::string gunzip(std::string_view compressed, std::size_t at_most);

} // namespace hybmss
