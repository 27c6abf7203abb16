#include "plan/tuning/wisdom_origin.hpp"

#include "hybmss/plan_options.hpp"
#include "hybmss/version.hpp"

#include <fstream>

namespace hybmss {
namespace {

/// From Linux: the model's name on x86, the part's numbers on ARM.
std::string cpu_model() {
    std::ifstream cpuinfo("/proc/cpuinfo");
    std::string line, arm;
    while (std::getline(cpuinfo, line) && !line.empty()) {
        const auto colon = line.find(": ");
        if (colon == std::string::npos) {
            continue;
        }
        const std::string value = line.substr(colon + 2);
        if (line.starts_with("model name")) {
            return value;
        }
        if (line.starts_with("CPU implementer") || line.starts_with("CPU variant") || line.starts_with("CPU part")) {
            arm += (arm.empty() ? "" : " ") + value;
        }
    }
    return arm.empty() ? "unknown" : arm;
}

std::string joined(const std::vector<std::string>& words) {
    std::string all;
    for (const std::string& word : words) {
        all += (all.empty() ? "" : " ") + word;
    }
    return all;
}

std::string instruction_sets() {
    std::vector<std::string> names;
    for (const InstructionSet set : available_instruction_sets()) {
        names.emplace_back(name(set));
    }
    return joined(names);
}

} // namespace

std::vector<WisdomFact> wisdom_facts() {
    return {{"version", kVersion, "stale: written by another version of hybmss"},
            {"cpu", cpu_model(), "foreign: measured on another CPU"},
            {"instruction_sets", instruction_sets(), "foreign: measured with other instruction sets"},
            {"lattice_layouts", joined(lattice_layouts()), "stale: measured among other lattice layouts"},
            {"network_layouts", joined(network_layouts()), "stale: measured among other network layouts"},
            {"kernels", HYBMSS_KERNEL_REVISION, "stale: measured with other kernels or another compiler"}};
}

} // namespace hybmss
