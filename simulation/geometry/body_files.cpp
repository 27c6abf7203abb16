#include "simulation/geometry/body_files.hpp"

#include "simulation/geometry/triangle_surface.hpp"
#include "simulation/geometry/voxel_grid.hpp"
#include "simulation/scene/scene_lattice.hpp"

#include <filesystem>
#include <utility>

namespace hybmss {
namespace {

void read_voxel_body(Scene& scene, const std::filesystem::path& path) {
    VoxelGrid grid = read_voxels(path);
    SceneBody& body = scene.body;
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
    SceneBody body = voxelised(surface, orientation, scene.body.cell_size);
    body.surface = scene.body.surface;
    scene.body = std::move(body);
}

} // namespace

void read_body_files(Scene& scene) {
    if (body_key(scene.body) == "body.cells") {
        return;
    }
    const std::filesystem::path folder = std::filesystem::path(scene.source.file).parent_path();
    try {
        if (!scene.body.voxels.empty()) {
            read_voxel_body(scene, folder / scene.body.voxels);
        } else {
            read_surface_body(scene, folder / scene.body.surface);
        }
    } catch (const std::runtime_error& error) {
        throw scene_error(scene, body_key(scene.body), error.what());
    }
}

} // namespace hybmss
