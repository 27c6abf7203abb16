#include "simulation/scene/scene_obstacle.hpp"

#include <utility>

namespace hybmss {
namespace {

void read_shape(SceneObstacle& obstacle, Scene& scene, const SceneTable& table) {
    const int given = table.has("plane") + table.has("sphere") + table.has("box");
    if (given == 0) {
        throw table.missing("plane", "or sphere or box must be given");
    }
    if (given > 1) {
        throw scene_error(scene, table.path(table.has("box") ? "box" : "sphere"),
                          "only one of plane, sphere and box may be given");
    }
    if (table.has("plane")) {
        const SceneTable plane = table.inner("plane", "obstacle.plane");
        const std::array<double, 3> normal = plane.vector("normal");
        if (normal == std::array<double, 3>{0, 0, 0}) {
            throw plane.not_allowed("normal");
        }
        obstacle.shape = PlaneShape{normal};
        obstacle.position = plane.vector("point");
    } else if (table.has("sphere")) {
        const SceneTable sphere = table.inner("sphere", "obstacle.sphere");
        obstacle.shape = SphereShape{sphere.number("radius")};
        obstacle.position = sphere.vector("center");
    } else {
        const BoxRegion box = table.box("box");
        BoxShape shape;
        for (std::size_t a = 0; a < 3; ++a) {
            shape.size[a] = box.high[a] - box.low[a];
            obstacle.position[a] = (box.low[a] + box.high[a]) / 2;
        }
        obstacle.shape = shape;
    }
}

} // namespace

void read_obstacle(Scene& scene, const SceneTable& table) {
    SceneObstacle obstacle;
    read_shape(obstacle, scene, table);
    obstacle.name = "obstacle_" + std::to_string(scene.obstacles.size());
    if (table.has("name")) {
        obstacle.name = table.name("name");
    }
    for (const SceneObstacle& other : scene.obstacles) {
        if (other.name == obstacle.name) {
            throw table.has("name")
                ? table.not_allowed("name")
                : scene_error(scene, table.path("name"), "missing; another [[obstacle]] is named " + obstacle.name);
        }
    }
    if (table.has("friction")) {
        obstacle.friction = table.number("friction");
    }
    if (table.has("stiffness")) {
        obstacle.stiffness = table.number("stiffness");
    }
    if (table.has("translate")) {
        obstacle.translate = table.vector("translate");
    }
    if (table.has("rotate")) {
        const SceneTable rotation = table.inner("rotate", "move.rotate");
        obstacle.rotate = Rotation{rotation.choice("axis")[0] - 'x', rotation.number("degrees")};
    }
    if (table.has("over")) {
        obstacle.over = table.number("over");
    }
    if (table.has("velocity")) {
        obstacle.velocity = table.vector("velocity");
    }
    scene.obstacles.push_back(std::move(obstacle));
}

} // namespace hybmss
