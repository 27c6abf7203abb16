#include "bench/machine.hpp"

#include "hybmss/instruction_set.hpp"
#include "hybmss/version.hpp"

#include <fstream>
#include <limits>
#include <thread>

namespace hybmss::bench {
namespace {

std::string cpu_model() {
    std::ifstream cpuinfo("/proc/cpuinfo");
    std::string line;
    while (std::getline(cpuinfo, line)) {
        const auto colon = line.find(": ");
        if (line.starts_with("model name") && colon != std::string::npos) {
            return line.substr(colon + 2);
        }
    }
    return "unknown";
}

std::string compiler() {
#if defined(__clang__)
    return "clang " __clang_version__;
#elif defined(__GNUC__)
    return "g++ " __VERSION__;
#else
    return "unknown";
#endif
}

std::string build_type() {
    const std::string configured = HYBMSS_BUILD_TYPE;
#ifdef NDEBUG
    return configured.empty() ? "unnamed, without assertions" : configured;
#else
    return configured.empty() ? "unnamed, with assertions" : configured + ", with assertions";
#endif
}

std::string instruction_sets() {
    std::string all;
    for (InstructionSet set : available_instruction_sets()) {
        all += all.empty() ? "" : " ";
        all += name(set);
    }
    return all;
}

} // namespace

double available_memory() {
    std::ifstream meminfo("/proc/meminfo");
    std::string line;
    while (std::getline(meminfo, line)) {
        if (line.starts_with("MemAvailable:")) {
            return 1024 * std::stod(line.substr(line.find(':') + 1));
        }
    }
    return std::numeric_limits<double>::infinity();
}

std::vector<std::pair<std::string, std::string>> machine_description() {
    return {{"cpu_model", cpu_model()},
            {"hardware_threads", std::to_string(std::thread::hardware_concurrency())},
            {"instruction_sets", instruction_sets()},
            {"compiler", compiler()},
            {"hybmss_version", kVersion},
            {"hybmss_build_type", build_type()}};
}

std::string machine_line() {
    return cpu_model() + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads, " +
           instruction_sets() + "; hybmss " + kVersion + ", " + build_type() + ", " + compiler();
}

} // namespace hybmss::bench
