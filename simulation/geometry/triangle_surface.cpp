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

/// The grid around the surface, its labels 0. Throws where memory does not hold so many bytes for each of its cells.
SceneBody grid_around(const TriangleSurface& surface, double cell_size, std::size_t bytes_a_cell) {
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
    const std::size_t count = sample_bytes(body.cells, {.bytes = 1});
    if (static_cast<double>(count * bytes_a_cell) > available_bytes()) {
        throw std::runtime_error("its grid is " + grid_text(body.cells) + "; there is not enough memory for it");
    }
    body.labels.assign(count, 0);
    return body;
}

/// visit(the corners in units of cells, `middle` of the first cell at the origin)
template <class Visit>
void for_each_triangle(const TriangleSurface& surface, const SceneBody& body, double middle, const Visit& visit) {
    for (const auto& triangle : surface.triangles) {
        std::array<Point, 3> t{};
        for (std::size_t v = 0; v < 3; ++v) {
            const auto& x = surface.vertices[triangle[v]];
            const auto at = [&](std::size_t a) { return (x[a] - body.origin[a]) / body.cell_size - middle; };
            t[v] = {at(0), at(1), at(2)};
        }
        visit(t);
    }
}

} // namespace

std::vector<std::uint8_t> centres_inside(const TriangleSurface& surface, Orientation orientation,
                                         const SceneBody& body) {
    std::vector<std::uint8_t> labels(static_cast<std::size_t>(body.cells[0] * body.cells[1] * body.cells[2]), 0);
    std::vector<Crossing> crossings;
    for_each_triangle(surface, body, 0.5,
                      [&](const std::array<Point, 3>& t) { add_crossings(crossings, t, body.cells); });
    std::sort(crossings.begin(), crossings.end());

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
                labels[column + columns * static_cast<std::size_t>(k)] = 1;
            }
        }
    }
    return labels;
}

SceneBody voxelised(const TriangleSurface& surface, Orientation orientation, double cell_size) {
    SceneBody body = grid_around(surface, cell_size, 1);
    body.labels = centres_inside(surface, orientation, body);
    return body;
}

// The part of each cell inside a closed surface: the prisms below its triangles, those that look up added, those that
// look down taken off. Triangles are cut along the cells' faces, so a piece lies in one cell, gives it the prism from
// its floor to the piece, and to all cells below it in its column whole prisms. Nothing here depends on whether a point
// is on a face: all is continuous in the vertices.

namespace {

/// What fills less of a cell has no cell of its own.
constexpr double kSliver = 0.05;
/// Up to so much a cell counts as whole or empty: STL holds floats.
constexpr double kStlRounding = 1e-5;

/// What of it is on one side of a plane across an axis: x_axis >= bound for `side` = 1, <= bound for -1.
Polygon clipped(const Polygon& polygon, std::size_t axis, double bound, double side) {
    Polygon kept;
    kept.reserve(polygon.size() + 1);
    for (std::size_t n = 0; n < polygon.size(); ++n) {
        const Vector3 &a = polygon[n], &b = polygon[(n + 1) % polygon.size()];
        const double da = side * (a[axis] - bound), db = side * (b[axis] - bound);
        if (da >= 0) {
            kept.push_back(a);
        }
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            Vector3 cut{};
            for (std::size_t c = 0; c < 3; ++c) {
                cut[c] = a[c] + da / (da - db) * (b[c] - a[c]);
            }
            cut[axis] = bound;
            kept.push_back(cut);
        }
    }
    return kept;
}

/// visit(cell number, the part of the polygon in it) for the cells along an axis from 0 to `cells`, and one behind.
template <class Visit>
void for_each_slice(const Polygon& polygon, std::size_t axis, std::int64_t cells, const Visit& visit) {
    if (polygon.size() < 3) {
        return;
    }
    const auto [low, high] = std::minmax_element(
        polygon.begin(), polygon.end(), [axis](const Vector3& a, const Vector3& b) { return a[axis] < b[axis]; });
    const int first = clamped(std::floor((*low)[axis]), cells), last = clamped(std::ceil((*high)[axis]), cells);
    for (int n = first; n < std::max(last, first + 1); ++n) {
        visit(n, clipped(clipped(polygon, axis, n, 1), axis, n + 1, -1));
    }
}

/// What a piece of the surface in one cell gives to it and to each cell below, by volume and first moments about the
/// cell's centre.
struct Prism {
    std::size_t column;
    int layer;
    double volume = 0, area = 0; ///< area: the volume of a whole prism
    Vector3 moment{};
    double area_x = 0, area_y = 0;
    bool operator<(const Prism& other) const { // from the top of each column
        return column != other.column ? column < other.column : layer > other.layer;
    }
};

Prism prism(const Polygon& piece, std::size_t column, int i, int j, int layer) {
    Prism sum{.column = column, .layer = layer};
    for (std::size_t n = 1; n + 1 < piece.size(); ++n) {
        const Vector3* const corners[3] = {&piece[0], &piece[n], &piece[n + 1]};
        const auto edge = [&](std::size_t to, std::size_t axis) { return (*corners[to])[axis] - piece[0][axis]; };
        const double third = (edge(1, 0) * edge(2, 1) - edge(1, 1) * edge(2, 0)) / 6; // of the area seen from above
        for (std::size_t c = 0; c < 3; ++c) { // edges' middles: exact for squares
            const auto middle = [&](std::size_t axis) {
                return 0.5 * ((*corners[c])[axis] + (*corners[(c + 1) % 3])[axis]);
            };
            const double x = middle(0) - (i + 0.5), y = middle(1) - (j + 0.5), depth = middle(2) - layer;
            sum.area += third;
            sum.area_x += third * x;
            sum.area_y += third * y;
            sum.volume += third * depth;
            sum.moment[0] += third * x * depth;
            sum.moment[1] += third * y * depth;
            sum.moment[2] += third * 0.5 * depth * (depth - 1);
        }
    }
    return sum;
}

/// The part of a cell that is inside, and where its centre of mass is, in cell sizes off the cell's centre.
struct CutCell {
    std::size_t cell;
    double fill;
    Vector3 offset;
};

/// Sets the labels of all cells that are not slivers, and the fills by volume alone. Returns the cells that are cut.
std::vector<CutCell> fill_by_volume(SceneBody& body, std::vector<Prism>& prisms, double sign) {
    std::vector<CutCell> cut;
    const auto columns = static_cast<std::size_t>(body.cells[0] * body.cells[1]);
    std::sort(prisms.begin(), prisms.end());
    for (std::size_t p = 0; p < prisms.size();) {
        const std::size_t column = prisms[p].column;
        Prism above{.column = column, .layer = 0}; // all pieces above the cell, as whole prisms
        for (int layer = prisms[p].layer; layer >= 0; --layer) {
            double volume = above.area;
            Vector3 moment = {above.area_x, above.area_y, 0};
            for (; p < prisms.size() && prisms[p].column == column && prisms[p].layer == layer; ++p) {
                volume += prisms[p].volume;
                for (std::size_t a = 0; a < 3; ++a) {
                    moment[a] += prisms[p].moment[a];
                }
                above.area += prisms[p].area;
                above.area_x += prisms[p].area_x;
                above.area_y += prisms[p].area_y;
            }
            const std::size_t cell = column + columns * static_cast<std::size_t>(layer);
            const double fill = std::min(sign * volume, 1.0);
            if (fill < -kSliver) {
                throw std::runtime_error(
                    "a part of it is turned inwards and the rest outwards; fill = \"fraction\" needs "
                    "them alike");
            }
            if (layer >= body.cells[2] || !(fill > kStlRounding)) {
                continue;
            }
            body.fills[cell] = static_cast<float>(fill > 1 - kStlRounding ? 1 : fill);
            body.labels[cell] = fill >= kSliver;
            if (fill <= 1 - kStlRounding) {
                cut.push_back({cell, fill, {moment[0] / volume, moment[1] / volume, moment[2] / volume}});
            }
        }
    }
    return cut;
}

/// Shares what each cell has with the cells beside it so that the first moments are kept: linearly, as its centre of
/// mass lies between their centres.
void keep_moments(SceneBody& body, std::span<const CutCell> cut) {
    const std::size_t steps[3] = {1, static_cast<std::size_t>(body.cells[0]),
                                  static_cast<std::size_t>(body.cells[0] * body.cells[1])};
    const auto give = [&](std::size_t from, std::size_t to, double fill) {
        body.fills[from] -= static_cast<float>(fill);
        body.fills[to] += static_cast<float>(fill);
    };
    for (const auto& [cell, fill, offset] : cut) {
        std::array<std::size_t, 3> neighbor{};
        Vector3 share{};
        for (std::size_t a = 0; a < 3; ++a) {
            const auto place = cell / steps[a] % static_cast<std::size_t>(body.cells[a]);
            if (offset[a] > 0 ? place + 1 < static_cast<std::size_t>(body.cells[a]) : place > 0) {
                neighbor[a] = offset[a] > 0 ? cell + steps[a] : cell - steps[a];
                share[a] = body.labels[neighbor[a]] != 0 ? std::abs(offset[a]) : 0;
            }
        }
        const double sum = share[0] + share[1] + share[2];
        for (std::size_t a = 0; body.labels[cell] == 0 && sum > 0 && a < 3; ++a) {
            give(cell, neighbor[a], fill * share[a] / sum);
        }
        for (unsigned corner = 1; body.labels[cell] != 0 && corner < 8; ++corner) {
            std::size_t to = cell;
            double part = fill;
            for (std::size_t a = 0; a < 3; ++a) {
                const bool beside = (corner >> a & 1) != 0;
                part *= beside ? share[a] : 1 - share[a];
                to += beside ? neighbor[a] - cell : 0;
            }
            if (part > 0 && body.labels[to] != 0) {
                give(cell, to, part);
            }
        }
        body.fills[cell] = body.labels[cell] != 0 ? body.fills[cell] : 0;
    }
}

} // namespace

void for_each_piece(const Polygon& triangle, const std::array<std::int64_t, 3>& cells,
                    const std::function<void(const std::array<int, 3>& cell, const Polygon& piece)>& visit) {
    for_each_slice(triangle, 0, cells[0], [&](int i, const Polygon& slice) {
        for_each_slice(slice, 1, cells[1], [&](int j, const Polygon& strip) {
            for_each_slice(strip, 2, cells[2], [&](int k, const Polygon& piece) { visit({i, j, k}, piece); });
        });
    });
}

namespace {

void require_alike(Orientation orientation) {
    if (orientation == Orientation::mixed) {
        throw std::runtime_error(
            "some of its triangles are turned outwards and some inwards; fill = \"fraction\" needs "
            "them alike");
    }
}

/// Of all triangles. What is above the grid is taken for its top plane, where nothing is filled but all cells below.
std::vector<Prism> prisms_below(const TriangleSurface& surface, const SceneBody& body) {
    const std::array<std::int64_t, 3>& cells = body.cells;
    const auto top = static_cast<double>(cells[2]);
    std::vector<Prism> prisms;
    const auto add = [&](const Polygon& polygon) {
        for_each_piece(polygon, cells, [&](const std::array<int, 3>& at, const Polygon& piece) {
            if (at[0] < cells[0] && at[1] < cells[1]) {
                const auto column = static_cast<std::size_t>(at[0]) +
                                    static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(at[1]);
                prisms.push_back(prism(piece, column, at[0], at[1], at[2]));
            }
        });
    };
    for_each_triangle(surface, body, 0, [&](const std::array<Point, 3>& t) {
        const Polygon triangle = {{t[0].x, t[0].y, t[0].z}, {t[1].x, t[1].y, t[1].z}, {t[2].x, t[2].y, t[2].z}};
        if (std::max({t[0].z, t[1].z, t[2].z}) <= top) {
            add(triangle);
            return;
        }
        add(clipped(triangle, 2, top, -1));
        Polygon above = clipped(triangle, 2, top, 1);
        for (Vector3& corner : above) {
            corner[2] = top;
        }
        add(above);
    });
    return prisms;
}

} // namespace

SceneBody filled(const TriangleSurface& surface, Orientation orientation, double cell_size) {
    require_alike(orientation);
    SceneBody body = grid_around(surface, cell_size, 1 + sizeof(float));
    std::vector<Prism> prisms = prisms_below(surface, body);
    body.fills.assign(body.labels.size(), 0.0f);
    keep_moments(body, fill_by_volume(body, prisms, enclosed_volume(surface) < 0 ? -1 : 1));
    return body;
}

std::vector<float> parts_inside(const TriangleSurface& surface, Orientation orientation, const SceneBody& grid) {
    require_alike(orientation);
    SceneBody own;
    own.cells = grid.cells;
    own.origin = grid.origin;
    own.cell_size = grid.cell_size;
    own.labels.assign(static_cast<std::size_t>(grid.cells[0] * grid.cells[1] * grid.cells[2]), 0);
    own.fills.assign(own.labels.size(), 0.0f);
    std::vector<Prism> prisms = prisms_below(surface, own);
    fill_by_volume(own, prisms, enclosed_volume(surface) < 0 ? -1 : 1);
    return own.fills;
}

double enclosed_volume(const TriangleSurface& surface) {
    double sum = 0;
    const Vector3& o = surface.vertices.at(0); // near the surface: far ones cost digits
    for (const auto& t : surface.triangles) {
        Vector3 p[3];
        for (std::size_t v = 0; v < 3; ++v) {
            for (std::size_t a = 0; a < 3; ++a) {
                p[v][a] = surface.vertices[t[v]][a] - o[a];
            }
        }
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
            sum += p[0][a] * (p[1][b] * p[2][c] - p[1][c] * p[2][b]) / 6;
        }
    }
    return sum;
}

} // namespace hybmss
