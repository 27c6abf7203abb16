#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "hybmss/wisdom.hpp"
#include "plan/tuning/candidates.hpp"

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
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

// ---- what an entry is for

/// Bodies of one class are taken to have the same fastest candidate:
///
///     lattice float face-diagonals quadratic nodes:2^13.5 fill:8/8
///     network double mean-stretch nodes:2^11.0 numbering:scattered
///
/// Nodes go by half steps of their binary logarithm, up to those of the largest sample: larger bodies are timed on such
/// a sample anyway. The filled part of a lattice goes by eighths; where it is at most 0.6, so does active_share. A
/// network's nodes are numbered locally where its springs' ends lie nearer to each other than half way (in logarithms)
/// from a lattice's order, about n^(2/3), to a random one, n/3.
template <class T>
std::string body_class(const Lattice& lattice, const Material& material);
template <class T>
std::string body_class(const Network& network);

/// What the options leave open: "layout:any isa:any accuracy:fast threads:2", and " one-tile" where they say so. The
/// other half of a wisdom entry's key: what is fastest of all says nothing of what is fastest with one thread.
std::string wish_class(const PlanOptions& options);

// ---- wisdom as text

/// What it is measured on. The CPU by what Linux says: the model's name on x86, the part's numbers on ARM.
std::string cpu_model();
/// "sse2 avx2": those that this machine has.
std::string instruction_set_names();

/// All entries as text, after a head that tells what they hold for, before a checksum. See docs/tuning.md.
std::string wisdom_text(const WisdomEntries& entries);

/// The inverse. Throws WisdomError `NAME:LINE: reason` for a text that is damaged, foreign or stale.
WisdomEntries parse_wisdom(std::string_view text, const std::string& name);

/// The last line of a wisdom file whose other lines are `body`.
std::string wisdom_checksum_line(std::string_view body);

} // namespace hybmss
