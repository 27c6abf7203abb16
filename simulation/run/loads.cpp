#include "simulation/run/loads.hpp"

#include "simulation/geometry/cell_volume.hpp"
#include "simulation/run/supports.hpp"

namespace hybmss {

std::vector<Vector3> nodal_loads(const Scene& scene, const Lattice& lattice, std::span<const Vector3> rest) {
    if (scene.loads.empty()) {
        return {};
    }
    std::vector<int> cells_at(rest.size(), 0);
    for (const auto& corners : cell_corners(lattice)) {
        for (const auto n : corners) {
            ++cells_at[static_cast<std::size_t>(n)];
        }
    }
    std::vector<Vector3> forces(rest.size(), Vector3{0, 0, 0});
    for (std::size_t l = 0; l < scene.loads.size(); ++l) {
        const std::vector<std::uint32_t> nodes =
            nodes_of(scene, rest, scene.loads[l].where, "load[" + std::to_string(l) + "].where");
        double sum = 0;
        for (std::uint32_t n : nodes) {
            sum += cells_at[n];
        }
        for (std::uint32_t n : nodes) {
            for (std::size_t a = 0; a < 3; ++a) {
                forces[n][a] += scene.loads[l].force[a] * cells_at[n] / sum;
            }
        }
    }
    return forces;
}

} // namespace hybmss
