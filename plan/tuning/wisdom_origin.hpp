#pragma once

#include <string>
#include <vector>

namespace hybmss {

/// One line of the head of a wisdom file: wisdom with another value is not for this machine or this build.
struct WisdomFact {
    std::string key, value;
    std::string otherwise; ///< what wisdom is that says something else: "foreign" or "stale", and why
};

/// Library version, CPU model, instruction sets, layouts and a digest of the kernels, in the order in which a file
/// holds them.
std::vector<WisdomFact> wisdom_facts();

} // namespace hybmss
