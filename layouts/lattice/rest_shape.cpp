#include "layouts/lattice/rest_shape.hpp"

namespace hybmss {

RestShape rest_shape(const Network& network, const Network::Cell& cell) {
    RestShape shape{};
    auto& e = shape.edges;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        const auto& x = network.rest_positions[static_cast<std::size_t>(cell.nodes[corner])];
        for (std::size_t edge = 0; edge < 3; ++edge) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                e[3 * edge + axis] += (corner >> edge & 1 ? 0.25 : -0.25) * x[axis];
            }
        }
    }
    shape.volume =
        e[0] * (e[4] * e[8] - e[5] * e[7]) + e[1] * (e[5] * e[6] - e[3] * e[8]) + e[2] * (e[3] * e[7] - e[4] * e[6]);
    return shape;
}

double rest_length2(const Network::Spring& spring) {
    const auto& r = spring.rest_vector;
    return r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
}

} // namespace hybmss
