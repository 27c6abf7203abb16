#include "simulation/scene/scene_keys.hpp"

#include <cmath>

namespace hybmss {
namespace {

// Lengths and accelerations beyond these bounds have no meaning and overflow in float.
bool bounded(double v) {
    return std::abs(v) <= 1e9;
}
bool positive(double v) {
    return v > 0;
}
bool not_negative(double v) {
    return v >= 0;
}
bool count(double v) {
    return v >= 1;
}
bool cell_size(double v) {
    return v >= 1e-6 && v <= 1e6;
}
bool label(double v) {
    return v >= 1 && v <= 255;
}
bool young_modulus(double v) {
    return v > 0 && v <= 1e18;
}
bool poisson_ratio(double v) {
    return v > -1 && v < 0.5;
}
bool density(double v) {
    return v > 0 && v <= 1e12;
}
bool face_diagonal_ratio(double v) {
    return v >= 0 && v <= 1e6;
}
bool stiffening(double v) {
    return v >= 0 && v <= 1e6;
}
bool stiffness_damping(double v) {
    return v >= 0 && v <= 1e9;
}
bool force(double v) {
    return std::abs(v) <= 1e18;
}
bool positive_bounded(double v) {
    return v > 0 && v <= 1e9;
}
bool stiffness(double v) {
    return v > 0 && v <= 1e30;
}
bool load_steps(double v) {
    return v >= 1 && v <= 1e6;
}
bool tolerance(double v) {
    return v > 0 && v <= 0.1;
}
bool degrees(double v) {
    return std::abs(v) <= 36000;
}

constexpr std::string_view kRegionAllowed =
    "\"x-min\", \"x-max\", \"y-min\", \"y-max\", \"z-min\", \"z-max\", {box = [[x, y, z], [x, y, z]]}, "
    "{sphere = {center = [x, y, z], radius = r}} or {node = index}";
constexpr std::string_view kBoxAllowed = "[[x, y, z], [x, y, z]], low corner first, each number at most 1e9 in size";
constexpr std::string_view kAxesAllowed = "a string of one to three different letters of \"xyz\"";

constexpr TableRule kTables[] = {
    {"body", true, false, false,
     "The body, made of cubic cells: a box (`cells` or `size`), the labelled cells of a voxel file (`voxels`), or the "
     "inside of "
     "a "
     "closed surface (`surface`); one of the four."},
    {"material", true, false, false, "One isotropic elastic material."},
    {"label", false, true, false,
     "The stiffness of the cells with one label. Poisson's ratio, density, `face_diagonal_ratio` and `volume_energy` "
     "are those of `[material]` everywhere."},
    {"fix", false, true, false, "Nodes that stay where they are."},
    {"move", false, true, false,
     "Nodes that are led to a final position, smoothly (no jump in velocity or acceleration), and held there. Each "
     "has either `translate` or `rotate`, not both."},
    {"gravity", false, false, false, "A uniform acceleration."},
    {"damping", false, false, false, "What takes energy out."},
    {"load", false, true, false, "A dead force on a region's nodes, in proportion to the cells that they touch."},
    {"cut", false, true, false,
     "Cells that are removed while the body moves, with `symplectic-euler`: those inside a box or a sphere, or behind "
     "a "
     "plane; one of the three. Nodes keep their numbers, see \"Cuts\"."},
    {"obstacle", false, true, false,
     "A rigid obstacle that the body's surface nodes touch, with Coulomb friction. Each has one of `plane`, `sphere` "
     "and "
     "`box`. Solved by symplectic-euler only."},
    {"solver", true, false, false, "How the motion or the equilibrium is computed, and when it ends."},
    {"output", false, false, false, "What `--out` holds, besides the summary and the last state."},
    {"probe", false, true, false, "A region whose support force, torque and displacement are reported."},
    {"cut.behind", false, false, true, "The value of `behind`."},
    {"move.rotate", false, false, true, "The value of `rotate`."},
    {"where", false, false, true, "The value of `where`, unless it names a face of the bounding box. One of:"},
    {"where.sphere", false, false, true, "The value of `sphere`."},
    {"obstacle.plane", false, false, true, "The value of `plane`: the half-space behind it is solid."},
    {"obstacle.sphere", false, false, true, "The value of an obstacle's `sphere`."},
};

using enum KeyKind;

constexpr KeyRule kKeys[] = {
    {{"body", "cells", "3 integers", "", "three integers, each at least 1", "none",
      "a full box of so many cells along x, y and z; its low corner is the origin"},
     counts,
     count},
    {{"body", "size", "3 numbers", "m", "three numbers, each above 0 and at most 1e9", "none",
      "a full box with these edges, a whole number of cells; without `cell_size` its mesh is chosen by "
      "`solver.accuracy`"},
     vector,
     positive_bounded},
    {{"body", "voxels", "string", "", "the path of a NumPy (.npy) or NRRD file, from the scene's folder on", "none",
      "cells with a label above 0; the grid's low corner is the origin"},
     text},
    {{"body", "surface", "string", "", "the path of an STL or OBJ file, from the scene's folder on", "none",
      "cells whose centre lies inside the surface, in its own coordinates (m)"},
     text},
    {{"body", "cell_size", "number", "m", "at least 1e-6 and at most 1e6",
      "that of an NRRD file with spacings; free for a `size` with `solver.accuracy`; else required", "edge of a cell"},
     number,
     cell_size},

    {{"material", "young_modulus", "number", "Pa", "above 0 and at most 1e18", "required", "Young's modulus E"},
     number,
     young_modulus},
    {{"material", "poisson_ratio", "number", "", "inside (-1, 0.5), both ends excluded", "required",
      "Poisson's ratio nu"},
     number,
     poisson_ratio},
    {{"material", "density", "number", "kg/m^3", "above 0 and at most 1e12", "required", "mass per volume at rest"},
     number,
     density},
    {{"material", "face_diagonal_ratio", "number", "", "at least 0 and at most 1e6", "1",
      "A = k_f / k_c; 0 leaves the face diagonals out (HybMSS-FD)"},
     number,
     face_diagonal_ratio},
    {{"material", "volume_energy", "string", "", "\"automatic\", \"quadratic\", \"mean_stretch\" or \"none\"",
      "\"automatic\"",
      "energy of the volume ratio J; `automatic`: quadratic at nu >= 1/4, mean stretch below; `none`: springs only "
      "(HybMSS-CF)"},
     choice,
     nullptr,
     "automatic quadratic mean_stretch none"},
    {{"material", "stiffening_quadratic", "number", "",
      "from -r to r, r = sqrt(3 stiffening_cubic), or to (1 + 3 stiffening_cubic)/2 where stiffening_cubic <= 1/3", "0",
      "a: springs stiffen (or soften) with their strain e, force k l (e + a e^2 + b e^3); see \"Stiffening springs\""},
     number},
    {{"material", "stiffening_cubic", "number", "", "at least 0 and at most 1e6", "0",
      "b: likewise; stretched and pressed alike"},
     number,
     stiffening},

    {{"label", "value", "integer", "", "an integer from 1 to 255, different for each label", "required",
      "the label in the voxel file"},
     integer,
     label},
    {{"label", "young_modulus", "number", "Pa", "0, or from 1e-6 to 1e6 times that of [material]", "required",
      "Young's modulus of its cells; 0 leaves them out"},
     number,
     not_negative},

    {{"fix", "where", "region", "", kRegionAllowed, "required", "the nodes held"}, region},
    {{"fix", "axes", "string", "", kAxesAllowed, "\"xyz\"", "axes along which they are held; the others stay free"},
     axes},

    {{"move", "where", "region", "", kRegionAllowed, "required", "the nodes moved"}, region},
    {{"move", "axes", "string", "", kAxesAllowed, "\"xyz\"", "axes along which they are led; the others stay free"},
     axes},
    {{"move", "translate", "3 numbers", "m", "three numbers, each at most 1e9 in size", "none", "final displacement"},
     vector,
     bounded},
    {{"move", "rotate", "table", "", "{axis = \"x\", \"y\" or \"z\", degrees = angle}", "none",
      "final turn about the axis through the region's rest centroid"},
     table},
    {{"move", "over", "number", "s", "at least 0", "1", "time from rest to the final position; 0: at once"},
     number,
     not_negative},

    {{"gravity", "acceleration", "3 numbers", "m/s^2", "three numbers, each at most 1e9 in size", "required",
      "acts on every node"},
     vector,
     bounded},

    {{"damping", "mass", "number", "1/s", "at least 0", "0", "c: the force -c m v on every node"},
     number,
     not_negative},
    {{"damping", "stiffness", "number", "s", "at least 0 and at most 1e9", "0",
      "beta: a dashpot beta k along every spring of stiffness k (Kelvin-Voigt); makes the stable time step smaller"},
     number,
     stiffness_damping},

    {{"load", "where", "region", "", kRegionAllowed, "required", "the nodes loaded"}, region},
    {{"load", "force", "3 numbers", "N", "three numbers, each at most 1e18 in size", "required",
      "the force in all; it does not turn with the body"},
     vector,
     force},

    {{"cut", "box", "2 x 3 numbers", "m", kBoxAllowed, "none", "cells whose centre is inside it or on its surface"},
     table,
     bounded},
    {{"cut", "sphere", "table", "", "{center = [x, y, z], radius = r}", "none",
      "cells whose centre is inside it or on its surface"},
     table},
    {{"cut", "behind", "table", "", "{point = [x, y, z], normal = [x, y, z]}", "none",
      "cells whose centre is on the plane or on the side that the normal points away from"},
     table},
    {{"cut", "at", "number", "s", "at least 0", "required", "when: at the first step from then on"},
     number,
     not_negative},
    {{"cut", "until", "number", "s", "at least `at`", "none", "with `every`: the last time"}, number, not_negative},
    {{"cut", "every", "number", "s", "above 0, for at most 1e9 times", "none",
      "with `until`: it cuts again, and again, after so long"},
     number,
     positive},
    {{"cut", "velocity", "3 numbers", "m/s", "three numbers, each at most 1e9 in size", "[0, 0, 0]",
      "of the box, the sphere or the plane, which is as given at the time `at`"},
     vector,
     bounded},
    {{"cut", "frame", "string", "", "\"present\" or \"rest\"", "\"present\"",
      "where a cell's centre is taken: where it is then, or where it was at rest"},
     choice,
     nullptr,
     "present rest"},
    {{"obstacle", "name", "string", "", "letters, digits, _ and -; different for each obstacle",
      "\"obstacle_0\" and so on", "its name in the results"},
     text},
    {{"obstacle", "plane", "table", "", "{point = [x, y, z], normal = [x, y, z]}", "none",
      "the half-space behind a plane"},
     table},
    {{"obstacle", "sphere", "table", "", "{center = [x, y, z], radius = r}, r at least the cell size", "none",
      "a ball"},
     table},
    {{"obstacle", "box", "2 x 3 numbers", "m",
      "[[x, y, z], [x, y, z]], low corner first, each number at most 1e9 in size, each edge at least the cell size",
      "none", "a cuboid"},
     table,
     bounded},
    {{"obstacle", "friction", "number", "", "at least 0 and at most 1e9", "0",
      "Coulomb's coefficient, sticking and sliding"},
     number,
     [](double v) { return v >= 0 && v <= 1e9; }},
    {{"obstacle", "stiffness", "number", "Pa/m", "above 0 and at most 1e30",
      "density cell_size / (2 dt^2), dt the body's own stable step",
      "pressure by depth on a flat surface; a stiffer "
      "one makes the stable time step shorter"},
     number,
     stiffness},
    {{"obstacle", "translate", "3 numbers", "m", "three numbers, each at most 1e9 in size", "none",
      "how far it is led, as in [[move]]"},
     vector,
     bounded},
    {{"obstacle", "rotate", "table", "", "{axis = \"x\", \"y\" or \"z\", degrees = angle}", "none",
      "how far it is turned about its point or middle, as in [[move]]"},
     table},
    {{"obstacle", "over", "number", "s", "at least 0", "1", "time of translate and rotate; 0: at once"},
     number,
     not_negative},
    {{"obstacle", "velocity", "3 numbers", "m/s", "three numbers, each at most 1e9 in size", "[0, 0, 0]",
      "a constant velocity, besides"},
     vector,
     bounded},

    {{"solver", "method", "string", "", "\"symplectic-euler\", \"backward-euler\" or \"static\"",
      "\"symplectic-euler\"",
      "semi-implicit Euler, explicit in time; backward Euler, stable at any step; or the equilibrium alone"},
     choice,
     nullptr,
     "symplectic-euler backward-euler static"},
    {{"solver", "time_step", "number", "s",
      "above 0; for symplectic-euler at most the stable time step, which `hybmss explain` prints",
      "0.7 of the stable one; 20 times that for backward-euler", "length of a step; not used by static"},
     number,
     positive},
    {{"solver", "duration", "number", "s", "above 0", "none", "simulated time, at most; required unless static"},
     number,
     positive},
    {{"solver", "tolerance", "number", "", "above 0 and at most 0.1", "none; static: 1e-8, float 1e-4",
      "in time: given, the run ends as soon as the body has settled; see \"Settled\". Static: bound of the residual"},
     number,
     tolerance},
    {{"solver", "accuracy", "number", "", "at least 1e-9 and at most 0.1", "none",
      "static: the relative error wanted of the results; chooses float or double, the tolerance and, where the body "
      "leaves it free, the mesh, see \"Accuracy\""},
     number,
     [](double v) { return v >= 1e-9 && v <= 0.1; }},
    {{"solver", "load_steps", "integer", "", "an integer, at least 1 and at most 1e6", "1",
      "static: the first load step is one part in so many of the loading; those after it grow while they find "
      "equilibria"},
     integer,
     load_steps},
    {{"solver", "preconditioner", "string", "", "\"automatic\", \"block-jacobi\" or \"multigrid\"", "\"automatic\"",
      "of the linear solves in static and backward-euler"},
     choice,
     nullptr,
     "automatic block-jacobi multigrid"},

    {{"output", "every", "number", "s", "above 0", "first and last state only", "time between results"},
     number,
     positive},

    {{"output", "energy_balance", "boolean", "", "true or false", "false",
      "meter works and losses in every step, which makes it several times slower; symplectic-euler only"},
     boolean},

    {{"probe", "name", "string", "", "letters, digits, _ and -; different for each probe", "required",
      "its name in the results"},
     text},
    {{"probe", "where", "region", "", kRegionAllowed, "required", "the nodes read"}, region},

    {{"cut.behind", "point", "3 numbers", "m", "three numbers, each at most 1e9 in size", "required",
      "a point of the plane"},
     vector,
     bounded},
    {{"cut.behind", "normal", "3 numbers", "", "three numbers, not all zero, each at most 1e9 in size", "required",
      "its normal, of any length"},
     vector,
     bounded},

    {{"move.rotate", "axis", "string", "", "\"x\", \"y\" or \"z\"", "required", "direction of the axis"},
     choice,
     nullptr,
     "x y z"},
    {{"move.rotate", "degrees", "number", "degrees", "at most 36000 in size", "required",
      "counter-clockwise as seen against the axis"},
     number,
     degrees},

    {{"where", "box", "2 x 3 numbers", "m", kBoxAllowed, "none", "nodes inside it or on its surface"}, table, bounded},
    {{"where", "sphere", "table", "", "{center = [x, y, z], radius = r}", "none", "nodes inside it or on its surface"},
     table},
    {{"where", "node", "integer", "", "an integer, at least 0 and below the number of nodes", "none",
      "one node; x fastest, then y, then z"},
     integer,
     not_negative},

    {{"where.sphere", "center", "3 numbers", "m", "three numbers, each at most 1e9 in size", "required", "its centre"},
     vector,
     bounded},
    {{"where.sphere", "radius", "number", "m", "at least 0 and at most 1e9", "required", "its radius"},
     number,
     [](double v) { return v >= 0 && v <= 1e9; }},

    {{"obstacle.plane", "point", "3 numbers", "m", "three numbers, each at most 1e9 in size", "required",
      "a point of it"},
     vector,
     bounded},
    {{"obstacle.plane", "normal", "3 numbers", "", "three numbers, not all 0, each at most 1e9 in size", "required",
      "points to the side of the body; of any length"},
     vector,
     bounded},

    {{"obstacle.sphere", "center", "3 numbers", "m", "three numbers, each at most 1e9 in size", "required",
      "its middle"},
     vector,
     bounded},
    {{"obstacle.sphere", "radius", "number", "m", "above 0 and at most 1e9", "required", "its radius"},
     number,
     positive_bounded},
};

} // namespace

std::span<const KeyRule> key_rules() {
    return kKeys;
}

std::span<const TableRule> table_rules() {
    return kTables;
}

} // namespace hybmss
