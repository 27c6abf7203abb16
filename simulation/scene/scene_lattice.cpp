#include "simulation/scene/scene_lattice.hpp"

#include <array>
#include <cmath>

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

/// The stiffness scale of each label in use: Young's modulus over that of the scene's material.
std::array<float, 256> label_scales(const Scene& scene, const CellCounts& counts) {
    std::array<float, 256> scales{};
    std::array<bool, 256> known{};
    known[0] = true;
    for (std::size_t l = 0; l < scene.labels.size(); ++l) {
        const Label& label = scene.labels[l];
        const std::string path = "label[" + std::to_string(l) + "]";
        if (known[label.value]) {
            throw scene_error(scene, path + ".value", "it must be above 0, and different for each [[label]]");
        }
        const double ratio = label.young_modulus / scene.material.young_modulus;
        if (ratio != 0 && !(ratio >= kLowestRatio && ratio <= kHighestRatio)) {
            throw scene_error(scene, path + ".young_modulus",
                              "it must be 0, or from 1e-6 to 1e6 times that of [material]");
        }
        known[label.value] = true;
        scales[label.value] = static_cast<float>(ratio);
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
            scales[value] = 1;
        } else if (!known[value]) {
            throw scene_error(scene, body_key(scene.body),
                              "label " + std::to_string(value) + " (" + std::to_string(counts[value]) +
                                  " cells) has no [[label]]; it has the labels " + list_of_labels(counts));
        }
    }
    return scales;
}

} // namespace

std::string body_key(const SceneBody& body) {
    return !body.voxels.empty() ? "body.voxels" : !body.surface.empty() ? "body.surface" : "body.cells";
}

Lattice scene_lattice(const Scene& scene) {
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
    const std::array<float, 256> scales = label_scales(scene, counts);
    std::vector<float> cells;
    cells.reserve(body.labels.size());
    bool filled = false;
    for (std::uint8_t label : body.labels) {
        cells.push_back(scales[label]);
        filled = filled || scales[label] > 0;
    }
    if (!filled) {
        throw scene_error(scene, body_key(body), "the body is empty: at least one cell must be filled");
    }
    return Lattice::from_cells(nx, ny, nz, body.cell_size, std::move(cells));
}

} // namespace hybmss
