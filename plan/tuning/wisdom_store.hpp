#pragma once

#include "hybmss/wisdom.hpp"
#include "plan/tuning/candidates.hpp"

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace hybmss {

struct WisdomEntry {
    Candidate choice;
    std::vector<CandidateFigure> figures; ///< of all candidates that were timed, the choice among them
};

/// By body class and wish class.
using WisdomEntries = std::map<std::string, WisdomEntry>;

/// What wisdom keeps; its users see none of it.
struct Wisdom::Implementation {
    mutable std::mutex mutex;
    WisdomEntries entries;
};

/// How plans reach into wisdom.
struct WisdomStore {
    static std::optional<WisdomEntry> find(const Wisdom& wisdom, const std::string& key);
    static void put(Wisdom& wisdom, const std::string& key, WisdomEntry entry);
};

} // namespace hybmss
