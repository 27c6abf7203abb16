#pragma once

#define HYBMSS_VERSION_MAJOR 0
#define HYBMSS_VERSION_MINOR 1
#define HYBMSS_VERSION_PATCH 0

namespace hybmss {

/// The library's version, "major.minor.patch".
inline constexpr const char* kVersion = "0.1.0";

} // namespace hybmss
