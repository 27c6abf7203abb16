#pragma once

#include "plan/tuning/wisdom_store.hpp"

#include <string>
#include <string_view>

namespace hybmss {

/// All entries as text, after a head that tells what they hold for, before a checksum. See docs/tuning.md.
std::string wisdom_text(const WisdomEntries& entries);

/// The inverse. Throws WisdomError `NAME:LINE: reason` for a text that is damaged, foreign or stale.
WisdomEntries parse_wisdom(std::string_view text, const std::string& name);

/// The last line of a wisdom file whose other lines are `body`.
std::string wisdom_checksum_line(std::string_view body);

} // namespace hybmss
