#include "studies/calculix/problem.hpp"

#include "simulation/run/boundary_conditions.hpp"
#include "simulation/scene/scene_body.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace hybmss::calculix {
namespace {

/// Corners in the order of Abaqus, as steps along x, y and z.
constexpr int kCorners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
/// The corners at the ends of the edges whose middles are nodes 9 to 20.
constexpr std::size_t kEdges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                       {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

} // namespace

std::string_view name(ElementType type) {
    return type == ElementType::c3d8i ? "C3D8I" : "C3D20";
}

double BrickMesh::weight_share(std::size_t node_of_element) const {
    return type == ElementType::c3d8i ? 1.0 / 8 : node_of_element < 8 ? -1.0 / 8 : 1.0 / 6;
}

BrickMesh brick_mesh(const Lattice& lattice, ElementType type, const std::array<double, 3>& origin) {
    BrickMesh mesh;
    mesh.type = type;
    mesh.cell_size = lattice.cell_size();
    const std::vector<std::uint32_t> grid_nodes = lattice.nodes();
    mesh.lattice_nodes = grid_nodes.size();
    for (std::uint32_t grid_node : grid_nodes) {
        const auto x = lattice.rest_position(grid_node);
        mesh.rest.push_back({origin[0] + x[0], origin[1] + x[1], origin[2] + x[2]});
    }
    const auto number = [&](int i, int j, int k) {
        const auto at = std::lower_bound(grid_nodes.begin(), grid_nodes.end(), lattice.grid_node_index(i, j, k));
        return static_cast<std::uint32_t>(at - grid_nodes.begin());
    };
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [entry, is_new] =
            middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.rest.size()));
        if (is_new) {
            const auto p = mesh.rest[a], q = mesh.rest[b];
            mesh.rest.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
        }
        return entry->second;
    };
    for (int k = 0; k < lattice.cells()[2]; ++k) {
        for (int j = 0; j < lattice.cells()[1]; ++j) {
            for (int i = 0; i < lattice.cells()[0]; ++i) {
                const float scale = lattice.cell_scale(i, j, k);
                if (scale == 0) {
                    continue;
                }
                mesh.scales.push_back(scale);
                std::array<std::uint32_t, 8> corners{};
                for (std::size_t c = 0; c < 8; ++c) {
                    corners[c] = number(i + kCorners[c][0], j + kCorners[c][1], k + kCorners[c][2]);
                }
                mesh.elements.insert(mesh.elements.end(), corners.begin(), corners.end());
                for (std::size_t e = 0; type == ElementType::c3d20 && e < 12; ++e) {
                    mesh.elements.push_back(middle(corners[kEdges[e][0]], corners[kEdges[e][1]]));
                }
            }
        }
    }
    return mesh;
}

Problem scene_problem(const Scene& scene, ElementType type, Geometry geometry, Law law) {
    const Lattice lattice = scene_lattice(scene);
    Problem problem{brick_mesh(lattice, type, scene.body.origin), scene.material, {}, geometry, law};
    const std::span<const Vector3> rest = problem.mesh.rest;
    Supports supports(scene, rest);
    const std::span<const PrescribedNode> held = supports.at_part(1);
    problem.loading.supports.assign(held.begin(), held.end());
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    problem.loading.acceleration = value_at(scene.gravity.acceleration, scene.gravity.acceleration_in_time, kEnd);
    const std::size_t nodes = problem.mesh.lattice_nodes;
    problem.loading.forces = nodal_loads(scene, loaded_nodes(scene, lattice, rest.first(nodes)), nodes, kEnd);
    if (!problem.loading.forces.empty()) {
        problem.loading.forces.resize(rest.size(), {0, 0, 0});
    }
    return problem;
}

} // namespace hybmss::calculix
