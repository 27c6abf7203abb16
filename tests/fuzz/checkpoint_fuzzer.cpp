// Checkpoints: an input that begins with a checkpoint's first bytes is a file, read as it comes and with a digest that
// fits. Any other is a list of changes to the sections of a checkpoint that this build wrote, which its scene goes on
// from.

#include "hybmss/simulation/simulation.hpp"
#include "plan/tuning/digest.hpp"
#include "simulation/run/checkpoint.hpp"
#include "tests/fuzz/fuzz_input.hpp"

#include <fuzzer/FuzzedDataProvider.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

using namespace hybmss;

namespace {

// All that a checkpoint may hold: contact, a cut, a metered balance.
constexpr const char* kScenes[] = {R"(
[body]
cells = [3, 2, 2]
cell_size = 0.5
[material]
young_modulus = 1e4
poisson_ratio = 0.4
density = 1000
[[fix]]
where = "y-min"
[[cut]]
box = [[0, 0, 0], [0.5, 0.5, 0.5]]
at = 0
[gravity]
acceleration = [0, -10, 0]
[solver]
duration = 1
)",
                                   R"(
[body]
cells = [2, 2, 1]
cell_size = 0.5
[material]
young_modulus = 1e4
poisson_ratio = 0.3
density = 1000
[[obstacle]]
plane = {point = [0, 0, 0], normal = [0, 1, 0]}
friction = 0.5
[gravity]
acceleration = [1, -10, 0]
[solver]
duration = 1
[output]
energy_balance = true
)"};

SimulationOptions options(Precision precision) {
    SimulationOptions options;
    options.precision = precision;
    options.plan.threads = 1;
    options.plan.instruction_set = InstructionSet::sse2;
    return options;
}

struct Started {
    Scene scene;
    Precision precision;
    CheckpointSections sections;
};

/// One file a process: targets run side by side.
const std::string& path() {
    static const std::string path =
        (std::filesystem::temp_directory_path() / ("hybmss_checkpoint_fuzzer." + std::to_string(getpid()))).string();
    static const int registered = std::atexit([] { std::filesystem::remove(path); });
    (void)registered;
    return path;
}

std::vector<Started> start() {
    std::vector<Started> all;
    for (const char* text : kScenes) {
        for (const Precision precision : {Precision::float32, Precision::float64}) {
            Started started{parse_scene(text, "scene.toml"), precision, {}};
            Simulation simulation(started.scene, options(precision));
            simulation.step(2);
            simulation.write_checkpoint(path());
            started.sections = read_checkpoint_file(path());
            all.push_back(std::move(started));
        }
    }
    return all;
}

void go_on(const Started& started) {
    try {
        Simulation simulation = Simulation::restarted(started.scene, options(started.precision), path());
        simulation.step(2);
    } catch (const std::invalid_argument& error) {
        fuzz::require_one_line(error.what());
    } catch (const SceneError& error) {
        fuzz::require_one_line(error.what());
    }
}

void write(std::string_view bytes) {
    std::ofstream(path(), std::ios::binary | std::ios::trunc) << bytes;
}

void change(FuzzedDataProvider& given, CheckpointSections& sections) {
    std::vector<std::string> names;
    for (const auto& [name, bytes] : sections.all()) {
        names.push_back(name);
    }
    while (given.remaining_bytes() > 0) {
        const std::string name = given.PickValueInArray({0, 1, 2, 3, 4, 5, 6, 7}) == 0
                                     ? given.ConsumeRandomLengthString(20)
                                     : names[given.ConsumeIntegralInRange<std::size_t>(0, names.size() - 1)];
        std::string bytes = sections.has(name) ? sections.text(name) : std::string();
        switch (given.ConsumeIntegralInRange(0, 3)) {
        case 0:
            bytes = given.ConsumeRandomLengthString(64);
            break;
        case 1:
            bytes.resize(given.ConsumeIntegralInRange<std::size_t>(0, bytes.size() + 16));
            break;
        case 2: // a number of 8 bytes
            if (bytes.size() >= 8) {
                const std::size_t at = 8 * given.ConsumeIntegralInRange<std::size_t>(0, bytes.size() / 8 - 1);
                const std::uint64_t number = given.ConsumeIntegral<std::uint64_t>();
                bytes.replace(at, 8, reinterpret_cast<const char*>(&number), 8);
            }
            break;
        default:
            if (!bytes.empty()) {
                bytes[given.ConsumeIntegralInRange<std::size_t>(0, bytes.size() - 1)] =
                    static_cast<char>(given.ConsumeIntegral<std::uint8_t>());
            }
        }
        sections.put(name, bytes);
    }
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::vector<Started> kStarted = start();
    const std::string_view text = fuzz::text(data, size);
    if (text.starts_with("hybmss checkpoint")) {
        write(text);
        go_on(kStarted[0]);
        Digest digest;
        digest.add(text);
        const std::uint64_t value = digest.value();
        write(std::string(text) + std::string(reinterpret_cast<const char*>(&value), sizeof value));
        go_on(kStarted[0]);
        return 0;
    }
    FuzzedDataProvider given(data, size);
    const Started& started = kStarted[given.ConsumeIntegralInRange<std::size_t>(0, kStarted.size() - 1)];
    CheckpointSections sections = started.sections;
    change(given, sections);
    write_checkpoint_file(path(), sections);
    go_on(started);
    return 0;
}
