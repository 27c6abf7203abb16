// Scenes: read, and where the body is small, made into a simulation that takes a step.

#include "hybmss/simulation/world_simulation.hpp"
#include "simulation/scene/scene_body.hpp"
#include "tests/fuzz/fuzz_input.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace hybmss {

// Takes the place of the library's: what files hold is for other targets, and paths lead anywhere.
void read_body_files(Scene& scene) {
    if (!scene.body.voxels.empty() || !scene.body.surface.empty() ||
        std::any_of(scene.obstacles.begin(), scene.obstacles.end(),
                    [](const SceneObstacle& obstacle) { return !obstacle.source.file.empty(); })) {
        throw SceneError("files are not read here");
    }
}

} // namespace hybmss

using namespace hybmss;

namespace {

/// Cells enough to touch each other on every side.
bool is_small(const SceneBody& body) {
    double cells = 1;
    for (const std::int64_t count : body.cells) {
        cells *= static_cast<double>(count);
    }
    return cells <= 27;
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        std::variant<Scene, WorldScene> read = parse_any_scene(fuzz::text(data, size), "scene.toml");
        SimulationOptions options;
        options.plan.threads = 1;
        if (auto* const world = std::get_if<WorldScene>(&read)) {
            if (world->bodies.size() <= 4 && std::all_of(world->bodies.begin(), world->bodies.end(),
                                                         [](const auto& b) { return is_small(b.scene.body); })) {
                WorldSimulation(std::move(*world), options).step(2);
            }
            return 0;
        }
        Scene scene = std::get<Scene>(std::move(read));
        const bool explicit_steps = explicit_in_time(scene.solver.method);
        if (is_small(scene.body)) {
            Simulation simulation(std::move(scene), options);
            if (explicit_steps) {
                simulation.step(2);
            }
        }
    } catch (const SceneError& error) {
        fuzz::require_one_line(error.what());
    }
    return 0;
}
