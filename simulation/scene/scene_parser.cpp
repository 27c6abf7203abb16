#include "simulation/geometry/body_files.hpp"
#include "simulation/scene/one_line.hpp"
#include "simulation/scene/scene_obstacle.hpp"
#include "simulation/scene/scene_table.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>

namespace hybmss {
namespace {

/// A box by its edges: as many cells as its cell size says, or free.
void read_size(Scene& scene, const SceneTable& table) {
    SceneBody& body = scene.body;
    body.size = table.vector("size");
    body.cell_size = table.has("cell_size") ? table.number("cell_size") : 0;
    for (std::size_t a = 0; a < 3 && body.cell_size > 0; ++a) {
        const double cells = body.size[a] / body.cell_size;
        if (!(cells >= 0.5 && cells < 1e9 && std::abs(cells - std::round(cells)) <= 1e-9 * cells)) {
            throw scene_error(scene, table.path("size"), "each edge must be a whole number of cells of cell_size");
        }
        body.cells[a] = std::llround(cells);
    }
}

void read_body(Scene& scene, const SceneTable& table) {
    const int given = table.has("cells") + table.has("size") + table.has("voxels") + table.has("surface");
    if (given == 0) {
        throw table.missing("cells", "or size, voxels or surface must be given");
    }
    if (given > 1) {
        throw scene_error(scene,
                          table.path(table.has("surface")  ? "surface"
                                     : table.has("voxels") ? "voxels"
                                                           : "size"),
                          "only one of cells, size, voxels and surface may be given");
    }
    if (table.has("size")) {
        read_size(scene, table);
        return;
    }
    if (table.has("cells")) {
        scene.body.cells = table.counts("cells");
    } else if (table.has("voxels")) {
        scene.body.voxels = table.text("voxels");
    } else {
        scene.body.surface = table.text("surface");
    }
    if (table.has("cell_size")) {
        scene.body.cell_size = table.number("cell_size");
    } else if (scene.body.voxels.empty()) {
        throw table.missing("cell_size");
    } else {
        scene.body.cell_size = 0; // the file must tell
    }
}

void read_label(Scene& scene, const SceneTable& table) {
    const Label label = {static_cast<std::uint8_t>(table.integer("value")), table.number("young_modulus")};
    for (const Label& other : scene.labels) {
        if (other.value == label.value) {
            throw table.not_allowed("value");
        }
    }
    scene.labels.push_back(label);
}

void read_material(Scene& scene, const SceneTable& table) {
    Material& material = scene.material;
    material.young_modulus = table.number("young_modulus");
    material.poisson_ratio = table.number("poisson_ratio");
    material.density = table.number("density");
    if (table.has("face_diagonal_ratio")) {
        material.face_diagonal_ratio = table.number("face_diagonal_ratio");
    }
    if (table.has("stiffening_cubic")) {
        material.stiffening.cubic = table.number("stiffening_cubic");
    }
    if (table.has("stiffening_quadratic")) {
        material.stiffening.quadratic = table.number("stiffening_quadratic");
        const StiffeningRange range = quadratic_stiffening(material.stiffening.cubic);
        if (material.stiffening.quadratic < range.least || material.stiffening.quadratic > range.most) {
            std::ostringstream allowed;
            allowed << "with stiffening_cubic = " << material.stiffening.cubic << " it must be in [" << range.least
                    << ", " << range.most << "], so that no spring gives way as it is pulled";
            throw scene_error(scene, table.path("stiffening_quadratic"), allowed.str());
        }
    }
    if (table.has("volume_energy")) {
        const std::string word = table.choice("volume_energy");
        material.volume_energy = word == "quadratic"      ? VolumeEnergy::quadratic
                                 : word == "mean_stretch" ? VolumeEnergy::mean_stretch
                                 : word == "none"         ? VolumeEnergy::none
                                                          : VolumeEnergy::automatic;
    }
}

void read_fix(Scene& scene, const SceneTable& table) {
    scene.fixes.push_back({table.region("where"), table.has("axes") ? table.axes("axes") : kAllAxes});
}

void read_move(Scene& scene, const SceneTable& table) {
    Move move;
    move.where = table.region("where");
    if (table.has("axes")) {
        move.axes = table.axes("axes");
    }
    if (table.has("over")) {
        move.over = table.number("over");
    }
    if (table.has("translate") == table.has("rotate")) {
        throw scene_error(scene, table.path("where"), "its [[move]] must have either translate or rotate");
    }
    if (table.has("translate")) {
        move.motion = table.vector("translate");
    } else {
        const SceneTable rotation = table.inner("rotate", "move.rotate");
        move.motion = Rotation{rotation.choice("axis")[0] - 'x', rotation.number("degrees")};
    }
    scene.moves.push_back(std::move(move));
}

void read_gravity(Scene& scene, const SceneTable& table) {
    scene.gravity = {table.vector("acceleration")};
}

void read_damping(Scene& scene, const SceneTable& table) {
    if (table.has("mass")) {
        scene.damping.mass = table.number("mass");
    }
    if (table.has("stiffness")) {
        scene.damping.stiffness = table.number("stiffness");
    }
}

void read_load(Scene& scene, const SceneTable& table) {
    scene.loads.push_back({table.region("where"), table.vector("force")});
}

void read_cut(Scene& scene, const SceneTable& table) {
    const int given = table.has("box") + table.has("sphere") + table.has("behind");
    if (given != 1) {
        throw scene_error(scene, table.path("at"), "its [[cut]] must have one of box, sphere and behind");
    }
    Cut cut;
    if (table.has("box")) {
        cut.tool = table.box("box");
    } else if (table.has("sphere")) {
        const SceneTable sphere = table.inner("sphere", "where.sphere");
        cut.tool = SphereRegion{sphere.vector("center"), sphere.number("radius")};
    } else {
        const SceneTable plane = table.inner("behind", "cut.behind");
        const HalfSpace half = {plane.vector("point"), plane.vector("normal")};
        if (half.normal == std::array<double, 3>{0, 0, 0}) {
            throw plane.not_allowed("normal");
        }
        cut.tool = half;
    }
    cut.at = cut.until = table.number("at");
    if (table.has("until") != table.has("every")) {
        throw scene_error(scene, table.path(table.has("until") ? "until" : "every"),
                          "until and every must be given together, or neither");
    }
    if (table.has("until")) {
        cut.until = table.number("until");
        cut.every = table.number("every");
        if (!(cut.until >= cut.at) || (cut.until - cut.at) / cut.every > 1e9) {
            throw table.not_allowed(cut.until >= cut.at ? "every" : "until");
        }
    }
    if (table.has("velocity")) {
        cut.velocity = table.vector("velocity");
    }
    cut.at_rest = table.has("frame") && table.choice("frame") == "rest";
    scene.cuts.push_back(cut);
}

void read_solver(Scene& scene, const SceneTable& table) {
    if (table.has("method")) {
        const std::string word = table.choice("method");
        scene.solver.method = word == "static"           ? SolverMethod::static_equilibrium
                              : word == "backward-euler" ? SolverMethod::backward_euler
                                                         : SolverMethod::symplectic_euler;
    }
    if (table.has("duration")) {
        scene.solver.duration = table.number("duration");
    } else if (scene.solver.method != SolverMethod::static_equilibrium) {
        throw table.missing("duration");
    }
    if (table.has("load_steps")) {
        scene.solver.load_steps = static_cast<int>(table.integer("load_steps"));
    }
    if (table.has("accuracy")) {
        scene.solver.accuracy = table.number("accuracy");
        if (scene.solver.method != SolverMethod::static_equilibrium) {
            throw scene_error(scene, table.path("accuracy"),
                              "only a static solve tells its error: method must be \"static\"");
        }
    }
    if (table.has("preconditioner")) {
        scene.solver.preconditioner = parse_preconditioner(table.choice("preconditioner"));
    }
    if (table.has("time_step")) {
        scene.solver.time_step = table.number("time_step");
    }
    if (table.has("tolerance")) {
        scene.solver.tolerance = table.number("tolerance");
    }
}

void read_output(Scene& scene, const SceneTable& table) {
    if (table.has("every")) {
        scene.output.every = table.number("every");
    }
    if (table.has("energy_balance")) {
        scene.output.energy_balance = table.boolean("energy_balance");
    }
}

void read_probe(Scene& scene, const SceneTable& table) {
    Probe probe{table.name("name"), table.region("where")};
    for (const Probe& other : scene.probes) {
        if (other.name == probe.name) {
            throw scene_error(scene, table.path("name"), "another [[probe]] has this name; each must have its own");
        }
    }
    scene.probes.push_back(std::move(probe));
}

void read_table(Scene& scene, std::string_view name, const SceneTable& table) {
    static const std::map<std::string_view, void (*)(Scene&, const SceneTable&)> readers = {
        {"body", read_body},   {"material", read_material}, {"label", read_label},     {"fix", read_fix},
        {"move", read_move},   {"gravity", read_gravity},   {"damping", read_damping}, {"load", read_load},
        {"cut", read_cut},     {"obstacle", read_obstacle}, {"solver", read_solver},   {"output", read_output},
        {"probe", read_probe},
    };
    readers.at(name)(scene, table);
}

void read_scene(Scene& scene, const TomlText& text, const toml::table& root) {
    for (const auto& [key, value] : root) {
        const std::string name(key.str());
        const TableRule* rule = find_table_rule(name);
        const bool known = rule && !rule->inner;
        const bool fits = known && (rule->repeated ? value.is_array_of_tables() : value.is_table());
        if (!fits) {
            SceneSource::Entry entry = text.quote(value.source());
            entry.line = key.source().begin.line;
            entry.column = key.source().begin.column;
            if (value.is_table() || value.is_array_of_tables()) {
                entry.value.clear();
            }
            scene.source.entries[name] = entry;
            throw scene_error(scene, name,
                              !known           ? "unknown table; allowed are " + key_list("")
                              : rule->repeated ? "it must be given as [[" + name + "]], any number of times"
                                               : "it must be a table, [" + name + "]");
        }
    }
    for (const TableRule& rule : table_rules()) {
        const std::string name(rule.name);
        const toml::node* value = rule.inner ? nullptr : root.get(rule.name);
        if (!value) {
            if (rule.required) {
                scene.source.entries[name] = {1, 1, {}};
                throw scene_error(scene, name, "missing; a scene needs a table [" + name + "] with " + key_list(name));
            }
            continue;
        }
        if (!rule.repeated) {
            read_table(scene, name, SceneTable(scene, text, *value->as_table(), name, name));
            continue;
        }
        const toml::array& items = *value->as_array();
        for (std::size_t i = 0; i < items.size(); ++i) {
            read_table(scene, name,
                       SceneTable(scene, text, *items.get(i)->as_table(), name, name + "[" + std::to_string(i) + "]"));
        }
    }
}

} // namespace

Scene parse_scene(std::string_view text, const std::string& filename) {
    Scene scene;
    scene.source.file = filename;
    try {
        const toml::table root = toml::parse(text, std::string_view(filename));
        read_scene(scene, TomlText(text), root);
        if (scene.body.size[0] > 0 && scene.body.cell_size == 0 && !scene.solver.accuracy) {
            throw scene_error(scene, "body.size",
                              "its mesh must be told: by cell_size, or by accuracy in [solver], which chooses it");
        }
        std::ostringstream canonical;
        canonical << toml::json_formatter(root);
        scene.source.canonical = canonical.str();
        read_body_files(scene);
    } catch (const toml::parse_error& error) {
        std::ostringstream message;
        message << filename << ":" << error.source().begin.line << ":" << error.source().begin.column
                << ": TOML syntax: " << error.description();
        throw SceneError(one_line(message.str()));
    }
    return scene;
}

Scene load_scene(const std::string& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
        throw SceneError(path + ": is a directory; a scene file (TOML) is needed");
    }
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file.is_open() || file.bad()) {
        throw SceneError(path + ": cannot be read: " + std::generic_category().message(errno));
    }
    return parse_scene(text, path);
}

} // namespace hybmss
