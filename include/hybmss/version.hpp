#pragma once

#include "hybmss/version.h"

namespace hybmss {

/// The library's version, "major.minor.patch".
inline constexpr const char* kVersion = "0.1.0";

} // namespace hybmss
