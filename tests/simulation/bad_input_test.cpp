// Wrong input ends in one clear line; so does a body that is too large, before anything is allocated.

#include "hybmss/simulation/scene.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "simulation/run/memory.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace hybmss {
namespace {

struct BadLine {
    const char* name;
    const char* line; ///< of small_scene()
    const char* replacement;
    const char* message; ///< what the error line holds
};

void PrintTo(const BadLine& bad, std::ostream* out) {
    *out << bad.replacement;
}

const BadLine kBadLines[] = {
    {"SyntaxError", "cell_size = 0.5", "cell_size = ", "s.toml:3:13: TOML syntax"},
    {"SyntaxErrorTable", "[output]", "[# output", "s.toml:20:2: TOML syntax"},
    {"KeyOfTwoLines", "density = 1000", "\"den\\nsity\" = 1000", "material.den sity = 1000: unknown key"},
    {"Duplicate", "cell_size = 0.5", "cells = [1, 1, 1]", "s.toml:3:"},
    {"UnknownKey", "density = 1000", "densty = 1000",
     "s.toml:7:1: material.densty = 1000: unknown key; allowed are young_modulus, poisson_ratio, density"},
    {"UnknownTable", "[output]", "[outputs]",
     "s.toml:20:2: outputs: unknown table; allowed are body, material, label, fix"},
    {"UnknownInnerKey", "where = \"y-min\"", "where = {ball = 3}", "s.toml:9:10: fix.where.ball = 3: unknown key"},
    {"MissingKey", "density = 1000", "", "s.toml:4:1: material.density: missing"},
    {"MissingTable", "[solver]", "", "s.toml:"},
    {"WrongTypeText", "young_modulus = 1e4", "young_modulus = \"soft\"",
     "s.toml:5:17: material.young_modulus = \"soft\": it must be a number at least 1e-9"},
    {"WrongTypeFloatCells", "cells = [2, 3, 4]", "cells = [2, 0.5, 4]",
     "s.toml:2:9: body.cells = [2, 0.5, 4]: it must be three integers, each at least 1"},
    {"ZeroCells", "cells = [2, 3, 4]", "cells = [2, 0, 4]", "s.toml:2:9: body.cells = [2, 0, 4]: it must be"},
    {"TwoCells", "cells = [2, 3, 4]", "cells = [2, 3]", "s.toml:2:9: body.cells = [2, 3]: it must be"},
    {"NoBody", "cells = [2, 3, 4]", "",
     "s.toml:1:1: body.cells: missing; it or size, voxels, surface or mesh must be given"},
    {"TwoBodies", "cells = [2, 3, 4]", "cells = [2, 3, 4]\nvoxels = \"a.npy\"",
     "s.toml:3:10: body.voxels = \"a.npy\": only one of cells, size, voxels, surface and mesh may be given"},
    {"SizeWithoutMesh", "cells = [2, 3, 4]\ncell_size = 0.5", "size = [1, 1.5, 2]",
     "s.toml:2:8: body.size = [1, 1.5, 2]: its mesh must be told: by cell_size, or by accuracy in [solver]"},
    {"SizeInPartsOfCells", "cells = [2, 3, 4]", "size = [1, 1.25, 2]",
     "s.toml:2:8: body.size = [1, 1.25, 2]: each edge must be a whole number of cells"},
    {"SizeAndCells", "cells = [2, 3, 4]", "cells = [2, 3, 4]\nsize = [1, 1.5, 2]",
     "s.toml:3:8: body.size = [1, 1.5, 2]: only one of cells, size, voxels, surface and mesh may be given"},
    {"SizeZero", "cells = [2, 3, 4]", "size = [1, 0, 2]",
     "s.toml:2:8: body.size = [1, 0, 2]: it must be three numbers"},
    {"AccuracyInTime", "tolerance = 1e-4", "accuracy = 1e-3",
     "s.toml:19:12: solver.accuracy = 1e-3: only a static solve tells its error: method must be \"static\""},
    {"AccuracyTooCoarse", "tolerance = 1e-4", "accuracy = 0.5",
     "s.toml:19:12: solver.accuracy = 0.5: it must be at least 1e-9 and at most 0.1"},
    {"AccuracyText", "tolerance = 1e-4", "accuracy = \"high\"",
     "s.toml:19:12: solver.accuracy = \"high\": it must be a number at least 1e-9 and at most 0.1"},
    {"VoxelsNumber", "cells = [2, 3, 4]", "voxels = 3", "s.toml:2:10: body.voxels = 3: it must be the path of a NumPy"},
    {"VoxelsAbsent", "cells = [2, 3, 4]", "voxels = \"a.npy\"",
     "s.toml:2:10: body.voxels = \"a.npy\": it cannot be read"},
    {"SurfaceEmpty", "cells = [2, 3, 4]", "surface = \"\"",
     "s.toml:2:11: body.surface = \"\": it must be the path of an STL"},
    {"SurfaceAbsent", "cells = [2, 3, 4]", "surface = \"a.stl\"", "s.toml:2:11: body.surface = \"a.stl\": "},
    {"NoCellSize", "cell_size = 0.5", "", "s.toml:1:1: body.cell_size: missing; it must be at least 1e-6"},
    {"LabelWithoutStiffness", "[[probe]]", "[[label]]\nvalue = 1\n[[probe]]",
     "s.toml:22:1: label.young_modulus: missing"},
    {"LabelTooLarge", "[[probe]]", "[[label]]\nvalue = 256\nyoung_modulus = 1\n[[probe]]",
     "s.toml:23:9: label.value = 256: it must be an integer from 1 to 255"},
    {"LabelOfBox", "[[probe]]", "[[label]]\nvalue = 1\nyoung_modulus = 1e4\n[[probe]]",
     "s.toml:23:9: label.value = 1: the cells of a box have no labels"},
    {"ZeroCellSize", "cell_size = 0.5", "cell_size = 0", "s.toml:3:13: body.cell_size = 0: it must be"},
    {"PoissonHalf", "poisson_ratio = 0.3", "poisson_ratio = 0.5",
     "s.toml:6:17: material.poisson_ratio = 0.5: it must be inside (-1, 0.5)"},
    {"PoissonMinusOne", "poisson_ratio = 0.3", "poisson_ratio = -1", "material.poisson_ratio = -1: it must be"},
    {"PoissonNan", "poisson_ratio = 0.3", "poisson_ratio = nan",
     "s.toml:6:17: material.poisson_ratio = nan: it must be"},
    {"YoungZero", "young_modulus = 1e4", "young_modulus = 0",
     "s.toml:5:17: material.young_modulus = 0: it must be at least 1e-9"},
    {"YoungDenormal", "young_modulus = 1e4", "young_modulus = 5e-324",
     "s.toml:5:17: material.young_modulus = 5e-324: it must be at least 1e-9 and at most 1e18"},
    {"DensityTiny", "density = 1000", "density = 1e-300",
     "s.toml:7:11: material.density = 1e-300: it must be at least 1e-9 and at most 1e12"},
    {"YoungInfinite", "young_modulus = 1e4", "young_modulus = inf", "material.young_modulus = inf: it must be"},
    {"NegativeDensity", "density = 1000", "density = -1",
     "s.toml:7:11: material.density = -1: it must be at least 1e-9"},
    {"UnknownFace", "where = \"y-min\"", "where = \"y-mid\"",
     "s.toml:9:9: fix.where = \"y-mid\": it must be \"x-min\""},
    {"EmptyBox", "where = \"y-min\"", "where = {box = [[5, 5, 5], [6, 6, 6]]}",
     "s.toml:9:9: fix.where = {box = [[5, 5, 5], [6, 6, 6]]}: no node of the body lies in it"},
    {"EmptyNode", "where = \"y-max\"", "where = {node = 60}", "s.toml:11:9: move.where = {node = 60}: no node"},
    {"BoxUpsideDown", "where = \"y-min\"", "where = {box = [[1, 0, 0], [0, 1, 1]]}", "s.toml:9:16: fix.where.box"},
    {"Contradiction", "where = \"y-min\"", "where = \"x-min\"",
     "s.toml:11:9: move.where = \"y-max\": node 9 is held along x already by line 9"},
    {"TranslateAndRotate", "over = 1", "rotate = {axis = \"y\", degrees = 3}", "its [[move]] must have either"},
    {"BadAxis", "translate = [0, -0.1, 0]", "rotate = {axis = \"w\", degrees = 3}",
     "s.toml:12:18: move.rotate.axis = \"w\": it must be \"x\", \"y\" or \"z\""},
    {"TranslateInfinite", "translate = [0, -0.1, 0]", "translate = [0, inf, 0]", "s.toml:12:13: move.translate"},
    {"UnknownMethod", "method = \"symplectic-euler\"", "method = \"midpoint\"",
     "s.toml:17:10: solver.method = \"midpoint\": it must be \"symplectic-euler\", \"leapfrog\", \"backward-euler\", "
     "\"static\", \"modes\" or \"buckling\""},
    {"MissingDuration", "duration = 30", "", "s.toml:16:1: solver.duration: missing; it must be at least 1e-15"},
    {"ZeroLoadSteps", "method = \"symplectic-euler\"", "load_steps = 0",
     "s.toml:17:14: solver.load_steps = 0: it must be an integer, at least 1"},
    {"UnknownPreconditioner", "method = \"symplectic-euler\"", "preconditioner = \"ilu\"",
     "s.toml:17:18: solver.preconditioner = \"ilu\": it must be \"automatic\""},
    {"LoadWithoutForce", "[[probe]]", "[[load]]\nwhere = \"y-max\"\n[[probe]]", "s.toml:22:1: load.force: missing"},
    {"LoadTwice", "[[probe]]", "[[load]]\nwhere = \"y-max\"\nforce = [0, 1, 0]\ntraction = [0, 1, 0]\n[[probe]]",
     "s.toml:25:12: load.traction = [0, 1, 0]: only one of force, traction, moment, acceleration and"},
    {"TractionInside", "[[probe]]", "[[load]]\nwhere = {node = 0}\ntraction = [0, 1, 0]\n[[probe]]",
     "s.toml:23:9: load.where = {node = 0}: no part of"},
    {"PressureWithoutValue", "[[probe]]", "[[pressure]]\nwhere = \"y-max\"\n[[probe]]",
     "s.toml:22:1: pressure.pressure: missing; it must be a number, or rows [time, pressure]"},
    {"PressureVector", "[[probe]]", "[[pressure]]\nwhere = \"y-max\"\npressure = [1, 2]\n[[probe]]",
     "s.toml:24:12: pressure.pressure = [1, 2]: it must be a number, or rows [time, pressure]"},
    {"PressureTableOrder", "[[probe]]", "[[pressure]]\nwhere = \"y-max\"\npressure = [[1, 2], [0, 3]]\n[[probe]]",
     "s.toml:24:12: pressure.pressure = [[1, 2], [0, 3]]: it must be a number, or rows"},
    {"PressureTableRow", "[[probe]]", "[[pressure]]\nwhere = \"y-max\"\npressure = [[1, 2, 3]]\n[[probe]]",
     "s.toml:24:12: pressure.pressure = [[1, 2, 3]]: it must be a number, or rows"},
    {"LoadInfinite", "[[probe]]", "[[load]]\nwhere = \"y-max\"\nforce = [0, inf, 0]\n[[probe]]",
     "s.toml:24:9: load.force = [0, inf, 0]: it must be three numbers"},
    {"LoadTableRow", "[[probe]]", "[[load]]\nwhere = \"y-max\"\nforce = [[0, 1], [1, 2]]\n[[probe]]",
     "s.toml:24:9: load.force = [[0, 1], [1, 2]]: it must be three numbers, or rows [time, x, y, z]"},
    {"LoadTableOrder", "[[probe]]", "[[load]]\nwhere = \"y-max\"\nforce = [[1, 0, 0, 0], [1, 0, 2, 0]]\n[[probe]]",
     "s.toml:24:9: load.force = [[1, 0, 0, 0], [1, 0, 2, 0]]: it must be three numbers, or rows"},
    {"GravityTable", "[[probe]]", "[gravity]\nacceleration = [[0, 0, nan, 0]]\n[[probe]]",
     "s.toml:23:16: gravity.acceleration = [[0, 0, nan, 0]]: it must be"},
    {"StartWithoutVelocity", "[[probe]]", "[[start]]\nwhere = \"y-max\"\n[[probe]]",
     "s.toml:22:1: start.velocity: missing; it or angular_velocity must be given"},
    {"StartEmpty", "[[probe]]", "[[start]]\nwhere = {node = 999}\nvelocity = [1, 0, 0]\n[[probe]]",
     "s.toml:23:9: start.where = {node = 999}: no node"},
    {"OfAlone", "where = \"y-min\"", "where = {of = \"y-min\"}",
     "s.toml:9:9: fix.where = {of = \"y-min\"}: it must be"},
    {"WithoutNothing", "where = \"y-min\"", "where = {of = \"y-min\", without = []}", "s.toml:9:9: fix.where = {of"},
    {"WithoutAll", "where = \"y-min\"", "where = {of = \"y-min\", without = [\"y-min\"]}",
     "s.toml:9:9: fix.where = {of = \"y-min\", without = [\"y-min\"]}: no node of the body lies in it"},
    {"WithoutNoList", "where = \"y-min\"", "where = {of = \"y-min\", without = \"x-min\"}",
     "s.toml:9:34: fix.where.without = \"x-min\": it must be a list of regions"},
    {"EmptyLoad", "[[probe]]", "[[load]]\nwhere = {node = 999}\nforce = [0, 1, 0]\n[[probe]]",
     "s.toml:23:9: load.where = {node = 999}: no node"},
    {"TimeStep", "duration = 30", "duration = 30\ntime_step = 0.5",
     "s.toml:19:13: solver.time_step = 0.5: above the stable time step; it must be above 0 and at most 0.1 s"},
    {"CutWithoutTime", "[[probe]]", "[[cut]]\nbox = [[0, 0, 0], [1, 1, 1]]\n[[probe]]", "s.toml:22:1: cut.at: missing"},
    {"CutNegativeTime", "[[probe]]", "[[cut]]\nat = -1\nbox = [[0, 0, 0], [1, 1, 1]]\n[[probe]]",
     "s.toml:23:6: cut.at = -1: it must be at least 0"},
    {"CutWithoutTool", "[[probe]]", "[[cut]]\nat = 1\n[[probe]]",
     "s.toml:23:6: cut.at = 1: its [[cut]] must have one of box, sphere and behind"},
    {"CutTwoTools", "[[probe]]",
     "[[cut]]\nat = 1\nbox = [[0, 0, 0], [1, 1, 1]]\nsphere = {center = [0, 0, 0], radius = 1}\n[[probe]]",
     "s.toml:23:6: cut.at = 1: its [[cut]] must have one of box, sphere and behind"},
    {"CutBox", "[[probe]]", "[[cut]]\nat = 1\nbox = [[2, 0, 0], [1, 1, 1]]\n[[probe]]",
     "s.toml:24:7: cut.box = [[2, 0, 0], [1, 1, 1]]: it must be [[x, y, z], [x, y, z]], low corner first"},
    {"CutSphere", "[[probe]]", "[[cut]]\nat = 1\nsphere = 3\n[[probe]]",
     "s.toml:24:10: cut.sphere = 3: it must be {center = [x, y, z], radius = r}"},
    {"CutBehind", "[[probe]]", "[[cut]]\nat = 1\nbehind = \"me\"\n[[probe]]",
     "s.toml:24:10: cut.behind = \"me\": it must be {point = [x, y, z], normal = [x, y, z]}"},
    {"CutNormal", "[[probe]]", "[[cut]]\nat = 1\nbehind = {point = [0, 0, 0], normal = [0, 0, 0]}\n[[probe]]",
     "s.toml:24:39: cut.behind.normal = [0, 0, 0]: it must be three numbers, not all zero"},
    {"CutPoint", "[[probe]]", "[[cut]]\nat = 1\nbehind = {point = [0, 0], normal = [0, 0, 1]}\n[[probe]]",
     "s.toml:24:19: cut.behind.point = [0, 0]: it must be three numbers"},
    {"CutUntil", "[[probe]]", "[[cut]]\nat = 1\nbox = [[0, 0, 0], [1, 1, 1]]\nuntil = 0.5\nevery = 0.1\n[[probe]]",
     "s.toml:25:9: cut.until = 0.5: it must be at least `at`"},
    {"CutUntilAlone", "[[probe]]", "[[cut]]\nat = 1\nbox = [[0, 0, 0], [1, 1, 1]]\nuntil = 2\n[[probe]]",
     "s.toml:25:9: cut.until = 2: until and every must be given together"},
    {"CutEvery", "[[probe]]", "[[cut]]\nat = 1\nbox = [[0, 0, 0], [1, 1, 1]]\nuntil = 2\nevery = 0\n[[probe]]",
     "s.toml:26:9: cut.every = 0: it must be above 0"},
    {"CutTooOften", "[[probe]]", "[[cut]]\nat = 1\nbox = [[0, 0, 0], [1, 1, 1]]\nuntil = 2\nevery = 1e-300\n[[probe]]",
     "s.toml:26:9: cut.every = 1e-300: it must be above 0, for at most 1e9 times"},
    {"CutVelocity", "[[probe]]", "[[cut]]\nat = 1\nbox = [[0, 0, 0], [1, 1, 1]]\nvelocity = 2\n[[probe]]",
     "s.toml:25:12: cut.velocity = 2: it must be three numbers"},
    {"CutFrame", "[[probe]]", "[[cut]]\nat = 1\nbox = [[0, 0, 0], [1, 1, 1]]\nframe = \"tool\"\n[[probe]]",
     "s.toml:25:9: cut.frame = \"tool\": it must be \"present\" or \"rest\""},
    {"ZeroDuration", "duration = 30", "duration = 0", "s.toml:18:12: solver.duration = 0: it must be at least 1e-15"},
    {"DurationOfNoStep", "duration = 30", "duration = 1e-320",
     "s.toml:18:12: solver.duration = 1e-320: it must be at least 1e-15"},
    {"TooManySteps", "duration = 30", "duration = 1e308",
     "s.toml:18:12: solver.duration = 1e308: it takes more than 1e15 steps"},
    {"NegativeDamping", "mass = 3", "mass = -3", "s.toml:15:8: damping.mass = -3: it must be at least 0"},
    {"NegativeStiffnessDamping", "mass = 3", "stiffness = -3",
     "s.toml:15:13: damping.stiffness = -3: it must be at least 0"},
    {"InfiniteStiffnessDamping", "mass = 3", "stiffness = inf", "s.toml:15:13: damping.stiffness = inf: it must be"},
    {"StiffnessDampingAsText", "mass = 3", "stiffness = \"1\"", "s.toml:15:13: damping.stiffness = \"1\": it must be"},
    {"NegativeCubicStiffening", "density = 1000", "density = 1000\nstiffening_cubic = -1",
     "s.toml:8:20: material.stiffening_cubic = -1: it must be at least 0"},
    {"QuadraticStiffeningAlone", "density = 1000", "density = 1000\nstiffening_quadratic = 1",
     "s.toml:8:24: material.stiffening_quadratic = 1: with stiffening_cubic = 0 it must be in [0, 0.5]"},
    {"QuadraticStiffeningTooNegative", "density = 1000",
     "density = 1000\nstiffening_cubic = 3\nstiffening_quadratic = -3.5",
     "s.toml:9:24: material.stiffening_quadratic = -3.5: with stiffening_cubic = 3 it must be in [-3, 3]"},
    {"QuadraticStiffeningNan", "density = 1000", "density = 1000\nstiffening_quadratic = nan",
     "s.toml:8:24: material.stiffening_quadratic = nan: it must be"},
    {"NegativeCrushResistance", "density = 1000", "density = 1000\ncrush_resistance = -1",
     "s.toml:8:20: material.crush_resistance = -1: it must be at least 0"},
    {"CrushRatioOfRest", "density = 1000", "density = 1000\ncrush_resistance = 20\ncrush_ratio = 1",
     "s.toml:9:15: material.crush_ratio = 1: it must be inside (0, 1)"},
    {"ZeroEvery", "every = 0.5", "every = 0", "s.toml:21:9: output.every = 0: it must be above 0"},
    {"BadProbeName", "name = \"plate\"", "name = \"a,b\"", "s.toml:23:8: probe.name = \"a,b\": it must be letters"},
    {"SingleFix", "[[fix]]", "[fix]", "s.toml:8:2: fix: it must be given as [[fix]]"},
    {"ObstacleWithoutShape", "[[probe]]", "[[obstacle]]\nfriction = 1\n[[probe]]",
     "s.toml:22:1: obstacle.plane: missing; it or sphere, box, capsule, hull, mesh or height must be given"},
    {"ObstacleOfTwoShapes", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nbox = [[0, 0, 0], [1, 1, 1]]\n[[probe]]",
     "s.toml:24:7: obstacle.box = [[0, 0, 0], [1, 1, 1]]: only one of plane, sphere, box, capsule, hull, mesh"},
    {"HullOfThreePoints", "[[probe]]", "[[obstacle]]\nhull = {points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}\n[[probe]]",
     "s.toml:23:18: obstacle.hull.points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]: 3 points given for a hull: at least 4"},
    {"HullOfPairs", "[[probe]]", "[[obstacle]]\nhull = {points = [[0, 0, 0], [1, 0], [0, 1, 0], [0, 0, 1]]}\n[[probe]]",
     "row 1 has 2 numbers: each must have 3"},
    {"HullOfNumbers", "[[probe]]", "[[obstacle]]\nhull = {points = [0, 0, 0]}\n[[probe]]",
     "s.toml:23:18: obstacle.hull.points = [0, 0, 0]: it must be [[x, y, z], ...], four or more"},
    {"HullOfNothing", "[[probe]]", "[[obstacle]]\nhull = {at = [0, 0, 0]}\n[[probe]]",
     "obstacle.hull.points: missing; it or file must be given"},
    {"HullOfBoth", "[[probe]]", "[[obstacle]]\nhull = {points = [[0, 0, 0]], file = \"a.stl\"}\n[[probe]]",
     "obstacle.hull.file = \"a.stl\": only one of points and file may be given"},
    {"HullTooThin", "[[probe]]",
     "[[obstacle]]\nhull = {points = [[0, -9, 0], [9, -9, 0], [0, -9, 9], [0, -9.0001, 0]]}\n[[probe]]",
     "it is 0.000100 m thick: it must be at least the cell size"},
    {"MeshWithoutFile", "[[probe]]", "[[obstacle]]\nmesh = {cells = 8}\n[[probe]]", "obstacle.mesh.file: missing"},
    {"MeshNotThere", "[[probe]]", "[[obstacle]]\nmesh = {file = \"no.stl\"}\n[[probe]]",
     "s.toml:23:16: obstacle.mesh.file = \"no.stl\": it cannot be read"},
    {"MeshOfFewCells", "[[probe]]", "[[obstacle]]\nmesh = {file = \"no.stl\", cells = 3}\n[[probe]]",
     "obstacle.mesh.cells = 3: it must be an integer, at least 4"},
    {"HeightsOfUnevenRows", "[[probe]]", "[[obstacle]]\nheight = {rows = [[0, 0], [0]], spacing = 1}\n[[probe]]",
     "obstacle.height.rows = [[0, 0], [0]]: row 1 has 1 numbers: each must have 2"},
    {"HeightsOfOneRow", "[[probe]]", "[[obstacle]]\nheight = {rows = [[0, 0]], spacing = 1}\n[[probe]]",
     "2 x 1 heights are not allowed"},
    {"HeightsWithoutSpacing", "[[probe]]", "[[obstacle]]\nheight = {rows = [[0, 0], [0, 0]]}\n[[probe]]",
     "obstacle.height.spacing: missing"},
    {"HeightsNotThere", "[[probe]]", "[[obstacle]]\nheight = {file = \"no.txt\", spacing = 1}\n[[probe]]",
     "obstacle.height.file = \"no.txt\": it cannot be"},
    {"FreePlane", "[[probe]]", "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nmass = 1\n[[probe]]",
     "s.toml:24:8: obstacle.mass = 1: a plane and a height field have no end, and cannot be free"},
    {"FreeAndLed", "[[probe]]",
     "[[obstacle]]\nsphere = {center = [0, 9, 0], radius = 2}\nmass = 1\ntranslate = [1, 0, 0]\n[[probe]]",
     "obstacle.translate = [1, 0, 0]: an obstacle with a mass is free: nothing leads it"},
    {"MassOfNothing", "[[probe]]", "[[obstacle]]\nsphere = {center = [0, 9, 0], radius = 2}\nmass = 0\n[[probe]]",
     "s.toml:24:8: obstacle.mass = 0: it must be above 0 and at most 1e30"},
    {"InertiaWithoutMass", "[[probe]]",
     "[[obstacle]]\nsphere = {center = [0, 9, 0], radius = 2}\ninertia = [1, 1, 1]\n[[probe]]",
     "s.toml:24:11: obstacle.inertia = [1, 1, 1]: it is of a free obstacle, which has a mass"},
    {"InertiaOfNothing", "[[probe]]",
     "[[obstacle]]\nsphere = {center = [0, 9, 0], radius = 2}\nmass = 1\ninertia = [1, 0, 1]\n[[probe]]",
     "s.toml:25:11: obstacle.inertia = [1, 0, 1]: it must be three numbers, each above 0"},
    {"FreeHullBesideItsPlace", "[[probe]]",
     "[[obstacle]]\nhull = {points = [[0, 9, 0], [4, 9, 0], [0, 13, 0], [0, 9, 4]]}\nmass = 1\n[[probe]]",
     "s.toml:24:8: obstacle.mass = 1: its centre of mass is at (1, 10, 1) m in its own axes"},
    {"ObstacleUnknownKey", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nfricton = 1\n[[probe]]",
     "s.toml:24:1: obstacle.fricton = 1: unknown key"},
    {"PlaneWithoutNormal", "[[probe]]", "[[obstacle]]\nplane = {point = [0, 0, 0]}\n[[probe]]",
     "s.toml:23:9: obstacle.plane.normal: missing"},
    {"PlaneNormalZero", "[[probe]]", "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 0, 0]}\n[[probe]]",
     "s.toml:23:38: obstacle.plane.normal = [0, 0, 0]: it must be three numbers, not all 0"},
    {"PlanePoint", "[[probe]]", "[[obstacle]]\nplane = {point = [0, 0], normal = [0, 1, 0]}\n[[probe]]",
     "s.toml:23:18: obstacle.plane.point = [0, 0]: it must be three numbers"},
    {"SphereRadius", "[[probe]]", "[[obstacle]]\nsphere = {center = [0, -9, 0], radius = 0}\n[[probe]]",
     "s.toml:23:41: obstacle.sphere.radius = 0: it must be"},
    {"SphereCenter", "[[probe]]", "[[obstacle]]\nsphere = {center = 3, radius = 1}\n[[probe]]",
     "s.toml:23:20: obstacle.sphere.center = 3: it must be three numbers"},
    {"SphereSmall", "[[probe]]", "[[obstacle]]\nsphere = {center = [0, -9, 0], radius = 0.4}\n[[probe]]",
     "s.toml:23:41: obstacle.sphere.radius = 0.4: it must be at least the cell size"},
    {"BoxThin", "[[probe]]", "[[obstacle]]\nbox = [[0, -1, 0], [1, -0.8, 1]]\n[[probe]]",
     "s.toml:23:7: obstacle.box = [[0, -1, 0], [1, -0.8, 1]]: every edge must be at least the cell size"},
    {"BoxUpside", "[[probe]]", "[[obstacle]]\nbox = [[0, 0, 0], [1, -1, 1]]\n[[probe]]", "s.toml:23:7: obstacle.box"},
    {"ObstacleName", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nname = \"a b\"\n[[probe]]",
     "s.toml:24:8: obstacle.name = \"a b\": it must be letters"},
    {"ObstacleFriction", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nfriction = -1\n[[probe]]",
     "s.toml:24:12: obstacle.friction = -1: it must be"},
    {"ObstacleStiffness", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nstiffness = 0\n[[probe]]",
     "s.toml:24:13: obstacle.stiffness = 0: it must be above 0"},
    {"ObstacleTranslate", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\ntranslate = [0, nan, 0]\n[[probe]]",
     "s.toml:24:13: obstacle.translate"},
    {"ObstacleRotate", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nrotate = {axis = \"y\"}\n[[probe]]",
     "s.toml:24:10: obstacle.rotate.degrees: missing"},
    {"ObstacleOver", "[[probe]]", "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nover = -1\n[[probe]]",
     "s.toml:24:8: obstacle.over = -1: it must be at least 0"},
    {"ObstacleVelocity", "[[probe]]",
     "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nvelocity = 3\n[[probe]]",
     "s.toml:24:12: obstacle.velocity = 3: it must be three numbers"},
    {"ObstacleAroundBody", "[[probe]]", "[[obstacle]]\nplane = {point = [0, 1, 0], normal = [0, 1, 0]}\n[[probe]]",
     "s.toml:23:9: obstacle.plane = {point = [0, 1, 0], normal = [0, 1, 0]}: 27 nodes of the body lie in it"},
    {"EnergyBalanceNumber", "every = 0.5", "energy_balance = 1",
     "s.toml:21:18: output.energy_balance = 1: it must be true or false"},
    {"TooLarge", "cells = [2, 3, 4]", "cells = [100000, 100000, 100000]",
     "s.toml:2:9: body.cells = [100000, 100000, 100000]: these cells need about"},
    {"HugeCount", "cells = [2, 3, 4]", "cells = [9223372036854775807, 1, 1]", "s.toml:2:9: body.cells"},
};

class BadScene : public testing::TestWithParam<BadLine> {};

TEST_P(BadScene, is_one_line_and_writes_nothing) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene(GetParam().line, GetParam().replacement));
    const test::ProgramResult result = test::run_program("run s.toml --out results", directory.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.output, "");
    EXPECT_EQ(result.errors.rfind("hybmss: error: s.toml:", 0), 0u) << result.errors;
    EXPECT_NE(result.errors.find(GetParam().message), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "results"));
}

INSTANTIATE_TEST_SUITE_P(Scenes, BadScene, testing::ValuesIn(kBadLines),
                         [](const auto& scene) { return std::string(scene.param.name); });

/// What only explicit steps can do, at the key that must change.
TEST(BadScenes, explicit_effects_need_explicit_steps) {
    const std::string plane = "\n[[obstacle]]\nplane = {point = [0, -9, 0], normal = [0, 1, 0]}\n";
    const auto refused = [](const std::string& text, bool balance) -> std::string {
        try {
            Scene scene = parse_scene(text, "s.toml");
            scene.output.energy_balance = balance;
            Simulation simulation(scene);
            return "";
        } catch (const SceneError& error) {
            return error.what();
        }
    };
    for (const char* method : {"static", "backward-euler"}) {
        const std::string text =
            test::small_scene("method = \"symplectic-euler\"", "method = \"" + std::string(method) + "\"");
        EXPECT_NE(refused(text, true).find("must be solved by \"symplectic-euler\""), std::string::npos);
        EXPECT_EQ(refused(text + plane, false), "");
        const std::string rough = refused(text + plane + "friction = 0.5\n", false);
        EXPECT_EQ(rough.find("s.toml:"), 0u) << rough;
        EXPECT_NE(rough.find("obstacle.friction = 0.5: friction is computed by \"symplectic-euler\""),
                  std::string::npos)
            << rough;
        const std::string moving = refused(text + plane + "velocity = [0, 1, 0]\n", false);
        EXPECT_EQ(moving.find("obstacle.velocity = [0, 1, 0]: an equilibrium has no time") != std::string::npos,
                  std::string(method) == "static")
            << moving;
    }
}

void expect_bad(const std::string& arguments, const std::string& message) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene());
    const test::ProgramResult result = test::run_program(arguments, directory.path());
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_EQ(result.errors.rfind("hybmss: error: ", 0), 0u) << result.errors;
    EXPECT_NE(result.errors.find(message), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "results"));
}

TEST(BadArguments, are_one_line) {
    expect_bad("run missing.toml --out results", "missing.toml: cannot be read: No such file or directory");
    expect_bad("run . --out results", ".: is a directory");
    expect_bad("explain missing.toml", "missing.toml: cannot be read");
    expect_bad("run s.toml --precision half --out results", "\"half\" is not known: it must be float or double");
    expect_bad("run s.toml --isa mmx --out results", "mmx");
    expect_bad("run s.toml --layout spiral --out results", "--layout spiral: not known; allowed are flat-rows");
    expect_bad("run s.toml --threads -3 --out results", "--threads");
    expect_bad("run s.toml --out s.toml/results", "--out: s.toml/results");
    expect_bad("run", "SCENE");
    expect_bad("walk s.toml", "");
}

TEST(Memory, is_checked_before_anything_is_allocated) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    EXPECT_NO_THROW(check_size(scene, {}, 1e9));
    EXPECT_THROW(check_size(scene, {}, 1e3), SceneError);
    scene.body.cells = {2000, 2000, 2000}; // more nodes than can be numbered, wherever there is memory
    EXPECT_THROW(check_size(scene, {}, 1e18), SceneError);
    EXPECT_GT(available_bytes(), 1e7);
}

TEST(Memory, NetworkLayoutsCountTheirSprings) {
    SceneBody body;
    body.cells = {40, 40, 40};
    SimulationOptions options;
    const double by_default = estimated_bytes(body, options);
    std::vector<std::string> layouts = lattice_layouts();
    for (const std::string& layout : network_layouts()) {
        layouts.push_back(layout); // a lattice may name these too
    }
    for (const std::string& layout : layouts) {
        options.plan.layout = layout;
        if (layout.ends_with("-rows")) { // index-free, or nearly
            EXPECT_GE(estimated_bytes(body, options), by_default) << layout;
            EXPECT_LT(estimated_bytes(body, options), 1.2 * by_default) << layout;
        } else {
            EXPECT_GT(estimated_bytes(body, options), 1.5 * by_default) << layout;
        }
    }
}

TEST(Memory, SparseVoxelsCountByTheirCells) {
    // Two cubes of cells in the corners of a large grid.
    const auto body_of = [](std::int64_t edge, std::int64_t grid) {
        SceneBody body;
        body.cells = {grid, grid, grid};
        body.labels.resize(static_cast<std::size_t>(grid * grid * grid));
        for (std::int64_t k = 0; k < edge; ++k) {
            for (std::int64_t j = 0; j < edge; ++j) {
                for (std::int64_t i = 0; i < edge; ++i) {
                    body.labels[static_cast<std::size_t>(i + grid * (j + grid * k))] = 1;
                    body.labels[static_cast<std::size_t>(grid - 1 - i +
                                                         grid * (grid - 1 - j + grid * (grid - 1 - k)))] = 2;
                }
            }
        }
        return body;
    };
    const SimulationOptions options;
    const double small = estimated_bytes(body_of(12, 96), options), large = estimated_bytes(body_of(24, 96), options);
    const double grid = 9 * 97.0 * 97 * 97; // what the grid itself takes
    EXPECT_GT((large - grid) / (small - grid), 5);
    EXPECT_LT((large - grid) / (small - grid), 9);
    SceneBody box = body_of(1, 96);
    box.labels.clear();
    EXPECT_LT(large, estimated_bytes(box, options) / 10);
    box.labels.assign(96 * 96 * 96, 1);
    const double full = estimated_bytes(box, options);
    box.labels.clear();
    EXPECT_EQ(full, estimated_bytes(box, options));
}

} // namespace
} // namespace hybmss
