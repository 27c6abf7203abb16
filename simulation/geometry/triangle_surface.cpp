#include "simulation/geometry/triangle_surface.hpp"

#include "layouts/messages.hpp"
#include "simulation/geometry/voxel_grid.hpp"

#include <algorithm>
#include <cmath>
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
        throw std::runtime_error(
            printed("it is not closed: %zu of its edges belong to an odd number of triangles, the first from "
                    "(%g, %g, %g) to (%g, %g, %g)",
                    static_cast<std::size_t>(open), a[0], a[1], a[2], b[0], b[1], b[2]));
    }
    return orientation;
}

// Cells inside a closed surface: a ray along z through each column of cell centres, and where it crosses triangles.
//
// Whether a ray crosses a triangle is decided exactly, so that none slips through an edge or a vertex, or meets one
// twice: the signs below are those of exact arithmetic, and where a ray meets an edge it is thought to stand an
// infinitesimal eps to the right and eps^2 above. All triangles of an edge then agree on which side of it the ray is.

namespace {

// A surface that reaches this part of a cell beyond a whole number of them takes no more cells: STL holds floats.
constexpr double kSlack = 1e-3;

struct Point {
    double x, y, z;
};

/// The sign of a x b = a_x b_y - a_y b_x: on which side of the line from a to b the ray through the origin is.
int side(const Point& a, const Point& b) {
    const double p = a.x * b.y, q = a.y * b.x;
    if (p != q) {
        return p > q ? 1 : -1; // rounding keeps the order
    }
    const double p_rest = std::fma(a.x, b.y, -p), q_rest = std::fma(a.y, b.x, -q);
    if (p_rest != q_rest) {
        return p_rest > q_rest ? 1 : -1;
    }
    // (a - d) x (b - d) = a x b + (b - a) x d with d = (eps, eps^2)
    if (a.y != b.y) {
        return a.y > b.y ? 1 : -1;
    }
    return (b.x > a.x) - (b.x < a.x);
}

/// A ray crosses a triangle below the centre of this cell of its column, and above those before it.
struct Crossing {
    std::size_t column;
    int layer;
    int winding; ///< +1 where the triangle's outer side is below: the ray goes in
    bool operator<(const Crossing& other) const {
        return column != other.column ? column < other.column : layer < other.layer;
    }
};

/// Height at which the ray through the origin crosses the triangle, by the areas opposite to its corners.
double height(const Point& a, const Point& b, const Point& c) {
    const double wa = b.x * c.y - b.y * c.x, wb = c.x * a.y - c.y * a.x, wc = a.x * b.y - a.y * b.x;
    const double area = wa + wb + wc;
    const double z = area != 0 ? (wa * a.z + wb * b.z + wc * c.z) / area : a.z;
    // Rounding in a triangle seen nearly edge-on must not carry it away.
    return std::clamp(z, std::min({a.z, b.z, c.z}), std::max({a.z, b.z, c.z}));
}

int clamped(double x, std::int64_t high) {
    return static_cast<int>(std::clamp(x, 0.0, static_cast<double>(high)));
}

/// Vertices in units of cells, centre of the first cell at the origin, so that rays have whole coordinates.
void add_crossings(std::vector<Crossing>& crossings, const std::array<Point, 3>& t,
                   const std::array<std::int64_t, 3>& cells) {
    const auto [low_x, high_x] = std::minmax({t[0].x, t[1].x, t[2].x});
    const auto [low_y, high_y] = std::minmax({t[0].y, t[1].y, t[2].y});
    const int first_i = clamped(std::ceil(low_x), cells[0]), first_j = clamped(std::ceil(low_y), cells[1]);
    for (int j = first_j; j < cells[1] && j <= high_y; ++j) {
        for (int i = first_i; i < cells[0] && i <= high_x; ++i) {
            std::array<Point, 3> p = t;
            for (Point& corner : p) {
                corner.x -= i;
                corner.y -= j;
            }
            const int s = side(p[0], p[1]);
            if (s != 0 && side(p[1], p[2]) == s && side(p[2], p[0]) == s) {
                const int layer = clamped(std::ceil(height(p[0], p[1], p[2])), cells[2]);
                const auto column =
                    static_cast<std::size_t>(i) + static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(j);
                crossings.push_back({column, layer, -s}); // s > 0: counter-clockwise from above, its outer side up
            }
        }
    }
}

/// The grid around the surface; no cell has a label yet.
SceneBody grid_around(const TriangleSurface& surface, double cell_size) {
    std::array<double, 3> low = surface.vertices.at(0), high = low;
    for (const auto& x : surface.vertices) {
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], x[a]);
            high[a] = std::max(high[a], x[a]);
        }
    }
    const double across = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    if (cell_size > (1 + kSlack) * across) {
        throw std::runtime_error(
            printed("it is %.6g m across, less than one cell: cell_size must be at most that", across));
    }
    SceneBody body;
    body.cell_size = cell_size;
    for (std::size_t a = 0; a < 3; ++a) {
        const double count = std::max(1.0, std::ceil((high[a] - low[a]) / cell_size - kSlack));
        body.cells[a] = static_cast<std::int64_t>(std::min(count, 1e12));
        body.origin[a] = (low[a] + high[a] - count * cell_size) / 2;
    }
    return body;
}

} // namespace

SceneBody voxelised(const TriangleSurface& surface, Orientation orientation, double cell_size) {
    SceneBody body = grid_around(surface, cell_size);
    const std::size_t count = sample_bytes(body.cells, {.bytes = 1});
    if (static_cast<double>(count) > available_bytes()) {
        throw std::runtime_error("its grid is " + grid_text(body.cells) + "; there is not enough memory for it");
    }
    std::vector<Crossing> crossings;
    for (const auto& triangle : surface.triangles) {
        std::array<Point, 3> t{};
        for (std::size_t v = 0; v < 3; ++v) {
            const auto& x = surface.vertices[triangle[v]];
            const auto at = [&](std::size_t a) { return (x[a] - body.origin[a]) / cell_size - 0.5; };
            t[v] = {at(0), at(1), at(2)};
        }
        add_crossings(crossings, t, body.cells);
    }
    std::sort(crossings.begin(), crossings.end());

    body.labels.assign(count, 0);
    const auto columns = static_cast<std::size_t>(body.cells[0] * body.cells[1]);
    for (std::size_t c = 0; c < crossings.size();) {
        const std::size_t column = crossings[c].column;
        int winding = 0, crossed = 0;
        while (c < crossings.size() && crossings[c].column == column) {
            winding += crossings[c].winding;
            ++crossed;
            const bool inside = orientation == Orientation::consistent ? winding != 0 : crossed % 2 != 0;
            const int layer = crossings[c].layer;
            ++c;
            const bool more = c < crossings.size() && crossings[c].column == column;
            for (int k = layer; inside && more && k < crossings[c].layer; ++k) {
                body.labels[column + columns * static_cast<std::size_t>(k)] = 1;
            }
        }
    }
    return body;
}

} // namespace hybmss
