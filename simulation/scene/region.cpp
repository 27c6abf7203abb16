#include "simulation/scene/region.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {
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

std::vector<std::uint32_t> select(std::span<const Vector3> rest, double slack, const BoxRegion& box) {
    return where(rest, [&](const Vector3& x) {
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a) {
            inside = inside && x[a] >= box.low[a] - slack && x[a] <= box.high[a] + slack;
        }
        return inside;
    });
}

std::vector<std::uint32_t> select(std::span<const Vector3> rest, double slack, const SphereRegion& sphere) {
    const Vector3& c = sphere.center;
    return where(rest, [&](const Vector3& x) {
        return std::hypot(x[0] - c[0], x[1] - c[1], x[2] - c[2]) <= sphere.radius + slack;
    });
}

std::vector<std::uint32_t> select(std::span<const Vector3> rest, double, const NodeRegion& region) {
    if (region.node < 0 || static_cast<std::uint64_t>(region.node) >= rest.size()) {
        return {};
    }
    return {static_cast<std::uint32_t>(region.node)};
}

} // namespace

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
