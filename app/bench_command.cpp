#include "app/bench_arguments.hpp"
#include "app/command_line.hpp"

#include <CLI/CLI.hpp>

#include <array>
#include <memory>

namespace {

using namespace hybmss;

constexpr Benchmark kMatrix = {"", "", bench::step_benchmark};
/// What is measured instead of the matrix. `hybmss-study bench` has more.
constexpr std::array<Benchmark, 3> kInstead = {
    {{"--price", "what a digit costs: error of the forces beside a step's time, by type and level of accuracy",
      bench::accuracy_benchmark},
     {"--effects", "what each effect of a scene adds to the step", bench::effects_benchmark},
     {"--realtime", "the largest cubes that hold frames of 1/60 s and 1/1000 s", bench::realtime_benchmark}}};

} // namespace

void add_bench_command(CLI::App& app) {
    struct Given : BenchArguments {
        std::array<bool, kInstead.size()> instead{};
    };
    const auto given = std::make_shared<Given>();
    CLI::App* command = app.add_subcommand("bench", "measure the explicit step against the scalar yardstick");
    given->add_to(*command);
    auto* group = command->add_option_group("instead of the matrix", "at most one of:");
    group->require_option(0, 1);
    for (std::size_t i = 0; i < kInstead.size(); ++i) {
        group->add_flag(kInstead[i].name, given->instead[i], kInstead[i].about);
    }
    command->callback([given] {
        const Benchmark* chosen = &kMatrix;
        for (std::size_t i = 0; i < kInstead.size(); ++i) {
            chosen = given->instead[i] ? &kInstead[i] : chosen;
        }
        run_benchmark(*chosen, *given);
    });
}
