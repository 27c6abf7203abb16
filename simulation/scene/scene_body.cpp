#include "simulation/scene/scene_body.hpp"

#include "layouts/messages.hpp"
#include "layouts/read_file.hpp"
#include "simulation/geometry/triangle_surface.hpp"
#include "simulation/geometry/voxel_grid.hpp"
#include "simulation/scene/other_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <utility>

namespace hybmss {
namespace {

// Ratios of stiffness beyond these leave nothing of the softer material in float.
constexpr double kLowestRatio = 1e-6, kHighestRatio = 1e6;

using CellCounts = std::array<std::size_t, 256>; ///< by label

std::string list_of_labels(const CellCounts& counts) {
    std::string list;
    for (std::size_t value = 1; value < counts.size(); ++value) {
        if (counts[value] > 0) {
            list += (list.empty() ? "" : ", ") + std::to_string(value);
        }
    }
    return list;
}

/// The materials of a body's cells, the scene's first, and of each label in use the number that stands for its material
/// (Lattice::from_materials).
struct LabelMaterials {
    std::vector<Material> materials;
    std::array<std::uint8_t, 256> number{};
};

LabelMaterials label_materials(const Scene& scene, const CellCounts& counts) {
    LabelMaterials found{{scene.material}, {}};
    std::array<bool, 256> known{};
    known[0] = true;
    for (std::size_t l = 0; l < scene.labels.size(); ++l) {
        const Label& label = scene.labels[l];
        const std::string path = "label[" + std::to_string(l) + "]";
        if (known[label.value]) {
            throw scene_error(scene, path + ".value", "it must be above 0, and different for each [[label]]");
        }
        const double ratio = label.young_modulus / scene.material.young_modulus;
        if (ratio != 0 && !(ratio >= kLowestRatio && ratio <= kHighestRatio && label.young_modulus <= 1e18)) {
            throw scene_error(scene, path + ".young_modulus",
                              "it must be 0, or from 1e-6 to 1e6 times that of [material], at most 1e18");
        }
        if (scene.material.springs == SpringForm::means &&
            label.poisson_ratio.value_or(scene.material.poisson_ratio) != scene.material.poisson_ratio) {
            throw scene_error(scene, path + ".poisson_ratio", "with springs = \"means\" it must be that of [material]");
        }
        known[label.value] = true;
        if (ratio != 0) {
            const Material own = material_of(label, scene.material);
            const auto same = std::find(found.materials.begin(), found.materials.end(), own);
            found.number[label.value] = static_cast<std::uint8_t>(1 + (same - found.materials.begin()));
            if (same == found.materials.end()) {
                found.materials.push_back(own);
            }
            if (found.materials.size() > 255) {
                throw scene_error(scene, path + ".value", "there may be 254 materials beside that of [material]");
            }
        }
    }
    for (std::size_t value = 1; value < counts.size(); ++value) {
        if (counts[value] == 0) {
            continue;
        }
        if (scene.labels.empty()) {
            if (list_of_labels(counts) != std::to_string(value)) {
                throw scene_error(scene, body_key(scene.body),
                                  "it has the labels " + list_of_labels(counts) +
                                      "; where there is more than one, each must have a [[label]] with its stiffness");
            }
            found.number[value] = 1;
        } else if (!known[value] && value == 1 && scene.body.voxels.empty()) {
            found.number[value] = 1; // what no label's surface encloses
        } else if (!known[value]) {
            throw scene_error(scene, body_key(scene.body),
                              "label " + std::to_string(value) + " (" + std::to_string(counts[value]) +
                                  " cells) has no [[label]]; it has the labels " + list_of_labels(counts));
        }
    }
    return found;
}

/// What both are together where they share a cell, t of it the second: their moduli of shear and of volume add up, as
/// those of springs side by side do.
Material mixed(const Material& first, const Material& second, double t) {
    const auto between = [t](double a, double b) { return a + t * (b - a); };
    Material both = first;
    both.density = between(first.density, second.density);
    if (first.poisson_ratio == second.poisson_ratio) {
        both.young_modulus = between(first.young_modulus, second.young_modulus);
        return both;
    }
    const auto bulk = [](const Material& m) { return m.young_modulus / (3 * (1 - 2 * m.poisson_ratio)); };
    const double k = between(bulk(first), bulk(second)), g = between(shear_modulus(first), shear_modulus(second));
    both.young_modulus = 9 * k * g / (3 * k + g);
    both.poisson_ratio = (3 * k - 2 * g) / (2 * (3 * k + g));
    return both;
}

/// Gives the cells that labels' surfaces cut materials of their own. A label that is left out takes its part of what
/// they have instead.
void mix_inclusions(const Scene& scene, std::vector<std::uint8_t>& numbers, std::vector<Material>& materials,
                    std::vector<float>& fills) {
    constexpr std::size_t kWhole = 64;
    const auto label_of = [&](std::size_t value) {
        return std::ranges::find(scene.labels, value, [](const Label& label) { return std::size_t{label.value}; });
    };
    const auto base_label = label_of(1);
    const Material base = base_label == scene.labels.end() ? scene.material : material_of(*base_label, scene.material);
    std::map<std::pair<std::size_t, std::size_t>, std::uint8_t> known;
    const SceneBody& body = scene.body;
    for (std::size_t c = 0; c < body.inclusion.size(); ++c) {
        const std::size_t value = body.inclusion[c], part = body.inclusion_part[c];
        if (value == 0 || part == kWhole) {
            continue;
        }
        const Label& label = *label_of(value);
        if (label.young_modulus == 0) {
            numbers[c] = 1;
            fills[c] *= static_cast<float>(kWhole - part) / kWhole;
            continue;
        }
        const auto [entry, is_new] = known.try_emplace({value, part}, std::uint8_t{0});
        if (is_new) {
            if (materials.size() == 255) {
                throw scene_error(scene, "label[" + std::to_string(&label - scene.labels.data()) + "].surface",
                                  "it makes too many materials of cells that are cut: three such labels always go");
            }
            materials.push_back(mixed(base, material_of(label, scene.material), static_cast<double>(part) / kWhole));
            entry->second = static_cast<std::uint8_t>(materials.size());
        }
        numbers[c] = entry->second;
    }
}

} // namespace

Material material_of(const Label& label, const Material& material) {
    Material own = material;
    own.young_modulus = label.young_modulus;
    own.poisson_ratio = label.poisson_ratio.value_or(material.poisson_ratio);
    own.density = label.density.value_or(material.density);
    return own;
}

std::string body_key(const SceneBody& body) {
    return body.shape == SceneCells::mesh ? "body.mesh"
           : !body.voxels.empty()         ? "body.voxels"
           : !body.surface.empty()        ? "body.surface"
                                          : "body.cells";
}

Lattice scene_lattice(const Scene& scene) {
    require_cubes(scene, "a lattice");
    const SceneBody& body = scene.body;
    const auto nx = static_cast<int>(body.cells[0]), ny = static_cast<int>(body.cells[1]),
               nz = static_cast<int>(body.cells[2]);
    if (body.labels.empty()) {
        if (!scene.labels.empty()) {
            throw scene_error(scene, "label[0].value", "the cells of a box have no labels; only those of voxels have");
        }
        return Lattice::box(nx, ny, nz, body.cell_size);
    }
    CellCounts counts{};
    for (std::uint8_t label : body.labels) {
        ++counts[label];
    }
    LabelMaterials of = label_materials(scene, counts);
    std::vector<std::uint8_t> numbers(body.labels.size());
    std::transform(body.labels.begin(), body.labels.end(), numbers.begin(),
                   [&](std::uint8_t label) { return of.number[label]; });
    if (std::all_of(numbers.begin(), numbers.end(), [](std::uint8_t number) { return number == 0; })) {
        throw scene_error(scene, body_key(body), "the body is empty: at least one cell must be filled");
    }
    if (body.inclusion.empty()) {
        return Lattice::from_materials(nx, ny, nz, body.cell_size, numbers, of.materials, body.fills);
    }
    std::vector<float> fills = body.fills;
    mix_inclusions(scene, numbers, of.materials, fills);
    return Lattice::from_materials(nx, ny, nz, body.cell_size, numbers, of.materials, fills);
}

namespace {

void read_voxel_body(Scene& scene, const std::filesystem::path& path) {
    VoxelGrid grid = read_voxels(path);
    SceneBody& body = scene.body;
    if (grid.spacing) {
        const auto& [dx, dy, dz] = *grid.spacing;
        const double edge = body.cell_size > 0 ? body.cell_size : std::min({dx, dy, dz});
        const std::string voxels = grid_text(grid.cells);
        const std::string spacing = printed("%g x %g x %g m", dx, dy, dz);
        grid = resampled(grid, edge);
        body.resampled = printed("%s voxels of %s made %s cubes of %g m, each with the label at its centre",
                                 voxels.c_str(), spacing.c_str(), grid_text(grid.cells).c_str(), edge);
    }
    if (body.cell_size == 0) {
        if (!grid.cell_size) {
            throw std::runtime_error("it tells no size of its voxels, so body.cell_size must be given");
        }
        if (!(*grid.cell_size >= 1e-6 && *grid.cell_size <= 1e6)) {
            throw std::runtime_error("its voxels have edges of " + std::to_string(*grid.cell_size) +
                                     " m; they must be at least 1e-6 and at most 1e6");
        }
        body.cell_size = *grid.cell_size;
    }
    body.cells = grid.cells;
    body.labels = std::move(grid.labels);
}

void read_surface_body(Scene& scene, const std::filesystem::path& path) {
    TriangleSurface surface = read_surface(path);
    weld(surface);
    const Orientation orientation = require_closed(surface);
    const bool fractions = scene.body.fractions;
    SceneBody body = (fractions ? filled : voxelised)(surface, orientation, scene.body.cell_size);
    body.surface = scene.body.surface;
    body.place = scene.body.place;
    body.fractions = fractions;
    body.skin_touches = scene.body.skin_touches;
    body.surface_volume = std::abs(enclosed_volume(surface));
    if (scene.output.skin != SkinFile::none || body.skin_touches ||
        std::any_of(scene.loads.begin(), scene.loads.end(),
                    [](const Load& load) { return load.kind == LoadKind::traction; })) { // else it is of no use
        for (Vector3& vertex : surface.vertices) {
            for (std::size_t a = 0; a < 3; ++a) {
                vertex[a] -= body.origin[a];
            }
        }
        body.mesh = std::move(surface);
    }
    scene.body = std::move(body);
}

/// Gives the label to the cells inside its surface; of fractions what is inside of each.
void read_label_surface(Scene& scene, const Label& label, const std::filesystem::path& path) {
    SceneBody& body = scene.body;
    if (body.labels.empty()) { // a full box
        body.labels.assign(sample_bytes(body.cells, {.bytes = 1}), 1);
    }
    TriangleSurface surface = read_surface(path);
    weld(surface);
    const Orientation orientation = require_closed(surface);
    std::size_t reached = 0;
    if (!body.fractions) {
        const std::vector<std::uint8_t> inside = centres_inside(surface, orientation, body);
        for (std::size_t c = 0; c < inside.size(); ++c) {
            if (inside[c] != 0 && body.labels[c] != 0) {
                body.labels[c] = label.value;
                ++reached;
            }
        }
    } else {
        const std::vector<float> parts = parts_inside(surface, orientation, body);
        body.inclusion.resize(parts.size(), 0);
        body.inclusion_part.resize(parts.size(), 0);
        for (std::size_t c = 0; c < parts.size(); ++c) {
            const long part = std::lround(64 * parts[c]);
            if (part > 0 && body.labels[c] != 0) {
                body.inclusion[c] = label.value;
                body.inclusion_part[c] = static_cast<std::uint8_t>(part);
                body.labels[c] = part >= 32 ? label.value : body.labels[c];
                ++reached;
            }
        }
    }
    if (reached == 0) {
        throw std::runtime_error("none of the body's cells is inside");
    }
}

/// A row of numbers a line, with blanks or commas between; lines that begin with # are none.
HeightShape read_heights(const std::filesystem::path& path, double spacing) {
    std::istringstream lines(read_file(path, Readable::regular_file, std::uintmax_t{1} << 30));
    std::vector<double> heights;
    std::size_t rows = 0, columns = 0, number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        std::replace_if(
            line.begin(), line.end(), [](char c) { return c == ',' || c == '\r'; }, ' ');
        std::istringstream words(line[0] == '#' ? std::string() : line);
        const std::size_t before = heights.size();
        for (std::string word; words >> word;) {
            if (!parse_number(word, heights.emplace_back())) {
                throw std::runtime_error(printed("line %zu: %s is no number", number, one_line(word).c_str()));
            }
        }
        const std::size_t found = heights.size() - before;
        if (found > 0 && found != (columns == 0 ? found : columns)) {
            throw std::runtime_error(printed("line %zu has %zu numbers, those before it %zu", number, found, columns));
        }
        columns = found > 0 ? found : columns;
        rows += found > 0 ? 1 : 0;
    }
    return HeightShape({columns, rows}, {spacing, spacing}, heights);
}

void read_obstacle_files(Scene& scene, const std::filesystem::path& folder) {
    for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
        const ObstacleSource& source = scene.obstacles[o].source;
        ObstacleShape& shape = scene.obstacles[o].shape;
        if (source.file.empty()) {
            continue;
        }
        const bool is_hull = std::holds_alternative<HullShape>(shape),
                   is_mesh = std::holds_alternative<MeshShape>(shape);
        try {
            if (is_hull) {
                shape = HullShape(read_surface(folder / source.file).vertices);
            } else if (is_mesh) {
                const TriangleSurface surface = read_surface(folder / source.file);
                shape = MeshShape(surface.vertices, surface.triangles, source.cells);
            } else {
                shape = read_heights(folder / source.file, source.spacing);
            }
        } catch (const std::exception& error) {
            throw scene_error(scene,
                              "obstacle[" + std::to_string(o) + "]." +
                                  (is_hull   ? "hull"
                                   : is_mesh ? "mesh"
                                             : "height") +
                                  ".file",
                              error.what());
        }
    }
}

} // namespace

void read_body_files(Scene& scene) {
    const std::filesystem::path folder = std::filesystem::path(scene.source.file).parent_path();
    try {
        if (!scene.body.voxels.empty()) {
            read_voxel_body(scene, folder / scene.body.voxels);
        } else if (!scene.body.surface.empty()) {
            read_surface_body(scene, folder / scene.body.surface);
        } else if (!scene.body.mesh_file.empty()) {
            scene.body.cell_mesh = read_cells((folder / scene.body.mesh_file).string());
            scene.body.cell_size = edge_of_mesh(scene.body.cell_mesh);
        }
    } catch (const std::runtime_error& error) {
        throw scene_error(scene, body_key(scene.body), error.what());
    } catch (const std::invalid_argument& error) {
        throw scene_error(scene, body_key(scene.body), error.what());
    }
    for (std::size_t l = 0; l < scene.labels.size(); ++l) {
        const Label label = scene.labels[l];
        if (label.surface.empty()) {
            continue;
        }
        const std::string key = "label[" + std::to_string(l) + "].surface";
        if (scene.body.shape != SceneCells::cubes) {
            throw scene_error(scene, key, "the body's cells are no cubes: they are of the one [material]");
        }
        if (scene.body.size != Vector3{} && scene.body.cell_size == 0) {
            throw scene_error(scene, key, "the cells of a box whose mesh is free have no labels");
        }
        try {
            read_label_surface(scene, label, folder / label.surface);
        } catch (const std::runtime_error& error) {
            throw scene_error(scene, key, error.what());
        }
    }
    read_obstacle_files(scene, folder);
    for (std::size_t a = 0; a < 3; ++a) {
        scene.body.origin[a] += scene.body.place.translate[a];
    }
}

namespace {

template <class Inside>
std::vector<std::uint32_t> where(std::span<const Vector3> rest, Inside inside) {
    std::vector<std::uint32_t> nodes;
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (inside(rest[n])) {
            nodes.push_back(static_cast<std::uint32_t>(n));
        }
    }
    return nodes;
}

std::vector<std::uint32_t> select(std::span<const Vector3> rest, double slack, const FaceRegion& face) {
    const auto axis = static_cast<std::size_t>(face.axis);
    const auto below = [axis](const Vector3& a, const Vector3& b) { return a[axis] < b[axis]; };
    const auto [low, high] = std::minmax_element(rest.begin(), rest.end(), below);
    const double plane = face.high ? (*high)[axis] : (*low)[axis];
    return where(rest, [&](const Vector3& x) { return std::abs(x[axis] - plane) <= slack; });
}

/// In a box or a sphere.
std::vector<std::uint32_t> select(std::span<const Vector3> rest, double slack, const auto& solid) {
    return where(rest, [&](const Vector3& x) { return inside(solid, x, slack); });
}

std::vector<std::uint32_t> select(std::span<const Vector3> rest, double, const NodeRegion& region) {
    if (region.node < 0 || static_cast<std::uint64_t>(region.node) >= rest.size()) {
        return {};
    }
    return {static_cast<std::uint32_t>(region.node)};
}

std::vector<std::uint32_t> select(std::span<const Vector3> rest, double slack, const RegionWithout& region) {
    std::vector<std::uint32_t> nodes = select_nodes(rest, 1e6 * slack, region.of.at(0));
    for (const Region& other : region.without) {
        const std::vector<std::uint32_t> out = select_nodes(rest, 1e6 * slack, other); // ascending, as all are
        std::erase_if(nodes, [&](std::uint32_t n) { return std::binary_search(out.begin(), out.end(), n); });
    }
    return nodes;
}

} // namespace

bool inside(const BoxRegion& box, const Vector3& x, double slack) {
    bool all = true;
    for (std::size_t a = 0; a < 3; ++a) {
        all = all && x[a] >= box.low[a] - slack && x[a] <= box.high[a] + slack;
    }
    return all;
}

bool inside(const SphereRegion& sphere, const Vector3& x, double slack) {
    const Vector3& c = sphere.center;
    return std::hypot(x[0] - c[0], x[1] - c[1], x[2] - c[2]) <= sphere.radius + slack;
}

std::vector<Vector3> rest_positions(const Lattice& lattice, const Vector3& origin) {
    std::vector<Vector3> rest;
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    rest.reserve(nodes.size());
    for (std::uint32_t grid_node : nodes) {
        const Vector3 x = lattice.rest_position(grid_node);
        rest.push_back({origin[0] + x[0], origin[1] + x[1], origin[2] + x[2]});
    }
    return rest;
}

std::vector<std::uint32_t> select_nodes(std::span<const Vector3> rest, double cell_size, const Region& region) {
    return std::visit([&](const auto& shape) { return select(rest, 1e-6 * cell_size, shape); }, region);
}

Vector3 rest_centroid(std::span<const Vector3> rest, std::span<const std::uint32_t> nodes) {
    Vector3 centroid = {0, 0, 0};
    for (std::uint32_t n : nodes) {
        for (std::size_t a = 0; a < 3; ++a) {
            centroid[a] += rest[n][a] / static_cast<double>(nodes.size());
        }
    }
    return centroid;
}

} // namespace hybmss
