// The benchmarks as a program of their own: `hybmss_bench ...` is `hybmss bench ...`.
#include "app/command_line.hpp"
#include "app/commands.hpp"

#include <vector>

int main(int argc, char** argv) {
    CLI::App app("Benchmarks of the hybrid mass-spring kernels", "hybmss_bench");
    add_bench_command(app);
    std::vector<const char*> arguments(argv, argv + argc);
    arguments.insert(arguments.begin() + 1, "bench");
    return hybmss::run_command_line(app, static_cast<int>(arguments.size()), arguments.data());
}
