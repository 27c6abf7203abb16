#include "hybmss/force_plan.hpp"

#include <cstdio>
#include <vector>

int main() {
    // [forces]
    const auto cube = hybmss::Lattice::box(10, 10, 10, 0.5); // 10^3 cells of 0.5 m
    const hybmss::ForcePlan<float> plan(cube, hybmss::Material{.young_modulus = 1e4, .poisson_ratio = 0.45});

    std::vector<float> u(3 * plan.node_count()), f(u.size()); // your own arrays: x y z of each node, in m and N
    const std::size_t top = 3 * cube.grid_node_index(5, 10, 5) + 1;
    u[top] = -0.05f; // the middle of the top face, 5 cm down
    plan.add_forces(hybmss::VectorField<const float>::aos(u.data(), plan.node_count()),
                    hybmss::VectorField<float>::aos(f.data(), plan.node_count()));

    std::printf("the node is pushed back up with %.1f N\n", static_cast<double>(f[top]));
    // [/forces]
    return f[top] > 0 ? 0 : 1;
}
