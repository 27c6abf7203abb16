#include "studies/calculix/problem.hpp"

#include "simulation/run/boundary_conditions.hpp"
#include "simulation/scene/scene_body.hpp"

#include <limits>

namespace hybmss::calculix {

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
