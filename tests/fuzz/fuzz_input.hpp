#pragma once

/// \file
/// What the fuzz targets have in common: how they are entered, and what every error message must be.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

/// libFuzzer calls this for every input; 0: keep it where it reached something new.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace hybmss::fuzz {

/// Ends the program with a message, so that libFuzzer keeps the input.
inline void require(bool condition, const char* what) {
    if (!condition) {
        std::fprintf(stderr, "fuzz: FAILED: %s\n", what);
        std::abort();
    }
}

/// An error message tells something, and in one line.
inline void require_one_line(std::string_view message) {
    require(!message.empty(), "the error message is empty");
    require(message.find('\n') == std::string_view::npos, "the error message has several lines");
}

inline std::string_view text(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}

} // namespace hybmss::fuzz
