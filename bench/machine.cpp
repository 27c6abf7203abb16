#include "bench/machine.hpp"

#include "hybmss/version.hpp"
#include "plan/tuning/wisdom_store.hpp"

#include <thread>

namespace hybmss::bench {
namespace {

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

} // namespace

std::vector<std::pair<std::string, std::string>> machine_description() {
    return {{"cpu_model", cpu_model()},
            {"hardware_threads", std::to_string(std::thread::hardware_concurrency())},
            {"instruction_sets", instruction_set_names()},
            {"compiler", compiler()},
            {"hybmss_version", kVersion},
            {"hybmss_build_type", build_type()}};
}

std::string machine_line() {
    return cpu_model() + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads, " +
           instruction_set_names() + "; hybmss " + kVersion + ", " + build_type() + ", " + compiler();
}

} // namespace hybmss::bench
