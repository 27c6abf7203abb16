#include "simulation/run/effect_list.hpp"

#include "layouts/messages.hpp"
#include "plan/bodies/critical_time_step.hpp"

#include <algorithm>
#include <limits>

namespace hybmss {
namespace {

bool always(const Scene&) {
    return true;
}
std::string never_absent(const Scene&) {
    return "";
}

bool on_means(const Scene& scene) {
    return scene.material.springs == SpringForm::means;
}
SpringCounts springs_of(const Simulation& s) {
    return springs_of(s.lattice(), s.scene().material);
}
/// Springs of cells that are no cubes are of one kind.
bool of_cubes(const Scene& scene) {
    return scene.body.shape == SceneCells::cubes;
}
std::string edges(const Simulation& s) {
    if (!of_cubes(s.scene())) {
        return printed("%zu: every cell has springs between its nodes", s.describe().springs);
    }
    return printed("%zu: every cell has them", springs_of(s).edges);
}
std::string no_cubes(const Scene&) {
    return "the cells are no cubes";
}
std::string cube_diagonals(const Simulation& s) {
    return printed("%zu: every cell has them", springs_of(s).cube_diagonals);
}
std::string face_diagonals(const Simulation& s) {
    return printed("%zu: face_diagonal_ratio = %g > 0", springs_of(s).face_diagonals,
                   s.scene().material.face_diagonal_ratio);
}
std::string patterns(const Simulation& s) {
    const PatternConstants k = pattern_constants(s.scene().material, s.lattice().cell_size());
    return printed("springs on the means of each cell; its patterns bend with %.3g N/m and twist with %.3g N/m",
                   k.bending, k.twist + k.joint_twist);
}

/// Of the scene's material or a label's.
bool has_volume_force(const Scene& scene) {
    return resolved_volume_energy(scene.material) != VolumeEnergy::none ||
           std::any_of(scene.labels.begin(), scene.labels.end(), [&](const Label& label) {
               return label.young_modulus > 0 &&
                      resolved_volume_energy(material_of(label, scene.material)) != VolumeEnergy::none;
           });
}

std::string volume_force(const Simulation& s) {
    const Material& material = s.scene().material;
    if (of_cubes(s.scene()) && has_own_volumes(s.lattice(), material)) {
        return printed("%s, cell by cell", material.volume_energy == VolumeEnergy::automatic
                                               ? "quadratic energy (poisson_ratio >= 0.25) and mean stretch (below)"
                                           : material.volume_energy == VolumeEnergy::quadratic
                                               ? "quadratic energy (as asked)"
                                               : "mean stretch energy (as asked)");
    }
    const bool quadratic = resolved_volume_energy(material) == VolumeEnergy::quadratic;
    const char* why = material.volume_energy != VolumeEnergy::automatic ? "as asked"
                      : quadratic                                       ? "automatic: poisson_ratio >= 0.25"
                                                                        : "automatic: poisson_ratio < 0.25";
    return printed("%s energy (%s); poisson_ratio = %g makes kappa = %.6g Pa", quadratic ? "quadratic" : "mean stretch",
                   why, material.poisson_ratio, volume_modulus(material));
}

std::string no_volume_force(const Scene& scene) {
    return volume_modulus(scene.material) == 0 ? "kappa = 0 at poisson_ratio = 0.25: the springs alone are right there"
                                               : "volume_energy = \"none\" (HybMSS-CF)";
}

/// A step at a time is taken until its end.
std::string in_time(const TimeTable& table) {
    return printed("a table of %zu rows to %g s", table.size(), table.back()[0]);
}

std::string gravity(const Simulation& s) {
    const Gravity& gravity = s.scene().gravity;
    const double end = std::numeric_limits<double>::infinity();
    const auto g = value_at(gravity.acceleration, gravity.acceleration_in_time, end);
    return (gravity.acceleration_in_time.empty() ? "" : in_time(gravity.acceleration_in_time) + ", in the end ") +
           printed("(%g, %g, %g) m/s^2", g[0], g[1], g[2]);
}

std::string loads(const Simulation& s) {
    std::string text = printed("%zu [[load]]", s.scene().loads.size());
    for (const Load& load : s.scene().loads) {
        text += load.force_in_time.empty() ? "" : ", one by " + in_time(load.force_in_time);
    }
    return text;
}

std::string pressure(const Simulation& s) {
    std::string text = printed("%zu faces, by %zu [[pressure]]", s.pressed_face_count(), s.scene().pressures.size());
    for (const Pressure& pressure : s.scene().pressures) {
        if (!pressure.pressure_in_time.empty()) {
            text += printed(", one by a table of %zu rows to %g s", pressure.pressure_in_time.size(),
                            pressure.pressure_in_time.back()[0]);
        }
    }
    return text;
}

std::string actuation(const Simulation& s) {
    return printed("%zu cells, by %zu [[actuate]]", s.actuated_cell_count(), s.scene().actuations.size());
}

std::string prescribed_motion(const Simulation& s) {
    double over = 0;
    for (const Move& move : s.scene().moves) {
        over = std::max(over, move.over);
    }
    std::string text = printed("%zu nodes, by %zu [[move]]", s.moved_node_count(), s.scene().moves.size());
    if (!timeless(s.scene().solver.method)) {
        text += printed(", over %g s", over);
    }
    return text;
}

std::string contact(const Simulation& s) {
    const std::vector<SceneObstacle>& obstacles = s.scene().obstacles;
    const auto rough =
        std::count_if(obstacles.begin(), obstacles.end(), [](const SceneObstacle& o) { return o.friction > 0; });
    const FittedCells* const other = s.other_cells();
    std::string text =
        printed("%zu surface nodes with %zu [[obstacle]], %td with friction",
                (other ? surface_nodes(other->network) : surface_nodes(s.lattice())).size(), obstacles.size(), rough);
    const FrequencyBounds bounds =
        other ? network_frequencies(other->network) : lattice_frequencies(s.lattice(), s.scene().material);
    const double dt = bounds.critical_time_step();
    text += printed("; stiffness %.3g Pa/m where none is given, taken implicitly, so that it damps",
                    default_contact_stiffness(dt) * s.scene().material.density * s.scene().body.cell_size / 2);
    if (rough > 0) {
        text += printed("; friction follows the pressure within %.3g s", default_friction_delay(dt));
    }
    return text;
}

bool has_own_ratio(const Scene& scene) {
    return scene.material.volume_energy != VolumeEnergy::none &&
           std::any_of(scene.labels.begin(), scene.labels.end(), [&](const Label& label) {
               return label.young_modulus > 0 &&
                      label.poisson_ratio.value_or(scene.material.poisson_ratio) != scene.material.poisson_ratio;
           });
}
std::string volumes_of_tissues(const Simulation& s) {
    std::string text;
    for (std::size_t tissue = 1; tissue <= s.lattice().tissues().size(); ++tissue) {
        const Material own = material_of(s.lattice(), tissue, s.scene().material);
        text += printed("%spoisson_ratio = %g makes kappa = %.3g G", text.empty() ? "" : ", ", own.poisson_ratio,
                        volume_modulus(own) / shear_modulus(own));
    }
    return text;
}

/// The last quarter of the cells is a tissue of its own.
void add_tumour(Scene& scene) {
    const auto cells = static_cast<std::size_t>(scene.body.cells[0] * scene.body.cells[1] * scene.body.cells[2]);
    scene.body.labels.assign(cells, 1);
    std::fill(scene.body.labels.end() - static_cast<std::ptrdiff_t>((cells + 3) / 4), scene.body.labels.end(),
              std::uint8_t{2});
    const double E = scene.material.young_modulus;
    scene.labels = {{1, E, {}, {}}, {2, E, scene.material.poisson_ratio < 0.25 ? 0.45 : 0.1, {}}};
}

/// A rough floor that the body's lower face touches.
std::string contact_of_skin(const Simulation& s) {
    const Scene& scene = s.scene();
    return printed("points of %s with %zu [[obstacle]]",
                   scene.body.surface.empty() ? "the cells' smooth boundary" : scene.body.surface.c_str(),
                   scene.obstacles.size());
}

void add_ground(Scene& scene) {
    SceneObstacle ground;
    ground.shape = PlaneShape{{0, 1, 0}};
    ground.position = scene.body.origin;
    ground.friction = 0.5;
    scene.obstacles.push_back(ground);
}

bool is_free_obstacle(const SceneObstacle& obstacle) {
    return obstacle.mass > 0;
}

/// A ball of a few cells that lies on the body's upper face.
void add_ball(Scene& scene) {
    SceneObstacle ball;
    const double h = scene.body.cell_size, radius = 2 * h;
    ball.name = "ball";
    ball.shape = SphereShape{radius};
    for (std::size_t a = 0; a < 3; ++a) {
        const double extent = h * static_cast<double>(scene.body.cells[a]);
        ball.position[a] = scene.body.origin[a] + (a == 1 ? extent + radius : extent / 2);
    }
    ball.friction = 0.5;
    ball.mass = 30 * scene.material.density * h * h * h;
    scene.obstacles.push_back(ball);
}

constexpr EffectRule kEffects[] = {
    {"edge springs", "every body", "part of the sweep over the cells", "", "3 numbers a node", true, always, edges,
     never_absent, nullptr, nullptr},
    {"cube diagonals", "every body of cubes", "part of the sweep", "", "1 number a node", true, of_cubes,
     cube_diagonals, no_cubes, nullptr, nullptr},
    {"face diagonals", "`material.face_diagonal_ratio` > 0, the default", "a variant of the sweep", "",
     "3 numbers a node", true, [](const Scene& s) { return s.material.face_diagonal_ratio > 0 && of_cubes(s); },
     face_diagonals,
     [](const Scene& s) { return of_cubes(s) ? std::string("face_diagonal_ratio = 0 (HybMSS-FD)") : no_cubes(s); },
     [](Scene& s) { s.material.face_diagonal_ratio = 1; }, [](Scene& s) { s.material.face_diagonal_ratio = 0; }},
    {"springs on means", "`material.springs = \"means\"`", "a sweep of its own", "",
     "1 number a node in place of those of all springs", true, on_means, patterns,
     [](const Scene&) { return std::string("springs = \"nodes\""); },
     [](Scene& s) { s.material.springs = SpringForm::means; },
     [](Scene& s) { s.material.springs = SpringForm::nodes; }},
    {"volume force", "`material.poisson_ratio` other than 1/4, unless `volume_energy = \"none\"`",
     "a variant of the sweep", "", "nothing", true, has_volume_force, volume_force, no_volume_force,
     [](Scene& s) {
         s.material.poisson_ratio = 0.4;
         s.material.volume_energy = VolumeEnergy::automatic;
     },
     [](Scene& s) { s.material.volume_energy = VolumeEnergy::none; }},
    {"volumes of tissues", "`label.poisson_ratio` other than the material's",
     "a sweep over the cells' volumes in place of a variant, and a kick of the velocities", "lattice_volume, kick",
     "4 numbers a node", true, has_own_ratio, volumes_of_tissues,
     [](const Scene&) { return std::string("no label.poisson_ratio, or that of [material]"); }, add_tumour,
     [](Scene& s) {
         for (Label& label : s.labels) {
             label.poisson_ratio.reset();
         }
     }},
    {"stiffening springs", "`material.stiffening_quadratic`, `stiffening_cubic`",
     "a sweep over the springs, and a kick of the velocities", "spring_pass<stiffening>, kick", "3 numbers a node",
     true, [](const Scene& s) { return s.material.stiffening.any(); },
     [](const Simulation& s) {
         const SpringStiffening& law = s.scene().material.stiffening;
         return printed("force k l (e + %g e^2 + %g e^3) at the strain e", law.quadratic, law.cubic);
     },
     [](const Scene&) { return std::string("no material.stiffening_quadratic or stiffening_cubic, or zero"); },
     [](Scene& s) {
         s.material.stiffening = {1, 2};
     },
     [](Scene& s) { s.material.stiffening = {}; }},
    {"crush resistance", "`material.crush_resistance`, `crush_ratio`",
     "a sweep over the cells' volumes, and a kick of the velocities", "lattice_crush, kick", "3 numbers a node", true,
     [](const Scene& s) { return s.material.crush.any(); },
     [](const Simulation& s) {
         const CrushResistance& crush = s.scene().material.crush;
         return printed("G V0 %g (%g - J)^3 / (3 %g^2) in cells below J = %g; the default time step holds down to %g",
                        crush.stiffness, crush.ratio, crush.ratio, crush.ratio, crush.ratio / 2);
     },
     [](const Scene&) { return std::string("no material.crush_resistance, or zero"); },
     [](Scene& s) { s.material.crush.stiffness = 20; }, [](Scene& s) { s.material.crush = {}; }},
    {"gravity", "`[gravity]`", "a variant of the sweep, with mass damping", "", "nothing", true,
     [](const Scene& s) {
         return s.gravity.acceleration != std::array<double, 3>{0, 0, 0} || !s.gravity.acceleration_in_time.empty();
     },
     gravity, [](const Scene&) { return std::string("no [gravity], or zero"); },
     [](Scene& s) {
         s.gravity.acceleration = {0, -10, 0};
     },
     [](Scene& s) { s.gravity = {}; }},
    {"inertia", "a solver in time", "part of the sweep", "", "4 numbers a node: velocities, masses", false, always,
     [](const Simulation& s) { return std::string(name(s.scene().solver.method)); }, never_absent, nullptr, nullptr},
    {"mass damping", "`damping.mass`", "a variant of the sweep, with gravity", "", "nothing", false,
     [](const Scene& s) { return s.damping.mass > 0; },
     [](const Simulation& s) { return printed("%g 1/s", s.scene().damping.mass); },
     [](const Scene&) { return std::string("no damping.mass, or zero"); }, [](Scene& s) { s.damping.mass = 2; },
     [](Scene& s) { s.damping.mass = 0; }},
    {"stiffness damping", "`damping.stiffness`", "a sweep over the springs, and a kick of the velocities",
     "spring_pass<damping>, kick", "3 numbers a node", false, [](const Scene& s) { return s.damping.stiffness > 0; },
     [](const Simulation& s) { return printed("%g s", s.scene().damping.stiffness); },
     [](const Scene&) { return std::string("no damping.stiffness, or zero"); },
     [](Scene& s) { s.damping.stiffness = 1e-4; }, [](Scene& s) { s.damping.stiffness = 0; }},
    {"relaxation", "`material.relaxation`", "a pass over the cells and two over the nodes, before the sweep",
     "relaxing_cells, relaxing_nodes, loops over nodes", "212 bytes a node (float: 108), 48 more by each branch", false,
     [](const Scene& s) { return !s.relaxation.empty(); },
     [](const Simulation& s) {
         std::string text = "moduli are 1";
         for (const Relaxation& branch : s.scene().relaxation) {
             text += printed(" + %g exp(-t / %g s)", branch.part, branch.time);
         }
         return text + " times those of slow loads";
     },
     [](const Scene&) { return std::string("no material.relaxation"); },
     [](Scene& s) {
         s.relaxation = {{0.5, 0.1}};
     },
     [](Scene& s) { s.relaxation.clear(); }},
    {"loads", "`[[load]]`", "a pass over the loaded components", "a loop over components",
     "24 bytes a component (float: 16)", true, [](const Scene& s) { return !s.loads.empty(); }, loads,
     [](const Scene&) { return std::string("no [[load]]"); },
     [](Scene& s) {
         s.loads.push_back({FaceRegion{1, true}, {0, -1, 0}});
     },
     [](Scene& s) { s.loads.clear(); }},
    {"pressure", "`[[pressure]]`", "three passes over the pressed faces and their nodes, and one after the sweep",
     "loops over faces and nodes", "156 bytes a face, 88 a node of them", true,
     [](const Scene& s) { return !s.pressures.empty(); }, pressure,
     [](const Scene&) { return std::string("no [[pressure]]"); },
     [](Scene& s) {
         s.pressures.push_back({BoxRegion{{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}}, 1});
     },
     [](Scene& s) { s.pressures.clear(); }},
    {"actuation", "`[[actuate]]`", "a pass over the actuated cells and one over their nodes, before the sweep",
     "actuated_cells, a loop over nodes", "324 bytes a cell (float: 208), 16 a node of them", true,
     [](const Scene& s) { return !s.actuations.empty(); }, actuation,
     [](const Scene&) { return std::string("no [[actuate]]"); },
     [](Scene& s) {
         s.actuations.push_back({{}, Region(BoxRegion{{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}}), {1, 0.9, 1}});
     },
     [](Scene& s) { s.actuations.clear(); }},
    {"cutting", "`[[cut]]`", "nothing between bites", "", "the removed cells' numbers", false,
     [](const Scene& s) { return !s.cuts.empty(); },
     [](const Simulation& s) { return printed("%zu [[cut]]", s.scene().cuts.size()); },
     [](const Scene&) { return std::string("no [[cut]]"); },
     [](Scene& s) {
         s.cuts.push_back({BoxRegion{{-1, -1, -1}, {0, 0, 0}}, {0, 0, 0}, 1e6});
     },
     [](Scene& s) { s.cuts.clear(); }},
    {"contact", "`[[obstacle]]`", "a pass over the surface nodes that may touch, after the sweep",
     "a loop over surface nodes", "72 bytes a surface node; 32 more by each obstacle with friction", true,
     [](const Scene& s) { return !s.obstacles.empty() && !s.body.skin_touches; }, contact,
     [](const Scene& s) { return std::string(s.obstacles.empty() ? "no [[obstacle]]" : "the skin touches"); },
     add_ground, [](Scene& s) { s.obstacles.clear(); }},
    {"free obstacles", "`mass` of `[[obstacle]]`",
     "a pass over the nodes that may touch, and six equations, at the end", "a loop over surface nodes",
     "392 bytes each, besides those of contact", false,
     [](const Scene& s) { return std::any_of(s.obstacles.begin(), s.obstacles.end(), is_free_obstacle); },
     [](const Simulation& s) {
         const std::vector<SceneObstacle>& obstacles = s.scene().obstacles;
         return printed("%td of %zu [[obstacle]]", std::count_if(obstacles.begin(), obstacles.end(), is_free_obstacle),
                        obstacles.size());
     },
     [](const Scene&) { return std::string("no [[obstacle]] has a mass"); }, add_ball,
     [](Scene& s) { std::erase_if(s.obstacles, is_free_obstacle); }},
    {"contact of the skin", "`[[obstacle]]` and `body.contact` = \"skin\"",
     "a pass over the skin's points that may touch, after the sweep", "a loop over points",
     "440 bytes a point; 56 more by each obstacle", false,
     [](const Scene& s) { return !s.obstacles.empty() && s.body.skin_touches; }, contact_of_skin,
     [](const Scene&) { return std::string("no [[obstacle]], or body.contact = \"nodes\""); },
     [](Scene& s) {
         add_ground(s);
         s.body.skin_touches = true;
     },
     [](Scene& s) {
         s.obstacles.clear();
         s.body.skin_touches = false;
     }},
    {"fixed nodes", "`[[fix]]`", "a pass over the held components", "a loop over components",
     "32 bytes a component (float: 24)", true, [](const Scene& s) { return !s.fixes.empty(); },
     [](const Simulation& s) {
         return printed("%zu nodes, by %zu [[fix]]", s.fixed_node_count(), s.scene().fixes.size());
     },
     [](const Scene&) { return std::string("no [[fix]]"); },
     [](Scene& s) {
         s.fixes.push_back({FaceRegion{1, false}, kAllAxes});
     },
     [](Scene& s) { s.fixes.clear(); }},
    {"prescribed motion", "`[[move]]`", "likewise, and where they go next, once a step", "a loop over components",
     "32 bytes a component (float: 24)", true, [](const Scene& s) { return !s.moves.empty(); }, prescribed_motion,
     [](const Scene&) { return std::string("no [[move]]"); },
     [](Scene& s) {
         s.moves.push_back({FaceRegion{1, true}, kAllAxes, std::array<double, 3>{0, -0.01, 0}, 0});
     },
     [](Scene& s) { s.moves.clear(); }},
};

} // namespace

std::string EffectRule::reason(const Simulation& simulation) const {
    if (in(simulation.scene())) {
        return amount(simulation);
    }
    return asked(simulation.scene()) ? "static: nothing moves" : absence(simulation.scene());
}

std::span<const EffectRule> effect_rules() {
    return kEffects;
}

Scene without(const Scene& scene, const EffectRule& effect) {
    Scene rest = scene;
    effect.remove(rest);
    rest.solver.time_step.reset();
    return rest;
}

std::string effects_markdown() {
    std::string text = "| effect | called for by | in an explicit step | holds | static |\n|---|---|---|---|---|\n";
    for (const EffectRule& effect : kEffects) {
        for (std::string_view cell : {effect.name, effect.called_for, effect.pass, effect.holds,
                                      std::string_view(effect.in_static ? "yes" : "never")}) {
            text.append("| ").append(cell).append(" ");
        }
        text += "|\n";
    }
    return text;
}

} // namespace hybmss
