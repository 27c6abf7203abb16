/// Scenes that were not read from a text are held to the same ranges, with one clear line.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace hybmss {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Fault {
    const char* told;
    std::function<void(Scene&)> make;
};

TEST(HandFilledScene, every_number_must_be_in_its_keys_range) {
    const std::vector<Fault> faults = {
        {"solver.duration: -1 is not allowed", [](Scene& s) { s.solver.duration = -1; }},
        {"solver.duration: nan is not allowed", [](Scene& s) { s.solver.duration = kNaN; }},
        {"solver.time_step: nan", [](Scene& s) { s.solver.time_step = kNaN; }},
        {"solver.time_step: -0.001", [](Scene& s) { s.solver.time_step = -1e-3; }},
        {"solver.tolerance: -1", [](Scene& s) { s.solver.tolerance = -1; }},
        {"solver.load_steps: 0", [](Scene& s) { s.solver.load_steps = 0; }},
        {"output.every: 0", [](Scene& s) { s.output.every = 0; }},
        {"body.cell_size: -1", [](Scene& s) { s.body.cell_size = -1; }},
        {"body.origin: nan", [](Scene& s) { s.body.origin[1] = kNaN; }},
        {"material.poisson_ratio: 0.6", [](Scene& s) { s.material.poisson_ratio = 0.6; }},
        {"gravity.acceleration: nan", [](Scene& s) { s.gravity.acceleration[2] = kNaN; }},
        {"damping.mass: -1", [](Scene& s) { s.damping.mass = -1; }},
        {"fix.where: 7 is not allowed: it must be 0, 1 or 2", [](Scene& s) { s.fixes[0].where = FaceRegion{7}; }},
        {"fix.axes: 9", [](Scene& s) { s.fixes[0].axes = 9; }},
        {"move.over: nan", [](Scene& s) { s.moves[0].over = kNaN; }},
        {"move.rotate.axis: 5",
         [](Scene& s) {
             s.moves[0].motion = Rotation{5, 10};
         }},
        {"probe.where: -1",
         [](Scene& s) {
             s.probes = {{"p", SphereRegion{{0, 0, 0}, -1}}};
         }},
        {"load.force: inf",
         [](Scene& s) {
             s.loads = {{FaceRegion{}, {INFINITY, 0, 0}}};
         }},
        {"cut.at: nan", [](Scene& s) { s.cuts.emplace_back().at = kNaN; }},
        {"cut.at: -1", [](Scene& s) { s.cuts.emplace_back().at = -1; }},
        {"cut.every: 1e-300", [](Scene& s) { s.cuts.emplace_back().until = 1, s.cuts[0].every = 1e-300; }},
        {"obstacle.friction: -1",
         [](Scene& s) {
             s.obstacles.emplace_back();
             s.obstacles[0].shape = PlaneShape{{0, 1, 0}};
             s.obstacles[0].friction = -1;
         }},
    };
    for (const Fault& fault : faults) {
        Scene scene = parse_scene(test::small_scene(), "s.toml");
        scene.source = {};
        EXPECT_NO_THROW(Simulation{scene});
        fault.make(scene);
        try {
            Simulation simulation(scene);
            ADD_FAILURE() << "accepted: " << fault.told;
        } catch (const SceneError& error) {
            EXPECT_EQ(std::string(error.what()).find(std::string("scene: ") + fault.told), 0u) << error.what();
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
}

/// The square of such a time is 0.
TEST(HandFilledScene, a_motion_may_take_next_to_no_time) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    scene.moves[0].over = 1e-200;
    Simulation simulation(scene);
    simulation.step();
    for (const ProbeReading& probe : simulation.probes()) {
        EXPECT_TRUE(std::isfinite(probe.force[1])) << probe.force[1];
    }
}

/// Its energy is not in the balance: a scene's own cuts are refused with it too.
TEST(HandFilledScene, cells_cannot_be_removed_beside_an_energy_balance) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    scene.output.energy_balance = true;
    scene.solver.tolerance.reset();
    Simulation simulation(scene);
    const std::uint32_t cell[] = {0};
    EXPECT_THROW(simulation.remove_cells(cell), std::invalid_argument);
}

} // namespace
} // namespace hybmss
