#include "simulation/scene/scene_ranges.hpp"

#include "simulation/scene/scene_keys.hpp"

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace hybmss {
namespace {

/// Checks the numbers of one table of a scene.
class Ranges {
public:
    /// `path` is the table's place: "fix[1]", "move[0].rotate".
    Ranges(const Scene& scene, const char* table, std::string path)
        : scene_(scene), table_(table), path_(std::move(path)) {}

    void check(const char* key, double value) const {
        const KeyRule& rule = *find_key_rule(table_, key);
        if (!std::isfinite(value) || (rule.valid && !rule.valid(value))) {
            refuse(key, value, std::string(rule.key.allowed));
        }
    }
    void check(const char* key, const std::optional<double>& value) const {
        if (value) {
            check(key, *value);
        }
    }
    void check(const char* key, const std::array<double, 3>& values) const {
        for (const double value : values) {
            check(key, value);
        }
    }
    void finite(const char* key, const std::array<double, 3>& values) const {
        for (const double value : values) {
            if (!(std::abs(value) <= 1e9)) {
                refuse(key, value, "at most 1e9 in size");
            }
        }
    }
    void axis(const char* key, int value) const {
        if (value < 0 || value > 2) {
            refuse(key, value, "0, 1 or 2: x, y or z");
        }
    }
    void axes(AxisSet value) const {
        if (value < 1 || value > kAllAxes) {
            refuse("axes", value, "1 to 7: a bit for each of x, y and z");
        }
    }
    void box(const char* key, const BoxRegion& box) const {
        finite(key, box.low);
        finite(key, box.high);
    }
    void sphere(const char* key, const SphereRegion& sphere) const {
        finite(key, sphere.center);
        if (!(sphere.radius > 0 && sphere.radius <= 1e9)) {
            refuse(key, sphere.radius, "a radius above 0 and at most 1e9");
        }
    }
    void where(const Region& region) const {
        if (const auto* face = std::get_if<FaceRegion>(&region)) {
            axis("where", face->axis);
        } else if (const auto* in_box = std::get_if<BoxRegion>(&region)) {
            box("where", *in_box);
        } else if (const auto* in_sphere = std::get_if<SphereRegion>(&region)) {
            sphere("where", *in_sphere);
        }
    }
    [[noreturn]] void refuse(const char* key, double value, const std::string& allowed) const {
        char number[32];
        std::snprintf(number, sizeof number, "%g", value);
        throw scene_error(scene_, path_ + "." + key, std::string(number) + " is not allowed: it must be " + allowed);
    }

private:
    const Scene& scene_;
    const char* table_;
    std::string path_;
};

std::string numbered(const char* table, std::size_t number) {
    return std::string(table) + "[" + std::to_string(number) + "]";
}

void check_rotation(const Scene& scene, const std::string& path, const Rotation& rotation) {
    const Ranges rotate(scene, "move.rotate", path + ".rotate");
    rotate.axis("axis", rotation.axis);
    rotate.check("degrees", rotation.degrees);
}

void check_cut(const Ranges& table, const Cut& cut) {
    if (const auto* box = std::get_if<BoxRegion>(&cut.tool)) {
        table.box("box", *box);
    } else if (const auto* sphere = std::get_if<SphereRegion>(&cut.tool)) {
        table.sphere("sphere", *sphere);
    } else {
        const HalfSpace& half = std::get<HalfSpace>(cut.tool);
        table.finite("behind", half.point);
        table.finite("behind", half.normal);
    }
    table.check("velocity", cut.velocity);
    table.check("at", cut.at);
    if (cut.every != 0) {
        table.check("every", cut.every);
        if (!(cut.until >= cut.at)) {
            table.refuse("until", cut.until, "at least `at`");
        }
        if ((cut.until - cut.at) / cut.every > 1e9) {
            table.refuse("every", cut.every, "at least a 1e9th of the time between `at` and `until`");
        }
    }
}

} // namespace

Scene within_ranges(Scene scene) {
    const Ranges body(scene, "body", "body");
    if (scene.body.cell_size != 0) { // free
        body.check("cell_size", scene.body.cell_size);
    }
    body.finite("origin", scene.body.origin);
    const Ranges material(scene, "material", "material");
    material.check("young_modulus", scene.material.young_modulus);
    material.check("poisson_ratio", scene.material.poisson_ratio);
    material.check("density", scene.material.density);
    material.check("face_diagonal_ratio", scene.material.face_diagonal_ratio);
    material.check("stiffening_quadratic", scene.material.stiffening.quadratic);
    material.check("stiffening_cubic", scene.material.stiffening.cubic);
    for (std::size_t i = 0; i < scene.labels.size(); ++i) {
        const Ranges label(scene, "label", numbered("label", i));
        label.check("young_modulus", scene.labels[i].young_modulus);
    }
    for (std::size_t i = 0; i < scene.fixes.size(); ++i) {
        const Ranges fix(scene, "fix", numbered("fix", i));
        fix.where(scene.fixes[i].where);
        fix.axes(scene.fixes[i].axes);
    }
    for (std::size_t i = 0; i < scene.moves.size(); ++i) {
        const Move& given = scene.moves[i];
        const Ranges move(scene, "move", numbered("move", i));
        move.where(given.where);
        move.axes(given.axes);
        move.check("over", given.over);
        if (const auto* rotation = std::get_if<Rotation>(&given.motion)) {
            check_rotation(scene, numbered("move", i), *rotation);
        } else {
            move.check("translate", std::get<0>(given.motion));
        }
    }
    Ranges(scene, "gravity", "gravity").check("acceleration", scene.gravity.acceleration);
    const Ranges damping(scene, "damping", "damping");
    damping.check("mass", scene.damping.mass);
    damping.check("stiffness", scene.damping.stiffness);
    for (std::size_t i = 0; i < scene.loads.size(); ++i) {
        const Ranges load(scene, "load", numbered("load", i));
        load.where(scene.loads[i].where);
        load.check("force", scene.loads[i].force);
    }
    for (std::size_t i = 0; i < scene.cuts.size(); ++i) {
        check_cut(Ranges(scene, "cut", numbered("cut", i)), scene.cuts[i]);
    }
    for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
        const SceneObstacle& given = scene.obstacles[i];
        const Ranges obstacle(scene, "obstacle", numbered("obstacle", i));
        obstacle.finite("position", given.position);
        obstacle.check("friction", given.friction);
        obstacle.check("stiffness", given.stiffness);
        obstacle.check("over", given.over);
        obstacle.check("velocity", given.velocity);
        if (given.translate) {
            obstacle.check("translate", *given.translate);
        }
        if (given.rotate) {
            check_rotation(scene, numbered("obstacle", i), *given.rotate);
        }
    }
    for (std::size_t i = 0; i < scene.probes.size(); ++i) {
        Ranges(scene, "probe", numbered("probe", i)).where(scene.probes[i].where);
    }
    const Ranges solver(scene, "solver", "solver");
    if (scene.solver.method != SolverMethod::static_equilibrium) {
        solver.check("duration", scene.solver.duration);
    }
    solver.check("time_step", scene.solver.time_step);
    solver.check("tolerance", scene.solver.tolerance);
    solver.check("accuracy", scene.solver.accuracy);
    solver.check("load_steps", scene.solver.load_steps);
    Ranges(scene, "output", "output").check("every", scene.output.every);
    return scene;
}

} // namespace hybmss
