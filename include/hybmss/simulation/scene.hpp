#pragma once

/// \file
/// A scene: one body, what holds, moves and loads it, and how it is solved. Plain data; read from TOML or filled by
/// hand.

#include "hybmss/contact.hpp"
#include "hybmss/equilibrium.hpp"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/polyhedra.hpp"
#include "hybmss/skin.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hybmss {

/// What is wrong with a scene, in one line: `FILE:LINE:COLUMN: key = value: what is allowed`.
class SceneError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A face of the bounding box of the body's nodes.
struct FaceRegion {
    int axis = 0;      ///< 0: x, 1: y, 2: z
    bool high = false; ///< the high side
    bool operator==(const FaceRegion&) const = default;
};
/// The nodes inside an axis-aligned box, its surface included; m.
struct BoxRegion {
    std::array<double, 3> low = {0, 0, 0}, high = {0, 0, 0};
    bool operator==(const BoxRegion&) const = default;
};
/// The nodes inside a sphere, its surface included; m.
struct SphereRegion {
    std::array<double, 3> center = {0, 0, 0};
    double radius = 0;
    bool operator==(const SphereRegion&) const = default;
};
/// One node by its index in the body's node order.
struct NodeRegion {
    std::int64_t node = 0;
    bool operator==(const NodeRegion&) const = default;
};
struct RegionWithout;
/// Which nodes something acts on, at rest.
using Region = std::variant<FaceRegion, BoxRegion, SphereRegion, NodeRegion, RegionWithout>;
/// The nodes of one region that are in none of others.
struct RegionWithout {
    std::vector<Region> of; ///< one
    std::vector<Region> without;
    bool operator==(const RegionWithout& other) const;
};

/// Bit 0: x, bit 1: y, bit 2: z.
using AxisSet = std::uint8_t;
inline constexpr AxisSet kAllAxes = 7;

/// A turn about an axis through what its owner says: of a Move the rest centroid of the moved nodes.
struct Rotation {
    int axis = 1; ///< 0: x, 1: y, 2: z
    double degrees = 0;
    bool operator==(const Rotation&) const = default;
};

/// Where a body begins. Regions are those of the body that is moved and not turned yet.
struct Place {
    std::array<double, 3> translate = {0, 0, 0}; ///< m
    std::optional<Rotation> rotate = {};         ///< then, about the middle of its grid; not in static scenes
    bool operator==(const Place&) const = default;
};

/// What cells a body has: cubes of a grid; those that fill the cubes of a box, or stand in their place, with springs
/// that are isotropic (tetrahedron_lattice() and the like); those of a mesh, with fitted springs.
enum class SceneCells : std::uint8_t { cubes, tetrahedra, pyramids, prisms, mesh };

/// Cubic cells of one grid: all of them, or those that have a label. Or cells of another shape.
struct SceneBody {
    std::array<std::int64_t, 3> cells = {1, 1, 1}; ///< of the grid, along x, y and z
    double cell_size = 1; ///< m; 0: free, to be chosen by solve_to_accuracy() for a box of the given size
    std::array<double, 3> origin = {0, 0, 0}; ///< low corner of the grid, m, with place.translate
    std::array<double, 3> size = {0, 0, 0};   ///< of a full box, m; zero where `cells` tell
    /// One a cell of the grid, x fastest, then y, then z; 0 = no cell there. Empty: every cell, of one material.
    std::vector<std::uint8_t> labels = {};
    bool fractions = false; ///< cells that the surface cuts have the part of their volume that is inside
    /// Where `fractions`: of each cell, the part of a whole one's stiffness and mass that it has.
    std::vector<float> fills = {};
    /// Where `fractions` and labels have surfaces: of each cell the label whose surface reaches it, 0 for none, and the
    /// part of the cell that is inside, in 64ths. Empty where there is none.
    std::vector<std::uint8_t> inclusion = {}, inclusion_part = {};
    double surface_volume = 0; ///< m^3 inside the surface; 0 without one
    std::string voxels = {},
                surface = {};   ///< the file that the labels come from, as the scene names it; "" where there is none
    std::string resampled = {}; ///< what became of voxels that are no cubes; "" of others
    SceneCells shape = SceneCells::cubes;
    std::string mesh_file = {}; ///< the file that `cell_mesh` comes from, as the scene names it
    CellMesh cell_mesh = {};    ///< of SceneCells::mesh, whose cell_size is what a node has of volume, as a cube's edge
    double most_anisotropy = 0.1; ///< that its springs may have, and their error in the shear modulus
    TriangleMesh mesh = {}; ///< of that surface, from the grid's low corner on; none unless a skin or a traction asks
    bool skin_touches = false; ///< obstacles: the body's surface, or the smooth boundary of its cells; else its nodes
    Place place = {};
    bool operator==(const SceneBody&) const = default;
};

/// The material of the cells with one label. What it does not tell is the scene's.
struct Label {
    std::uint8_t value = 1;
    double young_modulus = 1;                 ///< Pa; 0: these cells are left out
    std::optional<double> poisson_ratio = {}; ///< with springs on means, only that of the scene
    std::optional<double> density = {};       ///< kg/m^3
    std::string surface = {}; ///< a file: cells inside get this label; "" where the body's own file tells
    bool operator==(const Label&) const = default;
};

/// Nodes that stay where they are along the named axes.
struct Fix {
    Region where;
    AxisSet axes = kAllAxes;
    bool operator==(const Fix&) const = default;
};

/// Nodes that are led from rest to a final position, along the named axes.
struct Move {
    Region where;
    AxisSet axes = kAllAxes;
    std::variant<std::array<double, 3>, Rotation> motion; ///< a translation in m, or a rotation
    double over = 1;                                      ///< s from rest to the final position; 0: at once
    bool operator==(const Move&) const = default;
};

/// The velocity with which nodes begin, the sum of both. A node has that of the last Start that holds it.
struct Start {
    std::optional<Region> where;                        ///< none: the whole body
    std::array<double, 3> velocity = {0, 0, 0};         ///< m/s
    std::array<double, 3> angular_velocity = {0, 0, 0}; ///< rad/s, about the centre of mass of the nodes
    bool operator==(const Start&) const = default;
};

/// Rows of a time (s), x, y and z, times ascending. Linear between rows, held before the first and after the last.
using TimeTable = std::vector<std::array<double, 4>>;

/// Likewise of a time and a number.
using NumberTable = std::vector<std::array<double, 2>>;

/// `constant`, or where there is a table its value at a time.
std::array<double, 3> value_at(const std::array<double, 3>& constant, const TimeTable& table, double time);
double value_at(double constant, const NumberTable& table, double time);

struct Gravity {
    std::array<double, 3> acceleration = {0, 0, 0}; ///< m/s^2
    TimeTable acceleration_in_time = {};            ///< in its place, where there are rows
    bool operator==(const Gravity&) const = default;
};

struct Damping {
    double mass = 0;      ///< c in 1/s: the force -c m v on every node
    double stiffness = 0; ///< beta in s: a dashpot beta k along every spring of stiffness k
    bool operator==(const Damping&) const = default;
};

/// What a Load is. All are dead: they do not turn with the body.
enum class LoadKind {
    force,    ///< N in all, over the region's nodes in proportion to the cells that they touch: evenly over a face,
              ///< whose corner nodes take a quarter
    traction, ///< Pa at rest, on the part of the body's surface in the region: that of the triangles that it is made
              ///< from, else the faces of its cells
    moment,   ///< N m about the region's middle: forces on its nodes as a small turn would move them, in proportion
              ///< to the cells that they touch, that have no sum
    acceleration, ///< m/s^2 of the cells whose centre is in the region: gravity of a part
    force_density ///< N/m^3 at rest, on these cells
};

struct Load {
    Region where;
    std::array<double, 3> force = {0, 0, 0}; ///< or what else it is of
    TimeTable force_in_time = {};            ///< in its place, where there are rows
    LoadKind kind = LoadKind::force;
    bool operator==(const Load&) const = default;
};

/// A pressure on the outer faces of cells whose middle at rest is in the region, those around hollows too. It follows
/// them; above zero it pushes into the body. Several on a face add up.
struct Pressure {
    Region where;
    double pressure = 0;               ///< Pa
    NumberTable pressure_in_time = {}; ///< in its place, where there are rows
    bool operator==(const Pressure&) const = default;
};

/// Cells that are of another size at rest, by their axes along the grid: muscles, swelling, growth.
struct Actuate {
    std::optional<std::uint8_t> label;         ///< cells with it
    std::optional<Region> where;               ///< cells whose centre at rest is in it; with a label those of both
    std::array<double, 3> stretch = {1, 1, 1}; ///< of x, y and z
    TimeTable stretch_in_time = {};            ///< in its place, where there are rows
    bool operator==(const Actuate&) const = default;
};

/// The side of a plane that its normal points away from; m.
struct HalfSpace {
    std::array<double, 3> point = {0, 0, 0}, normal = {0, 0, 1}; ///< the normal in any length but zero
    bool operator==(const HalfSpace&) const = default;
};

/// Cells that are removed while the body moves: those whose centre (the mean of its corners) is in the tool, its
/// surface included. The tool bites at the times at, at + every, ... until, and moves meanwhile.
struct Cut {
    std::variant<BoxRegion, SphereRegion, HalfSpace> tool; ///< where it is at the time `at`
    std::array<double, 3> velocity = {0, 0, 0};            ///< of the tool, m/s
    double at = 0;                                         ///< s, at least 0
    double until = 0, every = 0;                           ///< s; no further bites where `every` is 0
    bool at_rest = false;                                  ///< the centre at rest counts, not the present one
    bool separates = false; ///< no cell goes: those part that share a face whose middle is in the tool
    bool operator==(const Cut&) const = default;
};

/// Where an obstacle's hull, mesh or heights come from.
struct ObstacleSource {
    std::string file;   ///< as it stands in the scene; "" where the scene has the data itself
    int cells = 64;     ///< of a mesh's grid
    double spacing = 0; ///< m, of heights
    bool operator==(const ObstacleSource&) const = default;
};

/// A rigid obstacle that the body touches. It moves by `translate` along the way of a Move and by `velocity` all the
/// time; `rotate` turns it about its position.
struct SceneObstacle {
    std::string name;                           ///< in the results
    ObstacleShape shape;                        ///< m
    std::array<double, 3> position = {0, 0, 0}; ///< m, at time 0: a point of the plane, the middle of another
    ObstacleSource source = {};
    double friction = 0;             ///< Coulomb's coefficient
    std::optional<double> stiffness; ///< Pa/m: pressure by depth on a flat surface; by default the body's own
    std::optional<std::array<double, 3>> translate; ///< m
    std::optional<Rotation> rotate;
    double over = 1;                            ///< s of translate and rotate; 0: at once
    std::array<double, 3> velocity = {0, 0, 0}; ///< m/s; of a free one at time 0
    double mass = 0;                            ///< kg; 0: it is led, else free
    std::array<double, 3> inertia = {0, 0, 0};  ///< kg m^2, about its axes; all 0: those of the full shape
    bool operator==(const SceneObstacle&) const = default;
};

/// A named region whose support force and displacement are reported.
struct Probe {
    std::string name;
    Region where;
    bool operator==(const Probe&) const = default;
};

enum class SolverMethod {
    symplectic_euler,   ///< explicit in time: many small steps
    leapfrog,           ///< likewise, of the second order
    backward_euler,     ///< implicit in time: stable at any step, with numerical damping
    static_equilibrium, ///< no time at all: supports and loads at their final values
    modes,              ///< that equilibrium, and the lowest vibrations about it; about rest where nothing loads it
    buckling,           ///< the least factors of loads and moves at which the body at rest gives way, linearly
};

/// "symplectic-euler", "leapfrog", "backward-euler", "static", "modes" or "buckling".
std::string_view name(SolverMethod method);
constexpr bool explicit_in_time(SolverMethod method) {
    return method == SolverMethod::symplectic_euler || method == SolverMethod::leapfrog;
}
/// Of those that know no time.
constexpr bool timeless(SolverMethod method) {
    return method == SolverMethod::static_equilibrium || method == SolverMethod::modes ||
           method == SolverMethod::buckling;
}

struct Solver {
    SolverMethod method = SolverMethod::symplectic_euler;
    std::optional<double> time_step; ///< s; by default chosen by the stable one. Static: not used
    double duration = 0;             ///< s, > 0. Static: not used
    /// Relative. In time, given: the run ends when the body has settled. Static: of the residual; by default 1e-8 in
    /// double, 1e-4 in float.
    std::optional<double> tolerance;
    /// Static: the relative error wanted of the results. Only solve_to_accuracy() looks at it.
    std::optional<double> accuracy;
    int load_steps = 1; ///< static: the first load step is one part in so many
    PreconditionerKind preconditioner = PreconditionerKind::automatic; ///< static and backward Euler
    int count = 6;                                                     ///< of modes or buckling loads
    bool operator==(const Solver&) const = default;
};

/// What triangles are written as.
enum class SkinFile { none, vtp, obj, ply };

struct Output {
    std::optional<double> every; ///< s between results; by default only the first and the last state are written
    bool energy_balance = false; ///< works and losses are metered in every step
    bool mass = false, reaction = false; ///< arrays of the nodes in the .vtu files
    SkinFile skin = SkinFile::none;      ///< a file of triangles beside each .vtu file
    bool smooth = false;                 ///< of cells: their smooth boundary
    bool stress = false;                 ///< arrays of cells and nodes there, and Summary::stress
    bool operator==(const Output&) const = default;
};

/// Where a scene's keys stood in its file, so that errors found later can name the line.
struct SceneSource {
    struct Entry {
        unsigned line = 0, column = 0;
        std::string value; ///< as written
    };
    std::string file;                     ///< "" for a scene that was not read from a text
    std::map<std::string, Entry> entries; ///< by path: "material.density", "fix[1].where"
    std::string canonical; ///< all that the text says, without comments and in one order: equal for equal scenes

    /// Where a scene was read from does not tell it from another.
    bool operator==(const SceneSource&) const { return true; }
};

struct Scene {
    SceneBody body;
    Material material;
    std::vector<Relaxation> relaxation; ///< of the material, in time: see ExplicitDynamics::relax()
    std::optional<double> tear_strain;  ///< of the material: cells part that are stretched by more, see torn_faces()
    std::vector<Label> labels;          ///< none: the body has one label, and it is `material`
    std::vector<Fix> fixes;
    std::vector<Move> moves;
    std::vector<Start> starts;
    Gravity gravity;
    Damping damping;
    std::vector<Load> loads;
    std::vector<Pressure> pressures;
    std::vector<Actuate> actuations;
    std::vector<Cut> cuts;
    std::vector<SceneObstacle> obstacles;
    std::vector<Probe> probes;
    Solver solver;
    Output output;
    SceneSource source;
    bool operator==(const Scene&) const = default;
};

/// Reads a scene from TOML text, and the voxels or the surface that it names: a relative path starts where the file
/// `filename` lies. Throws SceneError.
Scene parse_scene(std::string_view text, const std::string& filename);

/// Reads a scene file. Throws SceneError, also where the file cannot be read.
Scene load_scene(const std::string& path);

/// The scene as TOML text, with every default spelled out: parse_scene() makes an equal scene of it. Files are named as
/// the scene names them. Throws SceneError where labels or an origin come from no file.
std::string to_toml(const Scene& scene);

/// The material of a label's cells, where they are not left out.
Material material_of(const Label& label, const Material& material);

/// The scene itself. Throws SceneError where a number of it is out of its key's range: for scenes filled by hand.
Scene within_ranges(Scene scene);

/// The error "`path` = value: `reason`" with the file and line where the key stood, as far as the scene knows them.
SceneError scene_error(const Scene& scene, const std::string& path, const std::string& reason);

/// All keys as Markdown tables, as docs/report/scene_keys.md holds them.
std::string scene_keys_markdown();

} // namespace hybmss
