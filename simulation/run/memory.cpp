#include "simulation/run/memory.hpp"

#include "layouts/messages.hpp"
#include "plan/bodies/layout_table.hpp"
#include "simulation/scene/scene_body.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace hybmss {
namespace {

std::string gigabytes(double bytes) {
    return printed("%.3g GB", bytes / 1e9);
}

double grid_nodes(const SceneBody& body) {
    double nodes = 1;
    for (std::int64_t n : body.cells) {
        nodes *= static_cast<double>(n) + 1;
    }
    return nodes;
}

LatticeExtent full_extent(const SceneBody& body) {
    constexpr double kLanes = 16;
    LatticeExtent extent{grid_nodes(body), 1, 0, 0};
    for (std::int64_t n : body.cells) {
        extent.cells *= static_cast<double>(n);
    }
    const double row = static_cast<double>(body.cells[0]) + 1;
    extent.nodes = extent.grid_nodes;
    extent.active_lanes = extent.nodes * kLanes * std::ceil(row / kLanes) / row;
    return extent;
}

/// Row by row of nodes: a node is there where one of the four rows of cells around its row has a cell beside it.
LatticeExtent labelled_extent(const SceneBody& body) {
    constexpr std::size_t kLanes = 16;
    const std::int64_t ny = body.cells[1], nz = body.cells[2];
    const auto nx = static_cast<std::size_t>(body.cells[0]);
    LatticeExtent extent{grid_nodes(body), 0, 0, 0};
    for (std::uint8_t label : body.labels) {
        extent.cells += label != 0;
    }
    std::vector<std::uint8_t> around(nx + 2); // cell i of the four rows together, at i + 1
    for (std::int64_t k = 0; k <= nz; ++k) {
        for (std::int64_t j = 0; j <= ny; ++j) {
            std::fill(around.begin(), around.end(), std::uint8_t{0});
            for (std::int64_t z = std::max<std::int64_t>(k - 1, 0); z <= std::min(k, nz - 1); ++z) {
                for (std::int64_t y = std::max<std::int64_t>(j - 1, 0); y <= std::min(j, ny - 1); ++y) {
                    const std::uint8_t* row = body.labels.data() + nx * static_cast<std::size_t>(y + ny * z);
                    for (std::size_t i = 0; i < nx; ++i) {
                        around[i + 1] |= row[i];
                    }
                }
            }
            for (std::size_t begin = 0; begin <= nx; begin += kLanes) {
                int nodes = 0;
                for (std::size_t n = begin; n < std::min(begin + kLanes, nx + 1); ++n) {
                    nodes += (around[n] | around[n + 1]) != 0;
                }
                extent.nodes += nodes;
                extent.active_lanes += nodes > 0 ? static_cast<double>(kLanes) : 0;
            }
        }
    }
    return extent;
}

} // namespace

double estimated_bytes(const SceneBody& body, const SimulationOptions& options) {
    if (body.shape != SceneCells::cubes) {
        // While a network is made: its cells, springs and nodes, and those found by their ends; of a fit more a spring.
        constexpr double kOfAMesh = 1500, kOfACube = 4500;
        return body.shape == SceneCells::mesh ? kOfAMesh * static_cast<double>(body.cell_mesh.cells.size())
                                              : kOfACube * full_extent(body).cells;
    }
    const LatticeExtent extent = body.labels.empty() ? full_extent(body) : labelled_extent(body);
    // The grid: a label and a scale a cell, the number of a node while the body's are counted.
    double bytes = 9 * extent.grid_nodes;
    // The body's nodes, in double: rest positions, masses, the last good state, and one copy for results; cell corners.
    // While a result is written: positions, displacements, velocities, corners, and the file's text.
    bytes += extent.nodes * (8 * (3 + 1 + 6 + 9) + 40 + 300);
    return bytes + plan_bytes(options.plan.layout, extent, options.precision);
}

void check_size(const Scene& scene, const SimulationOptions& options, double available) {
    const double bytes = estimated_bytes(scene.body, options);
    if (bytes > available) {
        throw scene_error(scene, body_key(scene.body),
                          "these cells need about " + gigabytes(bytes) + " of memory; this machine has " +
                              gigabytes(available) + " available");
    }
    if (grid_nodes(scene.body) > Lattice::kMostNodes) {
        throw scene_error(scene, body_key(scene.body), "these cells make more than the 1e9 nodes that are allowed");
    }
}

} // namespace hybmss
