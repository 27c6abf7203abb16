#pragma once

#include "hybmss/export.h"

#include <string_view>

namespace hybmss {

enum class Precision { float32, float64 };

/// "float" or "double".
HYBMSS_EXPORT std::string_view name(Precision precision);

/// The inverse of name(). Throws std::invalid_argument that lists the names.
HYBMSS_EXPORT Precision parse_precision(std::string_view text);

} // namespace hybmss
