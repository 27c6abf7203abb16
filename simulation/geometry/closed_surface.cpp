#include "simulation/geometry/triangle_surface.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <stdexcept>

namespace hybmss {
namespace {

/// One side of a triangle: an edge from its vertex of lower number to the other, walked forwards (+1) or backwards.
struct Side {
    std::uint32_t low, high;
    int direction;

    bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
    bool operator<(const Side& other) const { return low != other.low ? low < other.low : high < other.high; }
};

} // namespace

void weld(TriangleSurface& surface) {
    auto& vertices = surface.vertices;
    std::vector<std::uint32_t> order(vertices.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return vertices[a] < vertices[b]; });
    std::vector<std::array<double, 3>> different;
    std::vector<std::uint32_t> number(vertices.size());
    for (std::uint32_t v : order) {
        if (different.empty() || different.back() != vertices[v]) {
            different.push_back(vertices[v]);
        }
        number[v] = static_cast<std::uint32_t>(different.size() - 1);
    }
    vertices = std::move(different);
    for (auto& triangle : surface.triangles) {
        for (std::uint32_t& v : triangle) {
            v = number[v];
        }
    }
    std::erase_if(surface.triangles, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

Orientation require_closed(const TriangleSurface& surface) {
    if (surface.triangles.empty()) {
        throw std::runtime_error("it holds no triangle");
    }
    std::vector<Side> sides;
    sides.reserve(3 * surface.triangles.size());
    for (const auto& t : surface.triangles) {
        for (std::size_t s = 0; s < 3; ++s) {
            const std::uint32_t a = t[s], b = t[(s + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
        }
    }
    std::sort(sides.begin(), sides.end());
    std::size_t open = 0;
    const Side* first_open = nullptr;
    Orientation orientation = Orientation::consistent;
    for (std::size_t s = 0; s < sides.size();) {
        std::size_t end = s;
        int balance = 0;
        for (; end < sides.size() && sides[end].same_edge(sides[s]); ++end) {
            balance += sides[end].direction;
        }
        if ((end - s) % 2 != 0) {
            first_open = first_open ? first_open : &sides[s];
            ++open;
        } else if (balance != 0) {
            orientation = Orientation::mixed;
        }
        s = end;
    }
    if (open > 0) {
        const auto& a = surface.vertices[first_open->low];
        const auto& b = surface.vertices[first_open->high];
        char text[256];
        std::snprintf(text, sizeof text,
                      "it is not closed: %zu of its edges belong to an odd number of triangles, the first from "
                      "(%g, %g, %g) to (%g, %g, %g)",
                      open, a[0], a[1], a[2], b[0], b[1], b[2]);
        throw std::runtime_error(text);
    }
    return orientation;
}

} // namespace hybmss
