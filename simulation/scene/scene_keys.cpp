// The one table of scene keys. A new key is a row here, and its use.

#include "hybmss/moduli.hpp"
#include "layouts/messages.hpp"
#include "simulation/scene/scene_shapes.hpp"

#include <cmath>
#include <stdexcept>

namespace hybmss {
namespace scene_format {
namespace {

constexpr Range kMethod =
    words("\"symplectic-euler\", \"leapfrog\", \"backward-euler\", \"static\", \"modes\" or \"buckling\"");

// -- [body]

/// As a Move's, about the middle of the body's grid.
constexpr Key<Place> kPlaceKeys[] = {
    {"translate", "m", kBounded, "[0, 0, 0]",
     "the grid's low corner goes there from where the file, or the origin, "
     "has it",
     member<&Place::translate>},
    {"rotate", "", kRotationTable, "none", "a turn about the middle of the grid; not in a static scene",
     field<TableFormat<kRotation>, Member<&Place::rotate>>},
};
constexpr KeyTable<Place> kPlace = {
    "body.place", "The value of `place`. Regions (`where`) are those of the body that is moved and not turned yet.",
    kPlaceKeys};

/// Not written where a body is in its own place.
struct Placed : Member<&SceneBody::place> {
    static std::optional<Place> get(const SceneBody& body) {
        return body.place == Place{} ? std::nullopt : std::optional(body.place);
    }
};

/// The cells of a full box; those of other bodies follow from the size or the file.
struct BoxCells : Member<&SceneBody::cells> {
    static std::optional<Stored> get(const SceneBody& body) {
        const bool told =
            body.voxels.empty() && body.surface.empty() && body.mesh_file.empty() && body.size == Vector3{};
        return told ? std::optional(body.cells) : std::nullopt;
    }
};

/// A mesh is a word of its own.
struct CellsOfABox : Member<&SceneBody::shape> {
    static std::optional<Stored> get(const SceneBody& body) {
        const bool told = body.shape != SceneCells::cubes && body.shape != SceneCells::mesh;
        return told ? std::optional(body.shape) : std::nullopt;
    }
};
/// Nor does a mesh have cells of one size.
struct CellSize : Unless0<&SceneBody::cell_size> {
    static std::optional<double> get(const SceneBody& body) {
        return body.shape == SceneCells::mesh ? std::nullopt : Unless0<&SceneBody::cell_size>::get(body);
    }
};
struct OfAMesh : Member<&SceneBody::most_anisotropy> {
    static std::optional<double> get(const SceneBody& body) {
        return body.shape == SceneCells::mesh ? std::optional(body.most_anisotropy) : std::nullopt;
    }
};

constexpr Key<SceneBody> kBodyKeys[] = {
    {"cells", "", from(1, kNoBound, "three integers, each at least 1"), "none",
     "a full box of so many cells along x, y and z; its low corner is the origin",
     field<VectorFormat<std::int64_t>, BoxCells>},
    {"size", "m", above(0, 1e9, "three numbers, each above 0 and at most 1e9"), "none",
     "a full box with these edges, a whole number of cells; without `cell_size` its mesh is chosen by "
     "`solver.accuracy`",
     field<VectorFormat<double>, Unless0<&SceneBody::size>>},
    {"voxels", "", words("the path of a NumPy (.npy), NRRD or NIfTI file, from the scene's folder on"), "none",
     "cells with a label above 0; the grid's low corner is the origin", field<TextFormat, Unless0<&SceneBody::voxels>>},
    {"surface", "", words("the path of an STL, OBJ, PLY or glTF file, from the scene's folder on"), "none",
     "cells whose centre lies inside the surface, in its own coordinates (m)",
     field<TextFormat, Unless0<&SceneBody::surface>>},
    {"mesh", "", words("the path of a .msh (2.2, 4.1) or legacy .vtk file, as text, from the scene's folder on"),
     "none", "tetrahedra, pyramids and prisms, in their own coordinates (m), with springs fitted to them",
     field<TextFormat, Unless0<&SceneBody::mesh_file>>},
    {"shape", "", words("\"cubes\", \"tetrahedra\", \"pyramids\" or \"prisms\""), "\"cubes\"",
     "what the cells of a box are: cubes, the tetrahedra or pyramids that fill these, or two prisms on equilateral "
     "triangles in the place of each, whose y axis leans by 30 degrees to x: see \"Cells of other shapes\"",
     field<ChoiceFormat, CellsOfABox>},
    {"most_anisotropy", "", above(0, 1, "above 0 and at most 1"), "0.1",
     "with `mesh`: the anisotropy and the error of the shear modulus that fitted springs may have",
     field<NumberFormat, OfAMesh>},
    {"fill", "", words("\"centre\" or \"fraction\""), "\"centre\"",
     "with `surface`: cells are whole where their centre is inside, or have of stiffness and mass the part of their "
     "volume that is inside",
     field<ChoiceFormat, Unless0<&SceneBody::fractions>>},
    {"cell_size", "m", from(1e-6, 1e6, "at least 1e-6 and at most 1e6"),
     "that of a file with spacings, the least of voxels that are no cubes; free for a `size` with `solver.accuracy`; "
     "else required",
     "edge of a cell", field<NumberFormat, CellSize>},
    {"contact", "", words("\"nodes\" or \"skin\""), "\"nodes\"",
     "what obstacles touch: the nodes of the cells' boundary, or points of the body's `surface`, or of the smooth "
     "boundary of its cells; in motions by symplectic-euler or leapfrog",
     field<ChoiceFormat, Unless0<&SceneBody::skin_touches>>},
    {"place", "",
     words("{translate = [x, y, z], rotate = {axis = \"x\", \"y\" or \"z\", degrees = angle}}, or one of both"), "none",
     "where the body begins", field<TableFormat<kPlace>, Placed>},
};

void complete_body(const GivenTable& given, SceneBody& body) {
    const int ways = given.count("cells", "size", "voxels", "surface", "mesh");
    if (ways == 0) {
        given.missing("cells", "or size, voxels, surface or mesh must be given");
    }
    if (ways > 1) {
        given.refuse(given.has("mesh")      ? "mesh"
                     : given.has("surface") ? "surface"
                     : given.has("voxels")  ? "voxels"
                                            : "size",
                     "only one of cells, size, voxels, surface and mesh may be given");
    }
    if (given.has("mesh")) {
        body.shape = SceneCells::mesh;
    }
    if (given.has("mesh") && given.has("cell_size")) {
        given.refuse("cell_size", "the cells of a mesh have the sizes that its file tells");
    }
    if (given.has("most_anisotropy") && !given.has("mesh")) {
        given.refuse("most_anisotropy", "only springs of a mesh are fitted; it must be given with mesh");
    }
    if (given.has("shape") && given.count("cells", "size") == 0) {
        given.refuse("shape", "only a box has cells of a shape to choose; it must be given with cells or size");
    }
    if (body.shape == SceneCells::prisms && given.has("size")) {
        given.refuse("shape", "prisms fill no box with edges; they must be given with cells");
    }
    if (given.has("fill") && !given.has("surface")) {
        given.refuse("fill", "only a surface has an inside; it must be given with surface");
    }
    if (!given.has("cell_size")) {
        if (given.has("cells") || given.has("surface")) {
            given.missing("cell_size");
        }
        body.cell_size = 0; // the file, or the accuracy, must tell
    }
    for (std::size_t a = 0; a < 3 && given.count("size", "cell_size") == 2; ++a) {
        const double cells = body.size[a] / body.cell_size;
        if (!(cells >= 0.5 && cells < 1e9 && std::abs(cells - std::round(cells)) <= 1e-9 * cells)) {
            given.refuse("size", "each edge must be a whole number of cells of cell_size");
        }
        body.cells[a] = std::llround(cells);
    }
}

void relate_body(const TableCheck& table, const SceneBody& body) {
    for (const double x : body.origin) { // which no key tells
        table.at("origin", from(-1e9, 1e9, "at most 1e9 in size")).number(x);
    }
}

constexpr KeyTable<SceneBody> kBody = {
    "body",
    "The body, made of cubic cells: a box (`cells` or `size`), the labelled cells of a voxel file (`voxels`), or the "
    "inside of a closed surface (`surface`); or of a mesh of other cells (`mesh`); one of the five.",
    kBodyKeys, complete_body, relate_body};

// -- [material] and [[label]]

constexpr auto kPoissonRatio = inside(-1, 0.5, "inside (-1, 0.5), both ends excluded");
constexpr auto kDensity = from(1e-9, 1e12, "at least 1e-9 and at most 1e12");

/// Fits of `hybmss-study tissue`, by the order of the words.
struct MaterialPreset {
    double young_modulus, poisson_ratio, stiffening_quadratic, stiffening_cubic;
};
constexpr Range kPresetNames = words("\"brain-grey\" or \"brain-white\"");
constexpr MaterialPreset kPresets[] = {{3562.9, 0.49, -25.791, 221.73}, {1767.2, 0.49, -24.484, 199.83}};

/// All that [material] tells.
struct MaterialKeys {
    Material material;
    std::optional<int> preset;
    ElasticModuli moduli; ///< of a text; written are E and nu
    std::vector<Relaxation> relaxation;
    std::optional<double> tear_strain;
};

/// E or nu.
template <auto modulus, auto member>
struct Modulus {
    using Owner = MaterialKeys;
    static std::optional<double> get(const MaterialKeys& keys) { return keys.material.*member; }
    static void set(MaterialKeys& keys, double value) { keys.moduli.*modulus = value; }
};
/// What E and nu may follow from.
template <auto modulus>
struct OtherModulus {
    using Owner = MaterialKeys;
    static std::optional<double> get(const MaterialKeys&) { return std::nullopt; }
    static void set(MaterialKeys& keys, double value) { keys.moduli.*modulus = value; }
};

/// Written is what it stands for.
struct Preset {
    using Owner = MaterialKeys;
    static std::optional<int> get(const MaterialKeys&) { return std::nullopt; }
    static void set(MaterialKeys& keys, int value) { keys.preset = value; }
};

/// Rows of two numbers.
struct RelaxationFormat {
    static constexpr std::string_view kType = "n x 2";
    static std::vector<Relaxation> read(const Given& given) {
        std::vector<Relaxation> branches;
        for (const SceneValue& row : given.as<SceneValue::Array>()) {
            const SceneValue::Array& numbers = given.array(row, 2);
            branches.push_back({given.number(numbers[0]), given.number(numbers[1])});
        }
        check(given, branches);
        return branches;
    }
    static void check(const Check& check, const std::vector<Relaxation>& branches) {
        if (branches.empty() || branches.size() > 4) {
            check.refuse(static_cast<double>(branches.size()), check.range.allowed);
        }
        for (const Relaxation& branch : branches) {
            check.number(branch.part);
            check.number(branch.time);
        }
    }
    static SceneValue write(const std::vector<Relaxation>& branches, const Range&) {
        SceneValue::Array rows;
        for (const Relaxation& branch : branches) {
            rows.push_back({SceneValue::Array{{branch.part}, {branch.time}}});
        }
        return {std::move(rows)};
    }
};
struct Memory {
    using Owner = MaterialKeys;
    static std::optional<std::vector<Relaxation>> get(const MaterialKeys& keys) {
        return keys.relaxation.empty() ? std::nullopt : std::optional(keys.relaxation);
    }
    static void set(MaterialKeys& keys, std::vector<Relaxation> value) { keys.relaxation = std::move(value); }
};

constexpr Range kModulus = from(1e-9, 1e18, "at least 1e-9 and at most 1e18");
constexpr std::string_view kTwoModuli = "two of the five moduli are required";

constexpr Key<MaterialKeys> kMaterialKeys[] = {
    {"young_modulus", "Pa", kModulus, kTwoModuli, "Young's modulus E",
     field<NumberFormat, Modulus<&ElasticModuli::young_modulus, &Material::young_modulus>>},
    {"poisson_ratio", "", kPoissonRatio, kTwoModuli, "Poisson's ratio nu",
     field<NumberFormat, Modulus<&ElasticModuli::poisson_ratio, &Material::poisson_ratio>>},
    {"density", "kg/m^3", kDensity, "required", "mass per volume at rest",
     member<&MaterialKeys::material, &Material::density>},
    {"shear_modulus", "Pa", kModulus, kTwoModuli, "G = E / (2 (1 + nu))",
     field<NumberFormat, OtherModulus<&ElasticModuli::shear_modulus>>},
    {"bulk_modulus", "Pa", kModulus, kTwoModuli, "K = E / (3 (1 - 2 nu))",
     field<NumberFormat, OtherModulus<&ElasticModuli::bulk_modulus>>},
    {"lame_modulus", "Pa", from(-1e18, 1e18, "at most 1e18 in size"), kTwoModuli, "Lame's first, lambda = K - 2 G / 3",
     field<NumberFormat, OtherModulus<&ElasticModuli::lame_modulus>>},
    {"face_diagonal_ratio", "", kFrom0To1e6, "1", "A = k_f / k_c; 0 leaves the face diagonals out (HybMSS-FD)",
     member<&MaterialKeys::material, &Material::face_diagonal_ratio>},
    {"springs", "", words("\"nodes\" or \"means\""), "\"nodes\"",
     "where springs act: between nodes, or on the means of each cell (HybMSS-M)",
     member_as<ChoiceFormat, &MaterialKeys::material, &Material::springs>},
    {"volume_energy", "", words("\"automatic\", \"quadratic\", \"mean_stretch\" or \"none\""), "\"automatic\"",
     "energy of the volume ratio J; `automatic`: quadratic at nu >= 1/4, mean stretch below; `none`: springs only "
     "(HybMSS-CF)",
     member_as<ChoiceFormat, &MaterialKeys::material, &Material::volume_energy>},
    {"stiffening_quadratic", "",
     words(
         "from -r to r, r = sqrt(3 stiffening_cubic), or to (1 + 3 stiffening_cubic)/2 where stiffening_cubic <= 1/3"),
     "0",
     "a: springs stiffen (or soften) with their strain e, force k l (e + a e^2 + b e^3); see \"Stiffening springs\"",
     member<&MaterialKeys::material, &Material::stiffening, &SpringStiffening::quadratic>},
    {"stiffening_cubic", "", kFrom0To1e6, "0", "b: likewise; stretched and pressed alike",
     member<&MaterialKeys::material, &Material::stiffening, &SpringStiffening::cubic>},
    {"crush_resistance", "", kFrom0To1e6, "0",
     "beta: cells below the volume ratio J0 = crush_ratio store G V0 beta (J0 - J)^3 / (3 J0^2); 20 is much",
     member<&MaterialKeys::material, &Material::crush, &CrushResistance::stiffness>},
    {"crush_ratio", "", inside(0, 1, "inside (0, 1), both ends excluded"), "0.7", "J0: no other cell is touched",
     member<&MaterialKeys::material, &Material::crush, &CrushResistance::ratio>},
    {"relaxation", "1, s", above(0, 1e6, "one to four rows [part, time], each number above 0 and at most 1e6"), "none",
     "beside the moduli, which are those of slow loads, each row has part times as much that fades by exp(-t / time); "
     "symplectic-euler or leapfrog, see \"Relaxation\"",
     field<RelaxationFormat, Memory>},
    {"tear_strain", "", above(0, 100, "above 0 and at most 100"), "none",
     "cells part along the face between two whose mean is stretched by more across it; symplectic-euler, see "
     "\"Tears\"",
     member<&MaterialKeys::tear_strain>},
    {"preset", "", kPresetNames, "none",
     "in place of the moduli and the stiffening: those of springs fitted to human brain, grey or white matter, within "
     "stretches of 0.9 to 1.1 and shear of 0.2; nu = 0.49 is a choice",
     field<ChoiceFormat, Preset>},
};

void complete_material(const GivenTable& given, MaterialKeys& keys) {
    constexpr std::string_view kModuli[] = {"young_modulus", "poisson_ratio", "shear_modulus", "bulk_modulus",
                                            "lame_modulus"};
    std::vector<std::string_view> known;
    for (const std::string_view& modulus : kModuli) {
        if (given.has(modulus)) {
            known.push_back(modulus);
        }
    }
    if (keys.preset) {
        if (!known.empty() || given.count("stiffening_quadratic", "stiffening_cubic") > 0) {
            given.refuse("preset", "it gives the moduli and the stiffening: neither may be given besides");
        }
        const MaterialPreset& preset = kPresets[*keys.preset];
        keys.moduli = {.young_modulus = preset.young_modulus, .poisson_ratio = preset.poisson_ratio};
        keys.material.stiffening = {preset.stiffening_quadratic, preset.stiffening_cubic};
        known = {"preset", "preset"};
    }
    if (known.size() < 2) {
        given.missing(given.has("young_modulus") ? "poisson_ratio" : "young_modulus",
                      "or another must be given: two of young_modulus, poisson_ratio, shear_modulus, bulk_modulus and "
                      "lame_modulus");
    }
    if (known.size() > 2) {
        given.refuse(known[2], "only two of young_modulus, poisson_ratio, shear_modulus, bulk_modulus and lame_modulus "
                               "may be given");
    }
    try {
        const YoungAndPoisson moduli = young_and_poisson(keys.moduli);
        keys.material.young_modulus = moduli.young_modulus;
        keys.material.poisson_ratio = moduli.poisson_ratio;
    } catch (const std::invalid_argument& error) {
        given.refuse(known[1], error.what());
    }
    if (!kModulus.holds(keys.material.young_modulus)) {
        given.refuse(known[1], printed("with it young_modulus = %g, which must be %s", keys.material.young_modulus,
                                       std::string(kModulus.allowed).c_str()));
    }
}

void relate_material(const TableCheck& table, const MaterialKeys& keys) {
    const SpringStiffening& given = keys.material.stiffening;
    const StiffeningRange range = quadratic_stiffening(given.cubic);
    if (given.quadratic < range.least || given.quadratic > range.most) {
        table.refuse("stiffening_quadratic",
                     printed("with stiffening_cubic = %g it must be in [%g, %g], so that no spring gives way as it is "
                             "pulled",
                             given.cubic, range.least, range.most));
    }
}

constexpr KeyTable<MaterialKeys> kMaterial = {"material", "One isotropic elastic material.", kMaterialKeys,
                                              complete_material, relate_material};

constexpr Key<Label> kLabelKeys[] = {
    {"value", "", from(1, 255, "an integer from 1 to 255, different for each label"), "required",
     "the label in the voxel file, or of what `surface` encloses", member<&Label::value>},
    {"young_modulus", "Pa", from(0, kNoBound, "0, or from 1e-6 to 1e6 times that of [material]"), "required",
     "Young's modulus of its cells; 0 leaves them out", member<&Label::young_modulus>},
    {"poisson_ratio", "", kPoissonRatio, "that of [material]", "nu of its cells; not with `springs = \"means\"`",
     member<&Label::poisson_ratio>},
    {"density", "kg/m^3", kDensity, "that of [material]", "of its cells", member<&Label::density>},
    {"surface", "", words("the path of an STL, OBJ, PLY or glTF file, from the scene's folder on"), "none",
     "gives the label to what of the body is inside; with `fill = \"fraction\"` cells that it cuts are mixed",
     field<TextFormat, Unless0<&Label::surface>>},
};

void complete_label(const GivenTable& given, Label& label) {
    for (const Label& other : given.scene.labels) {
        if (other.value == label.value) {
            given.not_allowed("value");
        }
    }
}

constexpr KeyTable<Label> kLabel = {"label",
                                    "The material of the cells with one label. All else is that of `[material]` "
                                    "everywhere.",
                                    kLabelKeys, complete_label};

// -- [[fix]], [[move]] and what loads the body

constexpr Key<Fix> kFixKeys[] = {
    {"where", "", kRegion, "required", "the nodes held", member<&Fix::where>},
    {"axes", "", kAxes, "\"xyz\"", "axes along which they are held; the others stay free",
     member_as<AxesFormat, &Fix::axes>},
};
constexpr KeyTable<Fix> kFix = {"fix", "Nodes that stay where they are.", kFixKeys};

constexpr Key<Move> kMoveKeys[] = {
    {"where", "", kRegion, "required", "the nodes moved", member<&Move::where>},
    {"axes", "", kAxes, "\"xyz\"", "axes along which they are led; the others stay free",
     member_as<AxesFormat, &Move::axes>},
    {"translate", "m", kBounded, "none", "final displacement",
     field<VectorFormat<double>, Alternative<Vector3, &Move::motion>>},
    {"rotate", "", kRotationTable, "none", "final turn about the axis through the region's rest centroid",
     field<TableFormat<kRotation>, Alternative<Rotation, &Move::motion>>},
    {"over", "s", kFrom0, "1", "time from rest to the final position; 0: at once", member<&Move::over>},
};

void complete_move(const GivenTable& given, Move&) {
    if (given.count("translate", "rotate") != 1) {
        given.refuse("where", "its [[move]] must have either translate or rotate");
    }
}

constexpr KeyTable<Move> kMove = {
    "move",
    "Nodes that are led to a final position, smoothly (no jump in velocity or acceleration), and held there. Each has "
    "either `translate` or `rotate`, not both.",
    kMoveKeys, complete_move};

constexpr Key<Start> kStartKeys[] = {
    {"where", "", kRegion, "the whole body", "the nodes that begin so", member<&Start::where>},
    {"velocity", "m/s", kBounded, "[0, 0, 0]", "of them all", member<&Start::velocity>},
    {"angular_velocity", "rad/s", kBounded, "[0, 0, 0]",
     "besides, about the centre of mass of these nodes; by the right hand, as a vector along the axis",
     member<&Start::angular_velocity>},
};

void complete_start(const GivenTable& given, Start&) {
    if (given.count("velocity", "angular_velocity") == 0) {
        given.missing("velocity", "or angular_velocity must be given");
    }
}

constexpr KeyTable<Start> kStart = {
    "start",
    "Velocities at time 0; a body begins at rest without. A node that several hold has that of the last one. What is "
    "fixed or moved begins at rest: such a node must not be given another velocity along an axis that is held.",
    kStartKeys, complete_start};

constexpr Key<Gravity> kGravityKeys[] = {
    {"acceleration", "m/s^2",
     from(-1e9, 1e9, "three numbers, or rows [time, x, y, z] with ascending times, each at most 1e9 in size"),
     "required", "acts on every node; rows: see \"Time tables\"",
     field<VectorInTimeFormat, InTime<&Gravity::acceleration, &Gravity::acceleration_in_time>>},
};
constexpr KeyTable<Gravity> kGravity = {"gravity", "A uniform acceleration.", kGravityKeys};

constexpr Key<Damping> kDampingKeys[] = {
    {"mass", "1/s", kFrom0, "0", "c: the force -c m v on every node", member<&Damping::mass>},
    {"stiffness", "s", kFrom0To1e9, "0",
     "beta: a dashpot beta k along every spring of stiffness k (Kelvin-Voigt); makes the stable time step smaller",
     member<&Damping::stiffness>},
};
constexpr KeyTable<Damping> kDamping = {"damping", "What takes energy out.", kDampingKeys};

/// What a load is of is one member, told apart by its kind.
template <LoadKind kind>
struct LoadInTime : InTime<&Load::force, &Load::force_in_time> {
    static std::optional<VectorInTime> get(const Load& load) {
        return load.kind == kind ? InTime::get(load) : std::nullopt;
    }
    static void set(Load& load, VectorInTime value) {
        load.kind = kind;
        InTime::set(load, std::move(value));
    }
};

constexpr Range kForces =
    from(-1e18, 1e18, "three numbers, or rows [time, x, y, z] with ascending times, each at most 1e18 in size");

constexpr Key<Load> kLoadKeys[] = {
    {"where", "", kRegion, "required", "the nodes loaded, or the surface, or the cells by their centres",
     member<&Load::where>},
    {"force", "N", kForces, "none", "on the nodes, in all; rows: see \"Time tables\"",
     field<VectorInTimeFormat, LoadInTime<LoadKind::force>>},
    {"traction", "Pa", kForces, "none", "a force by area at rest, on the part of the surface in the region",
     field<VectorInTimeFormat, LoadInTime<LoadKind::traction>>},
    {"moment", "N m", kForces, "none", "of forces on the nodes that have no sum, about the region's middle at rest",
     field<VectorInTimeFormat, LoadInTime<LoadKind::moment>>},
    {"acceleration", "m/s^2", kForces, "none", "on the cells, by their masses: gravity of a part",
     field<VectorInTimeFormat, LoadInTime<LoadKind::acceleration>>},
    {"force_density", "N/m^3", kForces, "none", "on the cells, by their volumes at rest",
     field<VectorInTimeFormat, LoadInTime<LoadKind::force_density>>},
};

void complete_load(const GivenTable& given, Load&) {
    constexpr std::string_view kKinds[] = {"force", "traction", "moment", "acceleration", "force_density"};
    const std::string_view* last = nullptr;
    int kinds = 0;
    for (const std::string_view& kind : kKinds) {
        if (given.has(kind)) {
            last = &kind;
            ++kinds;
        }
    }
    if (kinds == 0) {
        given.missing("force", "or traction, moment, acceleration or force_density must be given");
    }
    if (kinds > 1) {
        given.refuse(*last, "only one of force, traction, moment, acceleration and force_density may be given");
    }
}

constexpr KeyTable<Load> kLoad = {
    "load",
    "A dead load, which does not turn with the body: one of these. `force` and `moment` are spread over a region's "
    "nodes in proportion to the cells that they touch, `traction` over the body's surface there by its area, that of "
    "the triangles of a `surface`, else the outer faces of cells.",
    kLoadKeys, complete_load};

constexpr Key<Pressure> kPressureKeys[] = {
    {"where", "", kRegion, "required", "the outer faces of cells whose middle at rest is in it, those of hollows too",
     member<&Pressure::where>},
    {"pressure", "Pa",
     from(-1e18, 1e18, "a number, or rows [time, pressure] with ascending times, each at most 1e18 in size"),
     "required", "above 0 it pushes into the body; rows: see \"Time tables\"",
     field<NumberInTimeFormat, InTime<&Pressure::pressure, &Pressure::pressure_in_time, NumberInTime>>},
};
constexpr KeyTable<Pressure> kPressure = {
    "pressure",
    "A pressure on the faces of cells, which follows them as they move, turn and grow; several add up. `static` and "
    "`backward-euler` take surfaces that close, or end where nodes are held.",
    kPressureKeys};

// -- [[actuate]]

constexpr Key<Actuate> kActuateKeys[] = {
    {"label", "", from(1, 255, "an integer from 1 to 255"), "none", "cells with this label", member<&Actuate::label>},
    {"where", "", kRegion, "none", "cells whose centre at rest is in it; with `label` those of both",
     member<&Actuate::where>},
    {"stretch", "",
     from(kLeastRestStretch, kMostRestStretch,
          "three numbers, or rows [time, x, y, z] with ascending times, each from 0.1 to 10"),
     "required", "of the axes x, y and z of the grid at rest; rows: see \"Time tables\"",
     field<VectorInTimeFormat, InTime<&Actuate::stretch, &Actuate::stretch_in_time>>},
};
void complete_actuate(const GivenTable& given, Actuate&) {
    if (!given.has("label") && !given.has("where")) {
        given.missing("where", "or label must be given");
    }
}
constexpr KeyTable<Actuate> kActuate = {
    "actuate",
    "Cells that are of another size at rest than they were made with: muscles that contract, tissue that swells or "
    "grows, chambers of a soft robot. A cell may be in one of these.",
    kActuateKeys, complete_actuate};

// -- [[cut]]

struct CutUntil : Member<&Cut::until> {
    static std::optional<double> get(const Cut& cut) {
        return cut.every != 0 ? std::optional(cut.until) : std::nullopt;
    }
};

constexpr Key<Cut> kCutKeys[] = {
    {"box", "m", kBox, "none", "cells whose centre is inside it or on its surface",
     field<BoxFormat, Alternative<BoxRegion, &Cut::tool>>},
    {"sphere", "", kSphereTable, "none", "cells whose centre is inside it or on its surface",
     field<TableFormat<kSphere>, Alternative<SphereRegion, &Cut::tool>>},
    {"behind", "", kPlaneTable, "none",
     "cells whose centre is on the plane or on the side that the normal points away from",
     field<TableFormat<kBehind>, Alternative<HalfSpace, &Cut::tool>>},
    {"at", "s", kFrom0, "required", "when: at the first step from then on", member<&Cut::at>},
    {"until", "s", from(0, kNoBound, "at least `at`"), "none", "with `every`: the last time",
     field<NumberFormat, CutUntil>},
    {"every", "s", above(0, kNoBound, "above 0, for at most 1e9 times"), "none",
     "with `until`: it cuts again, and again, after so long", field<NumberFormat, Unless0<&Cut::every>>},
    {"velocity", "m/s", kBounded, "[0, 0, 0]",
     "of the box, the sphere or the plane, which is as given at the time `at`", member<&Cut::velocity>},
    {"frame", "", words("\"present\" or \"rest\""), "\"present\"",
     "where a cell's centre is taken: where it is then, or where it was at rest",
     member_as<ChoiceFormat, &Cut::at_rest>},
    {"mode", "", words("\"remove\" or \"separate\""), "\"remove\"",
     "whether cells go, or part along the faces whose middle is in the tool; all cuts of a scene alike, see \"Tears\"",
     member_as<ChoiceFormat, &Cut::separates>},
};

void complete_cut(const GivenTable& given, Cut& cut) {
    if (given.count("box", "sphere", "behind") != 1) {
        given.refuse("at", "its [[cut]] must have one of box, sphere and behind");
    }
    if (given.count("until", "every") == 1) {
        given.refuse(given.has("until") ? "until" : "every", "until and every must be given together, or neither");
    }
    if (!given.has("until")) {
        cut.until = cut.at;
    }
}

void relate_cut(const TableCheck& table, const Cut& cut) {
    if (cut.every == 0) {
        return;
    }
    if (!(cut.until >= cut.at)) {
        table.not_allowed("until", cut.until);
    }
    if ((cut.until - cut.at) / cut.every > 1e9) {
        table.not_allowed("every", cut.every);
    }
}

constexpr KeyTable<Cut> kCut = {"cut",
                                "Cells that are removed while the body moves, with `symplectic-euler` or `leapfrog`: "
                                "those inside a box or a sphere, or behind a "
                                "plane; one of the three. Nodes keep their numbers, see \"Cuts\".",
                                kCutKeys, complete_cut, relate_cut};

constexpr Key<SceneObstacle> kObstacleKeys[] = {
    {"name", "", words("letters, digits, _ and -; different for each obstacle"), "\"obstacle_0\" and so on",
     "its name in the results", member_as<NameFormat, &SceneObstacle::name>},
    {"plane", "", kPlaneTable, "none", "the half-space behind a plane", field<TableFormat<kPlane>, Plane>},
    {"sphere", "", words("{center = [x, y, z], radius = r}, r at least the cell size"), "none", "a ball",
     field<TableFormat<kBall>, Ball>},
    {"box", "m",
     from(
         -1e9, 1e9,
         "[[x, y, z], [x, y, z]], low corner first, each number at most 1e9 in size, each edge at least the cell size"),
     "none", "a cuboid", field<BoxFormat, Cuboid>},
    {"capsule", "", words("{from = [x, y, z], to = [x, y, z], radius = r}, r at least the cell size"), "none",
     "a rod with round ends", field<TableFormat<kCapsule>, Capsule>},
    {"hull", "",
     words("{points = [[x, y, z], ...]} or {file = path}, also at = [x, y, z]; nowhere thinner than a cell"), "none",
     "the convex hull of points", field<TableFormat<kHull>, Made<HullShape>>},
    {"mesh", "", words("{file = path}, also cells = n, at = [x, y, z]; somewhere as thick as a cell"), "none",
     "what a closed mesh encloses", field<TableFormat<kMesh>, Made<MeshShape>>},
    {"height", "",
     words("{rows = [[height, ...], ...], spacing = s} or {file = path, spacing = s}, also at = [x, y, z]"), "none",
     "all that is below a height field", field<TableFormat<kHeight>, Made<HeightShape>>},
    {"friction", "", kFrom0To1e9, "0", "Coulomb's coefficient, sticking and sliding", member<&SceneObstacle::friction>},
    {"stiffness", "Pa/m", above(0, 1e30, "above 0 and at most 1e30"),
     "8 density cell_size / dt^2, dt the body's own stable step",
     "pressure by depth on a flat surface; none makes the stable time step shorter", member<&SceneObstacle::stiffness>},
    {"translate", "m", kBounded, "none", "how far it is led, as in [[move]]", member<&SceneObstacle::translate>},
    {"rotate", "", kRotationTable, "none", "how far it is turned about its point or middle, as in [[move]]",
     member_as<TableFormat<kRotation>, &SceneObstacle::rotate>},
    {"over", "s", kFrom0, "1", "time of translate and rotate; 0: at once", member<&SceneObstacle::over>},
    {"velocity", "m/s", kBounded, "[0, 0, 0]", "a constant velocity, besides; of a free one that at the start",
     member<&SceneObstacle::velocity>},
    {"mass", "kg", above(0, 1e30, "above 0 and at most 1e30"), "none: it is led",
     "makes it free: bodies and gravity move it, obstacles do not; with symplectic-euler or leapfrog",
     field<NumberFormat, Unless0<&SceneObstacle::mass>>},
    {"inertia", "kg m^2", above(0, 1e30, "three numbers, each above 0 and at most 1e30"), "those of the full shape",
     "of a free one about its axes, its principal ones", field<VectorFormat<double>, Unless0<&SceneObstacle::inertia>>},
};

void complete_obstacle(const GivenTable& given, SceneObstacle& obstacle) {
    constexpr std::array kShapes = {"plane", "sphere", "box", "capsule", "hull", "mesh", "height"};
    const auto has = [&](const char* shape) { return given.has(shape); };
    const auto shapes = std::count_if(kShapes.begin(), kShapes.end(), has);
    if (shapes == 0) {
        given.missing("plane", "or sphere, box, capsule, hull, mesh or height must be given");
    }
    if (shapes > 1) {
        given.refuse(*std::find_if(kShapes.rbegin(), kShapes.rend(), has),
                     "only one of plane, sphere, box, capsule, hull, mesh and height may be given");
    }
    if (!given.has("name")) {
        obstacle.name = "obstacle_" + std::to_string(given.scene.obstacles.size());
    }
    for (const SceneObstacle& other : given.scene.obstacles) {
        if (other.name == obstacle.name) {
            if (given.has("name")) {
                given.not_allowed("name");
            }
            given.refuse("name", "missing; another [[obstacle]] is named " + obstacle.name);
        }
    }
}

void relate_obstacle(const TableCheck& table, const SceneObstacle& obstacle) {
    if (obstacle.mass == 0) {
        if (obstacle.inertia != Vector3{0, 0, 0}) {
            table.refuse("inertia", "it is of a free obstacle, which has a mass");
        }
        return;
    }
    if (std::holds_alternative<PlaneShape>(obstacle.shape) || std::holds_alternative<HeightShape>(obstacle.shape)) {
        table.refuse("mass", "a plane and a height field have no end, and cannot be free");
    }
    if (obstacle.translate || obstacle.rotate) {
        table.refuse(obstacle.translate ? "translate" : "rotate", "an obstacle with a mass is free: nothing leads it");
    }
}

constexpr KeyTable<SceneObstacle> kObstacle = {
    "obstacle",
    "A rigid obstacle that the body's surface nodes touch, with Coulomb friction. Each has one of `plane`, `sphere`, "
    "`box`, `capsule`, `hull`, `mesh` and `height`. By any method; `static` and `backward-euler` without friction.",
    kObstacleKeys, complete_obstacle, relate_obstacle};

// -- [solver], [output] and [[probe]]

/// A static solve takes no time.
struct Duration : Member<&Solver::duration> {
    static std::optional<double> get(const Solver& solver) {
        const bool none = timeless(solver.method) && solver.duration == 0;
        return none ? std::nullopt : std::optional(solver.duration);
    }
};

/// No other method has modes to count.
struct Counted : Member<&Solver::count> {
    static std::optional<Stored> get(const Solver& solver) {
        const bool counts = solver.method == SolverMethod::modes || solver.method == SolverMethod::buckling;
        return counts ? std::optional(solver.count) : std::nullopt;
    }
};

constexpr Key<Solver> kSolverKeys[] = {
    {"method", "", kMethod, "\"symplectic-euler\"",
     "semi-implicit Euler, explicit in time; leapfrog, likewise and of the second order; backward Euler, stable at any "
     "step; or the equilibrium alone; the lowest vibrations about it; or the least factors of loads and moves at which "
     "the body buckles",
     member_as<ChoiceFormat, &Solver::method>},
    {"time_step", "s",
     above(0, kNoBound,
           "above 0; for symplectic-euler and leapfrog at most the stable time step, which `hybmss explain` prints"),
     "0.7 of the stable one; 20 times that for backward-euler", "length of a step; not used by static",
     member<&Solver::time_step>},
    {"duration", "s", from(1e-15, kNoBound, "at least 1e-15"), "none",
     "simulated time, at most; required unless static, modes or buckling", field<NumberFormat, Duration>},
    {"tolerance", "", above(0, 0.1, "above 0 and at most 0.1"), "none; static: 1e-8, float 1e-4",
     "in time: given, the run ends as soon as the body has settled; see \"Settled\". Static: bound of the residual",
     member<&Solver::tolerance>},
    {"accuracy", "", from(1e-9, 0.1, "at least 1e-9 and at most 0.1"), "none",
     "static: the relative error wanted of the results; chooses float or double, the tolerance and, where the body "
     "leaves it free, the mesh, see \"Accuracy\"",
     member<&Solver::accuracy>},
    {"load_steps", "", from(1, 1e6, "an integer, at least 1 and at most 1e6"), "1",
     "static: the first load step is one part in so many of the loading; those after it grow while they find "
     "equilibria",
     member<&Solver::load_steps>},
    {"preconditioner", "", words("\"automatic\", \"block-jacobi\" or \"multigrid\""), "\"automatic\"",
     "of the linear solves in static and backward-euler", member_as<ChoiceFormat, &Solver::preconditioner>},
    {"count", "", from(1, 1000, "an integer from 1 to 1000"), "6",
     "of the modes, or buckling loads, that are looked for", field<IntegerFormat, Counted>},
};

void complete_solver(const GivenTable& given, Solver& solver) {
    if (!timeless(solver.method) && !given.has("duration")) {
        given.missing("duration");
    }
    if (solver.method != SolverMethod::modes && solver.method != SolverMethod::buckling && given.has("count")) {
        given.refuse("count", "it is of modes or buckling loads: method must be \"modes\" or \"buckling\"");
    }
    if (solver.method != SolverMethod::static_equilibrium && given.has("accuracy")) {
        given.refuse("accuracy", "only a static solve tells its error: method must be \"static\"");
    }
}

constexpr KeyTable<Solver> kSolver = {"solver", "How the motion or the equilibrium is computed, and when it ends.",
                                      kSolverKeys, complete_solver};

constexpr Key<Output> kOutputKeys[] = {
    {"every", "s", kAbove0, "first and last state only", "time between results", member<&Output::every>},
    {"energy_balance", "", words("true or false"), "false",
     "meter works and losses in every step, which makes it several times slower; symplectic-euler or leapfrog",
     member<&Output::energy_balance>},
    {"mass", "", words("true or false"), "false", "`mass` of the nodes (kg) in the .vtu files", member<&Output::mass>},
    {"reaction", "", words("true or false"), "false",
     "`reaction` of the nodes (N) in the .vtu files: the force of what fixes or moves them, 0 elsewhere; `contact`, "
     "that "
     "of obstacles; in the summary what each fix and move exerts",
     member<&Output::reaction>},
    {"skin", "", words("true, false, \"vtp\", \"obj\" or \"ply\""), "false",
     "triangles that move with the body in files of that kind, true: .vtp: its `surface`, or the boundary of its cells",
     member_as<SkinFileFormat, &Output::skin>},
    {"smooth", "", words("true or false"), "false",
     "with `skin`, of a body without `surface`, or with its `fill` of fractions: the boundary of cells is smoothed",
     member<&Output::smooth>},
    {"stress", "", words("true or false"), "false",
     "stress, strain and energy of the cells in the .vtu files, the greatest and the mean stress in the summary",
     member<&Output::stress>},
};
void complete_output(const GivenTable& given, Output& output) {
    if (output.smooth && output.skin == SkinFile::none) {
        given.refuse("smooth", "there is nothing to smooth; it must be given with skin");
    }
}

constexpr KeyTable<Output> kOutput = {"output", "What `--out` holds, besides the summary and the last state.",
                                      kOutputKeys, complete_output};

constexpr Key<Probe> kProbeKeys[] = {
    {"name", "", words("letters, digits, _ and -; different for each probe"), "required", "its name in the results",
     member_as<NameFormat, &Probe::name>},
    {"where", "", kRegion, "required", "the nodes read", member<&Probe::where>},
};

void complete_probe(const GivenTable& given, Probe& probe) {
    for (const Probe& other : given.scene.probes) {
        if (other.name == probe.name) {
            given.refuse("name", "another [[probe]] has this name; each must have its own");
        }
    }
}

constexpr KeyTable<Probe> kProbe = {"probe", "A region whose support force, torque and displacement are reported.",
                                    kProbeKeys, complete_probe};

// -- Tables of a scene

// [name] is one part of the scene, [[name]] as many as a list of it holds.
template <class T>
std::span<const T> all_of(const std::vector<T>& list) {
    return list;
}
template <class T>
std::span<const T> all_of(const T& part) {
    return {&part, 1};
}
template <const auto& table, auto part>
constexpr SceneTable of_scene(bool required = false) {
    constexpr bool kRepeated = requires(Scene & scene) {
        (scene.*part).push_back({});
    };
    return {table.name,
            table.meaning,
            required,
            kRepeated,
            [] { return table.described(); },
            [](Scene& scene, const SceneValue& value, const std::string& path) {
                if constexpr (kRepeated) {
                    (scene.*part).push_back(table.read(scene, value, path));
                } else {
                    scene.*part = table.read(scene, value, path);
                }
            },
            [](const Scene& scene) {
                std::size_t number = 0;
                for (const auto& item : all_of(scene.*part)) {
                    std::string path(table.name);
                    if (kRepeated) {
                        path.append("[").append(std::to_string(number++)).append("]");
                    }
                    table.check({scene, path, table.described(), false}, item);
                }
            },
            [](const Scene& scene) {
                SceneValue::Array written;
                for (const auto& item : all_of(scene.*part)) {
                    written.push_back(table.write(item));
                }
                return written;
            }};
}

/// The value of a key.
template <const auto& table>
constexpr SceneTable inner() {
    return {table.name, table.meaning, false, false, [] { return table.described(); }};
}

MaterialKeys keys_of(const Scene& scene) {
    return {scene.material, {}, {}, scene.relaxation, scene.tear_strain};
}
/// Two parts of a scene.
constexpr SceneTable material_table() {
    return {kMaterial.name,
            kMaterial.meaning,
            true,
            false,
            [] { return kMaterial.described(); },
            [](Scene& scene, const SceneValue& value, const std::string& path) {
                MaterialKeys keys = kMaterial.read(scene, value, path);
                scene.material = keys.material;
                scene.relaxation = std::move(keys.relaxation);
                scene.tear_strain = keys.tear_strain;
            },
            [](const Scene& scene) {
                kMaterial.check({scene, std::string(kMaterial.name), kMaterial.described(), false}, keys_of(scene));
            },
            [](const Scene& scene) { return SceneValue::Array{kMaterial.write(keys_of(scene))}; }};
}

constexpr SceneTable kTables[] = {
    of_scene<kBody, &Scene::body>(true),
    material_table(),
    of_scene<kLabel, &Scene::labels>(),
    of_scene<kFix, &Scene::fixes>(),
    of_scene<kMove, &Scene::moves>(),
    of_scene<kStart, &Scene::starts>(),
    of_scene<kGravity, &Scene::gravity>(),
    of_scene<kDamping, &Scene::damping>(),
    of_scene<kLoad, &Scene::loads>(),
    of_scene<kPressure, &Scene::pressures>(),
    of_scene<kActuate, &Scene::actuations>(),
    of_scene<kCut, &Scene::cuts>(),
    of_scene<kObstacle, &Scene::obstacles>(),
    of_scene<kSolver, &Scene::solver>(true),
    of_scene<kOutput, &Scene::output>(),
    of_scene<kProbe, &Scene::probes>(),
    inner<kPlace>(),
    inner<kBehind>(),
    inner<kRotation>(),
    inner<kWhere>(),
    inner<kSphere>(),
    inner<kPlane>(),
    inner<kBall>(),
    inner<kCapsule>(),
    inner<kHull>(),
    inner<kMesh>(),
    inner<kHeight>(),
};

} // namespace

std::span<const SceneTable> scene_tables() {
    return kTables;
}

// A face of the bounding box has a name; every other region is a table of one key.
Region RegionFormat::read(const Given& given) {
    if (const auto* face = given.value.as<std::string>()) {
        const std::string side = face->size() == 5 ? face->substr(1) : "";
        if ((side != "-min" && side != "-max") || (*face)[0] < 'x' || (*face)[0] > 'z') {
            given.refuse();
        }
        return FaceRegion{(*face)[0] - 'x', side == "-max"};
    }
    const Region region = TableFormat<kWhere>::read(given);
    const auto* difference = std::get_if<RegionWithout>(&region);
    if (given.as<SceneValue::Table>().size() != (difference ? 2 : 1) ||
        (difference && (difference->of.empty() || difference->without.empty()))) {
        given.refuse();
    }
    return region;
}

void RegionFormat::check(const Check& check, const Region& region) {
    const auto check_keys = [&](const auto& table, const auto& owner) {
        for (const auto& key : table.keys) {
            key.field.check({check.scene, check.path, key.range, false}, owner);
        }
    };
    if (const auto* face = std::get_if<FaceRegion>(&region)) {
        AxisFormat::check(check, face->axis);
    } else if (const auto* sphere = std::get_if<SphereRegion>(&region)) {
        check_keys(kSphere, *sphere);
    } else {
        const auto* difference = std::get_if<RegionWithout>(&region);
        if (difference && difference->of.size() != 1) {
            check.refuse(static_cast<double>(difference->of.size()), "one region that others are taken from");
        }
        check_keys(kWhere, region);
    }
}

SceneValue RegionFormat::write(const Region& region, const Range&) {
    if (const auto* face = std::get_if<FaceRegion>(&region)) {
        return {static_cast<char>('x' + face->axis) + std::string(face->high ? "-max" : "-min")};
    }
    return kWhere.write(region);
}

std::vector<Region> RegionListFormat::read(const Given& given) {
    std::vector<Region> regions;
    for (const SceneValue& item : given.as<SceneValue::Array>()) {
        regions.push_back(RegionFormat::read({given, given.source, item}));
    }
    return regions;
}

void RegionListFormat::check(const Check& check, const std::vector<Region>& regions) {
    for (const Region& region : regions) {
        RegionFormat::check(check, region);
    }
}

SceneValue RegionListFormat::write(const std::vector<Region>& regions, const Range& range) {
    SceneValue::Array items;
    for (const Region& region : regions) {
        items.push_back(RegionFormat::write(region, range));
    }
    return {std::move(items)};
}

} // namespace scene_format

std::string_view name(SolverMethod method) {
    return scene_format::ChoiceFormat::word(scene_format::kMethod, static_cast<int>(method));
}

} // namespace hybmss
