// C++17: a bar held at one end, whose other end a pointer drags for a second and lets go.
#include "hybmss/handles.hpp"

#include <array>
#include <cstdio>

int main() {
    using namespace hybmss::handles;
    try {
        const std::array<std::int32_t, 3> cells = {12, 3, 3}; // of 1 cm
        const hybmss_material tissue = hybmss_default_material();
        const Body bar(hybmss_lattice_create, cells.data(), 0.01, nullptr, 0u, &tissue);
        const World world(hybmss_world_create, HYBMSS_FLOAT, 0);
        Dynamics moving;
        std::size_t number = 0, drag = 0, nodes = 0;
        check(hybmss_world_add(world, bar, nullptr, nullptr, &number, moving.out()));

        check(hybmss_body_node_count(bar, &nodes));
        std::vector<double> rest(3 * nodes);
        check(hybmss_body_rest_positions(bar, rest.data(), rest.size()));
        std::vector<hybmss_prescribed_node> held;
        for (std::size_t n = 0; n < nodes; ++n) {
            if (rest[3 * n] == 0) {
                held.push_back({static_cast<std::uint32_t>(n), 7, {}, {}});
            }
        }
        check(hybmss_dynamics_prescribe(moving, held.data(), held.size()));

        const hybmss_anchor end = {number, {0.12, 0.015, 0.015}};
        hybmss_anchor pointer = {HYBMSS_IN_SPACE, {0.12, 0.015, 0.015}};
        check(hybmss_world_attach(world, &end, &pointer, 20.0, &drag)); // N/m

        double critical = 0;
        check(hybmss_world_critical_time_step(world, &critical));
        const int steps = static_cast<int>(1 / 60.0 / (0.9 * critical)) + 1;
        const hybmss_step_parameters step = {1 / 60.0 / steps, {0, 0, 0}, 8, HYBMSS_LEAPFROG};
        std::vector<float> u(3 * nodes);
        double lifted = 0;
        for (int frame = 0; frame < 120; ++frame) {
            if (frame < 60) {
                pointer.point[1] += 0.0005; // up by 3 cm in all
                check(hybmss_world_move_anchor(world, drag, pointer.point));
            } else if (frame == 60) {
                check(hybmss_world_detach(world, drag));
            }
            check(hybmss_world_step(world, &step, steps));
            const hybmss_field positions = field(u);
            check(hybmss_dynamics_get_displacements(moving, &positions));
            if (frame == 59) {
                lifted = static_cast<double>(u.at(3 * nodes - 2));
            }
        }
        const double left = static_cast<double>(u.at(3 * nodes - 2));
        std::printf("the end went up by %.1f mm, and is %.1f mm high a second later\n", 1000 * lifted, 1000 * left);
        return lifted > 0.005 && left < lifted / 4 && left > -lifted ? 0 : 1;
    } catch (const Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
