// Obstacles' shapes that are made once: convex hulls, meshes by their distance on a grid, and height fields.
#include "dynamics/contact/obstacle_geometry.hpp"
#include "dynamics/shared_out.hpp"
#include "layouts/messages.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

namespace hybmss {

// Not in the anonymous namespace: parts of what the public header names.

struct PointBox {
    Point low = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                 std::numeric_limits<double>::infinity()},
          high = {-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                  -std::numeric_limits<double>::infinity()};

    void add(const Point& x) {
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], x[a]);
            high[a] = std::max(high[a], x[a]);
        }
    }
    Point nearest(Point x) const {
        for (std::size_t a = 0; a < 3; ++a) {
            x[a] = std::clamp(x[a], low[a], high[a]);
        }
        return x;
    }
    double longest() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }
};

/// All that has n . y <= offset.
struct HalfSolid {
    Point normal;
    double offset;
};

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

[[noreturn]] void refuse_shape(const std::string& what) {
    throw std::invalid_argument(what);
}

/// Throws for what is not finite or so large that its products would not be; `what` they are.
PointBox box_of(std::span<const Point> points, const char* what) {
    PointBox box;
    for (std::size_t p = 0; p < points.size(); ++p) {
        if (!(std::abs(points[p][0]) <= 1e9 && std::abs(points[p][1]) <= 1e9 && std::abs(points[p][2]) <= 1e9)) {
            refuse_shape(printed("%s %zu is not allowed: it must be finite and within 1e9 m", what, p));
        }
        box.add(points[p]);
    }
    return box;
}

template <class Item>
bool equal(std::span<const Item> a, std::span<const Item> b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

Point scaled(double factor, const Point& a) {
    return plus({0, 0, 0}, factor, a);
}
Point unit(const Point& a) {
    const double size = length(a);
    return size > 0 ? scaled(1 / size, a) : Point{0, 0, 0};
}

} // namespace

double middle_of(const ObstacleShape& shape) {
    return std::visit([](const auto& one) { return middle_of(one); }, shape);
}

bool is_made(const ObstacleShape& shape) {
    const auto* const hull = std::get_if<HullShape>(&shape);
    const auto* const mesh = std::get_if<MeshShape>(&shape);
    const auto* const ground = std::get_if<HeightShape>(&shape);
    return !(hull && !hull->hull) && !(mesh && !mesh->field) && !(ground && !ground->field);
}

// -- Convex hulls

struct ConvexHull {
    std::vector<Point> points;
    std::vector<HalfSolid> faces;
    Point middle;
    double radius; ///< about the middle
    double width;  ///< the least, at right angles to a face
};

namespace {

constexpr std::size_t kMostTriangles = 4096;

/// A triangle of a hull under way, and points outside that it sees.
struct HullTriangle {
    std::array<std::size_t, 3> corners;
    HalfSolid side;
    double area = 0;
    std::vector<std::size_t> outside = {};
    bool is_left = true;
};

HullTriangle triangle_of(std::span<const Point> points, const std::array<std::size_t, 3>& corners) {
    const Point& a = points[corners[0]];
    const Point turn = cross(plus(points[corners[1]], -1, a), plus(points[corners[2]], -1, a)), normal = unit(turn);
    return {corners, {normal, dot(normal, a)}, length(turn) / 2};
}

double height_over(const HullTriangle& triangle, const Point& x) {
    return dot(triangle.side.normal, x) - triangle.side.offset;
}

/// Quickhull (Barber, Dobkin, Huhdanpaa 1996): the farthest point that a triangle sees takes the place of all triangles
/// that it sees. What is within `tolerance` of a triangle is seen by none.
std::vector<HullTriangle> quickhull(std::span<const Point> points, double tolerance) {
    const auto farthest = [&](auto&& distance) {
        std::size_t best = 0;
        double most = -1;
        for (std::size_t p = 0; p < points.size(); ++p) {
            if (const double d = distance(points[p]); d > most) {
                most = d;
                best = p;
            }
        }
        return std::pair(best, most);
    };
    const Point& first = points[farthest([&](const Point& x) { return length(plus(x, -1, points[0])); }).first];
    const auto [second, extent] = farthest([&](const Point& x) { return length(plus(x, -1, first)); });
    const Point along = unit(plus(points[second], -1, first));
    const auto [third, breadth] = farthest([&](const Point& x) { return length(cross(along, plus(x, -1, first))); });
    const Point normal = unit(cross(along, plus(points[third], -1, first)));
    const auto [fourth, depth] = farthest([&](const Point& x) { return std::abs(dot(normal, plus(x, -1, first))); });
    if (!(extent > 0) || breadth <= tolerance || depth <= tolerance) {
        refuse_shape(
            printed("the %zu points of a hull lie in a plane, to a 1e-7th of their extent: they must enclose space",
                    points.size()));
    }
    const auto start = static_cast<std::size_t>(&first - points.data());
    std::array<std::size_t, 4> corners = {start, second, third, fourth};
    if (dot(normal, plus(points[fourth], -1, first)) > 0) { // the first three then turn outwards
        std::swap(corners[1], corners[2]);
    }
    std::vector<HullTriangle> triangles;
    const auto [a, b, c, d] = corners;
    for (const std::array<std::size_t, 3>& of :
         {std::array{a, b, c}, std::array{b, a, d}, std::array{c, b, d}, std::array{a, c, d}}) {
        triangles.push_back(triangle_of(points, of));
    }
    const auto hand_out = [&](std::span<const std::size_t> some, std::size_t from) {
        for (const std::size_t p : some) {
            for (std::size_t t = from; t < triangles.size(); ++t) {
                if (height_over(triangles[t], points[p]) > tolerance) {
                    triangles[t].outside.push_back(p);
                    break;
                }
            }
        }
    };
    std::vector<std::size_t> all(points.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    hand_out(all, 0);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (!triangles[t].is_left || triangles[t].outside.empty()) {
            continue;
        }
        const std::vector<std::size_t>& seen = triangles[t].outside;
        const std::size_t top = *std::max_element(seen.begin(), seen.end(), [&](std::size_t p, std::size_t q) {
            return height_over(triangles[t], points[p]) < height_over(triangles[t], points[q]);
        });
        std::set<std::pair<std::size_t, std::size_t>> edges; // of the triangles that `top` sees
        std::vector<std::size_t> loose;
        for (HullTriangle& triangle : triangles) {
            if (triangle.is_left && height_over(triangle, points[top]) > tolerance) {
                for (std::size_t e = 0; e < 3; ++e) {
                    edges.insert({triangle.corners[e], triangle.corners[(e + 1) % 3]});
                }
                loose.insert(loose.end(), triangle.outside.begin(), triangle.outside.end());
                triangle.outside.clear();
                triangle.is_left = false;
            }
        }
        const std::size_t from = triangles.size();
        for (const auto& edge : edges) {
            if (!edges.contains({edge.second, edge.first})) {
                triangles.push_back(triangle_of(points, {edge.first, edge.second, top}));
            }
        }
        hand_out(loose, from);
        std::size_t left = 0;
        if (triangles.size() > 2 * kMostTriangles) { // those that are gone make room
            std::erase_if(triangles, [](const HullTriangle& triangle) { return !triangle.is_left; });
            left = triangles.size();
            t = static_cast<std::size_t>(-1); // from the first on again
        }
        if (left > kMostTriangles) {
            refuse_shape(
                printed("a hull of more than %zu triangles is not allowed: give fewer points", kMostTriangles));
        }
    }
    std::erase_if(triangles, [](const HullTriangle& triangle) { return !triangle.is_left; });
    if (triangles.size() > kMostTriangles) {
        refuse_shape(printed("a hull of %zu triangles is not allowed: at most %zu; give fewer points", triangles.size(),
                             kMostTriangles));
    }
    return triangles;
}

/// The planes of triangles, the largest first, each of those in a plane once; moved out to the corners that lie before
/// them by less than the tolerance.
std::vector<HalfSolid> faces_of(std::span<const Point> points, std::vector<HullTriangle> triangles) {
    std::stable_sort(triangles.begin(), triangles.end(),
                     [](const HullTriangle& a, const HullTriangle& b) { return a.area > b.area; });
    std::vector<HalfSolid> faces;
    for (const HullTriangle& triangle : triangles) {
        const auto same = [&](const HalfSolid& face) {
            return length(plus(face.normal, -1, triangle.side.normal)) < 1e-7;
        };
        if (triangle.area == 0 || std::any_of(faces.begin(), faces.end(), same)) {
            continue;
        }
        faces.push_back(triangle.side);
        for (const HullTriangle& other : triangles) {
            for (const std::size_t corner : other.corners) {
                faces.back().offset = std::max(faces.back().offset, dot(triangle.side.normal, points[corner]));
            }
        }
    }
    return faces;
}

} // namespace

HullShape::HullShape(std::span<const std::array<double, 3>> given) {
    const PointBox box = box_of(given, "point");
    if (given.size() < 4) {
        refuse_shape(printed("%zu points given for a hull: at least 4 are needed", given.size()));
    }
    ConvexHull made{{given.begin(), given.end()}, {}, {}, 0, kInfinity};
    for (std::size_t a = 0; a < 3; ++a) {
        made.middle[a] = (box.low[a] + box.high[a]) / 2;
    }
    const std::vector<HullTriangle> triangles = quickhull(made.points, 1e-7 * box.longest());
    made.faces = faces_of(made.points, triangles);
    for (const HalfSolid& face : made.faces) {
        double across = 0;
        for (const HullTriangle& triangle : triangles) {
            for (const std::size_t corner : triangle.corners) {
                across = std::max(across, face.offset - dot(face.normal, made.points[corner]));
            }
        }
        made.width = std::min(made.width, across);
    }
    for (const Point& x : made.points) {
        made.radius = std::max(made.radius, length(plus(x, -1, made.middle)));
    }
    hull = std::make_shared<const ConvexHull>(std::move(made));
}

std::vector<std::array<Point, 3>> triangles_of(const ObstacleShape& shape) {
    std::vector<std::array<Point, 3>> corners;
    if (const auto* const hull = std::get_if<HullShape>(&shape)) {
        const std::span<const Point> points = hull->points();
        for (const HullTriangle& t : quickhull(points, 1e-7 * box_of(points, "point").longest())) {
            corners.push_back({points[t.corners[0]], points[t.corners[1]], points[t.corners[2]]});
        }
    }
    if (const auto* const mesh = std::get_if<MeshShape>(&shape)) {
        const std::span<const Point> vertices = mesh->vertices();
        for (const auto& t : mesh->triangles()) {
            corners.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
        }
    }
    return corners;
}

std::span<const std::array<double, 3>> HullShape::points() const {
    return hull ? std::span<const Point>(hull->points) : std::span<const Point>();
}

bool HullShape::operator==(const HullShape& other) const {
    return hull == other.hull || equal(points(), other.points());
}

double distance_to(const HullShape& shape, const Point& y) {
    const ConvexHull& hull = *shape.hull;
    if (const double r = length(plus(y, -1, hull.middle)); r > 2 * hull.radius) {
        return r - hull.radius;
    }
    double distance = -kInfinity;
    for (const HalfSolid& face : hull.faces) {
        distance = std::max(distance, dot(face.normal, y) - face.offset);
    }
    return distance;
}

SurfaceDistance surface_at(const HullShape& shape, const Point& y) {
    SurfaceDistance nearest{-kInfinity, {0, 1, 0}};
    for (const HalfSolid& face : shape.hull->faces) {
        if (const double d = dot(face.normal, y) - face.offset; d > nearest.distance) {
            nearest = {d, face.normal};
        }
    }
    return nearest;
}

std::optional<Entry> entry(const HullShape& shape, const Point& from, const Point& way) {
    Entry in{-kInfinity, {0, 0, 0}};
    double out = 1;
    for (const HalfSolid& face : shape.hull->faces) {
        const double before = dot(face.normal, from) - face.offset, rate = dot(face.normal, way);
        if (rate == 0) {
            if (!(before < 0)) {
                return {};
            }
        } else if (const double t = -before / rate; rate > 0) {
            out = std::min(out, t);
        } else if (t > in.part) {
            in = {t, face.normal};
        }
    }
    return in.part >= 0 && in.part < out ? std::optional(in) : std::nullopt;
}

double middle_of(const HullShape& shape) {
    return shape.hull->width / 2;
}

// -- Quadratic B-splines

namespace {

/// Of the nodes `first` to `first + 2` of a line of nodes at -1, 0, .., last + 1: their parts in the value at t, and in
/// its derivatives. Beyond 0 and `last` the value stays.
struct Spline {
    std::size_t first;
    std::array<double, 3> value, slope = {0, 0, 0}, curve = {0, 0, 0};

    Spline(double t, std::size_t last) {
        const double inside = std::clamp(t, 0.0, static_cast<double>(last));
        const double nearest = std::floor(inside + 0.5), u = inside - nearest;
        first = static_cast<std::size_t>(nearest);
        value = {(0.5 - u) * (0.5 - u) / 2, 0.75 - u * u, (0.5 + u) * (0.5 + u) / 2};
        if (t == inside) {
            slope = {u - 0.5, -2 * u, u + 0.5};
            curve = {1, -2, 1};
        }
    }
};

/// A value, its first derivatives and its second.
struct Jet {
    double value = 0;
    Point slope = {0, 0, 0};
    Symmetric curve = {};
};

} // namespace

// -- Closed meshes

struct DistanceField {
    std::vector<Point> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    int cells;
    PointBox box;                      ///< of the mesh
    Point origin;                      ///< of node 1, 1, 1
    double spacing;                    ///< m
    std::array<std::size_t, 3> counts; ///< of nodes
    std::vector<double> values;        ///< m, x fastest
    double deepest;                    ///< m

    bool reaches(const Point& y) const {
        for (std::size_t a = 0; a < 3; ++a) {
            if (!(std::abs(y[a] - (box.low[a] + box.high[a]) / 2) < (box.high[a] - box.low[a]) / 2 + spacing)) {
                return false;
            }
        }
        return true;
    }
    Jet at(const Point& y) const {
        const auto along = [&](std::size_t a) { return Spline((y[a] - origin[a]) / spacing, counts[a] - 3); };
        const Spline x = along(0), in_y = along(1), z = along(2);
        Jet sum;
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t j = 0; j < 3; ++j) {
                const double* const row =
                    values.data() + ((z.first + k) * counts[1] + in_y.first + j) * counts[0] + x.first;
                double v = 0, d = 0, dd = 0;
                for (std::size_t i = 0; i < 3; ++i) {
                    v += x.value[i] * row[i];
                    d += x.slope[i] * row[i];
                    dd += x.curve[i] * row[i];
                }
                const double vv = in_y.value[j] * z.value[k], dv = in_y.slope[j] * z.value[k],
                             vd = in_y.value[j] * z.slope[k];
                sum.value += vv * v;
                sum.slope = {sum.slope[0] + vv * d, sum.slope[1] + dv * v, sum.slope[2] + vd * v};
                const Symmetric more = {vv * dd,
                                        dv * d,
                                        vd * d,
                                        in_y.curve[j] * z.value[k] * v,
                                        in_y.slope[j] * z.slope[k] * v,
                                        in_y.value[j] * z.curve[k] * v};
                for (std::size_t e = 0; e < 6; ++e) {
                    sum.curve[e] += more[e];
                }
            }
        }
        sum.slope = scaled(1 / spacing, sum.slope);
        for (double& c : sum.curve) {
            c /= spacing * spacing;
        }
        return sum;
    }
};

namespace {

/// Triangles with what tells inside from outside, and the tree of boxes in which the nearest is found.
class NearestTriangle {
public:
    NearestTriangle(std::span<const Point> vertices, std::vector<std::array<std::size_t, 3>> triangles)
        : vertices_(vertices), triangles_(std::move(triangles)), order_(triangles_.size()) {
        std::iota(order_.begin(), order_.end(), std::size_t{0});
        at_vertex_.assign(vertices.size(), Point{0, 0, 0});
        for (const auto& t : triangles_) {
            const Point normal = unit(turn_of(t));
            normals_.push_back(normal);
            for (std::size_t c = 0; c < 3; ++c) { // by its angle there
                const Point &x = vertices[t[c]], p = unit(plus(vertices[t[(c + 1) % 3]], -1, x)),
                            q = unit(plus(vertices[t[(c + 2) % 3]], -1, x));
                at_vertex_[t[c]] = plus(at_vertex_[t[c]], std::atan2(length(cross(p, q)), dot(p, q)), normal);
                Point& edge = at_edge_[key(t[c], t[(c + 1) % 3])];
                edge = plus(edge, 1, normal);
            }
        }
        build(0, order_.size());
    }

    /// Signed by the mean normal of the triangles about the nearest point (Baerentzen and Aanaes 2005), which is exact
    /// for closed meshes. `hint`: a triangle that may be near, the nearest afterwards.
    double signed_distance(const Point& x, std::size_t& hint) const {
        Nearest nearest{kInfinity, {}, {0, 0, 0}, hint};
        try_triangle(hint, x, nearest);
        search(0, x, nearest);
        hint = nearest.number;
        const double distance = std::sqrt(nearest.square);
        return dot(plus(x, -1, nearest.place), nearest.normal) < 0 ? -distance : distance;
    }

private:
    struct Nearest {
        double square;
        Point place, normal;
        std::size_t number;
    };
    struct Branch {
        PointBox box;
        std::size_t begin, end, right; ///< of order_; the left one follows; 0: a leaf
    };
    static std::uint64_t key(std::size_t a, std::size_t b) {
        return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
    }
    Point turn_of(const std::array<std::size_t, 3>& t) const {
        return cross(plus(vertices_[t[1]], -1, vertices_[t[0]]), plus(vertices_[t[2]], -1, vertices_[t[0]]));
    }

    std::size_t build(std::size_t begin, std::size_t end) {
        const std::size_t branch = tree_.size();
        tree_.push_back({{}, begin, end, 0});
        PointBox middles;
        const auto middle = [&](std::size_t t, std::size_t a) {
            return vertices_[triangles_[t][0]][a] + vertices_[triangles_[t][1]][a] + vertices_[triangles_[t][2]][a];
        };
        for (std::size_t n = begin; n < end; ++n) {
            for (const std::size_t v : triangles_[order_[n]]) {
                tree_[branch].box.add(vertices_[v]);
            }
            middles.add({middle(order_[n], 0), middle(order_[n], 1), middle(order_[n], 2)});
        }
        if (end - begin > 4) {
            std::size_t axis = 0;
            for (std::size_t a = 1; a < 3; ++a) {
                axis = middles.high[a] - middles.low[a] > middles.high[axis] - middles.low[axis] ? a : axis;
            }
            const std::size_t half = begin + (end - begin) / 2;
            const auto at = [&](std::size_t n) { return order_.begin() + static_cast<std::ptrdiff_t>(n); };
            std::nth_element(at(begin), at(half), at(end), [&](std::size_t p, std::size_t q) {
                return std::pair(middle(p, axis), p) < std::pair(middle(q, axis), q);
            });
            build(begin, half);
            const std::size_t right = build(half, end);
            tree_[branch].right = right;
        }
        return branch;
    }

    double square_to(std::size_t branch, const Point& x) const {
        const Point away = plus(x, -1, tree_[branch].box.nearest(x));
        return dot(away, away);
    }
    void search(std::size_t at, const Point& x, Nearest& nearest) const {
        const Branch& branch = tree_[at];
        if (branch.right == 0) {
            for (std::size_t n = branch.begin; n < branch.end; ++n) {
                try_triangle(order_[n], x, nearest);
            }
            return;
        }
        std::array<std::pair<double, std::size_t>, 2> both = {std::pair(square_to(at + 1, x), at + 1),
                                                              std::pair(square_to(branch.right, x), branch.right)};
        std::sort(both.begin(), both.end());
        for (const auto& [square, next] : both) {
            if (square < nearest.square) {
                search(next, x, nearest);
            }
        }
    }

    /// The nearest point of a triangle: its corners, then its edges, then its inside (Ericson 2005).
    void try_triangle(std::size_t number, const Point& x, Nearest& nearest) const {
        const auto& t = triangles_[number];
        const Point &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
        const Point ab = plus(b, -1, a), ac = plus(c, -1, a), ax = plus(x, -1, a), bx = plus(x, -1, b),
                    cx = plus(x, -1, c);
        const double d1 = dot(ab, ax), d2 = dot(ac, ax), d3 = dot(ab, bx), d4 = dot(ac, bx), d5 = dot(ab, cx),
                     d6 = dot(ac, cx);
        const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
        const auto offer = [&](const Point& place, const Point& normal) {
            const Point away = plus(x, -1, place);
            if (const double square = dot(away, away); square < nearest.square) {
                nearest = {square, place, normal, number};
            }
        };
        const auto edge = [&](std::size_t from, std::size_t to, const Point& place) {
            offer(place, at_edge_.at(key(t[from], t[to])));
        };
        if (d1 <= 0 && d2 <= 0) {
            offer(a, at_vertex_[t[0]]);
        } else if (d3 >= 0 && d4 <= d3) {
            offer(b, at_vertex_[t[1]]);
        } else if (d6 >= 0 && d5 <= d6) {
            offer(c, at_vertex_[t[2]]);
        } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
            edge(0, 1, plus(a, d1 / (d1 - d3), ab));
        } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
            edge(0, 2, plus(a, d2 / (d2 - d6), ac));
        } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
            edge(1, 2, plus(b, (d4 - d3) / ((d4 - d3) + (d5 - d6)), plus(c, -1, b)));
        } else {
            const double whole = va + vb + vc;
            offer(plus(plus(a, vb / whole, ab), vc / whole, ac), normals_[number]);
        }
    }

    std::span<const Point> vertices_;
    std::vector<std::array<std::size_t, 3>> triangles_;
    std::vector<Point> normals_, at_vertex_;
    std::unordered_map<std::uint64_t, Point> at_edge_;
    std::vector<std::size_t> order_;
    std::vector<Branch> tree_;
};

/// Triangles of the first of the vertices at each place, that turn outwards and close. Throws for others.
std::vector<std::array<std::size_t, 3>> closed(std::span<const Point> vertices,
                                               std::span<const std::array<std::uint32_t, 3>> given, double extent) {
    std::map<Point, std::size_t> places;
    std::vector<std::size_t> first(vertices.size());
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        first[v] = places.try_emplace(plus({0, 0, 0}, 1, vertices[v]), v).first->second; // -0 is 0
    }
    std::vector<std::array<std::size_t, 3>> triangles;
    std::map<std::pair<std::size_t, std::size_t>, std::array<int, 2>> edges; // how often this way and the other
    double volume = 0;
    for (std::size_t t = 0; t < given.size(); ++t) {
        std::array<std::size_t, 3> corners{};
        for (std::size_t c = 0; c < 3; ++c) {
            if (given[t][c] >= vertices.size()) {
                refuse_shape(
                    printed("triangle %zu of a mesh has the vertex %u: it must be below %zu, the number of vertices", t,
                            given[t][c], vertices.size()));
            }
            corners[c] = first[given[t][c]];
        }
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
            continue; // an edge or a point, whose neighbours meet
        }
        const Point &a = vertices[corners[0]], ab = plus(vertices[corners[1]], -1, a),
                    ac = plus(vertices[corners[2]], -1, a), turn = cross(ab, ac);
        if (!(length(turn) > 1e-12 * std::max(dot(ab, ab), dot(ac, ac)))) {
            refuse_shape(printed("triangle %zu of a mesh has no area: its corners lie on a line", t));
        }
        volume += dot(turn, plus(a, -1, vertices[0])) / 6;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto [low, high] = std::minmax(corners[c], corners[(c + 1) % 3]);
            edges[{low, high}][corners[c] == low ? 0 : 1] += 1;
        }
        triangles.push_back(corners);
    }
    std::size_t open = 0, mixed = 0;
    std::pair<std::size_t, std::size_t> where = {0, 0};
    for (const auto& [edge, uses] : edges) {
        const bool is_open = (uses[0] + uses[1]) % 2 != 0, is_mixed = !is_open && (uses[0] != 1 || uses[1] != 1);
        where = (is_open || is_mixed) && open + mixed == 0 ? edge : where;
        open += is_open ? 1 : 0;
        mixed += is_mixed ? 1 : 0;
    }
    if (open + mixed > 0) {
        const Point &p = vertices[where.first], &q = vertices[where.second];
        refuse_shape(
            printed("a mesh is not closed: %zu of its edges belong to an odd number of triangles and %zu to more than "
                    "two or to two of another turn, the first from (%g, %g, %g) to (%g, %g, %g)",
                    open, mixed, p[0], p[1], p[2], q[0], q[1], q[2]));
    }
    if (!(std::abs(volume) > 1e-9 * extent * extent * extent)) {
        refuse_shape(printed("a mesh of %zu triangles encloses no space: its volume is %g m^3", given.size(), volume));
    }
    for (auto& t : triangles) {
        if (volume < 0) {
            std::swap(t[1], t[2]);
        }
    }
    return triangles;
}

} // namespace

MeshShape::MeshShape(std::span<const std::array<double, 3>> vertices,
                     std::span<const std::array<std::uint32_t, 3>> triangles, int cells) {
    if (cells < 4 || cells > 256) {
        refuse_shape(printed("cells = %d of a mesh's grid is not allowed: it must be 4 to 256", cells));
    }
    const PointBox box = box_of(vertices, "vertex");
    const double extent = triangles.empty() ? 0 : box.longest();
    const NearestTriangle nearest(vertices, closed(vertices, triangles, extent));
    DistanceField made{{vertices.begin(), vertices.end()},
                       {triangles.begin(), triangles.end()},
                       cells,
                       box,
                       {},
                       extent / cells,
                       {},
                       {},
                       0};
    // From two cells below the box to two cells above it: a spline takes the nodes beside the nearest.
    std::array<double, 3> low{};
    for (std::size_t a = 0; a < 3; ++a) {
        const double across = std::ceil((box.high[a] - box.low[a]) / made.spacing - 1e-6) + 4;
        made.counts[a] = static_cast<std::size_t>(across) + 1;
        low[a] = (box.low[a] + box.high[a]) / 2 - across / 2 * made.spacing;
        made.origin[a] = low[a] + made.spacing;
    }
    const auto [nx, ny, nz] = made.counts;
    made.values.resize(nx * ny * nz);
    const auto fill_row = [&, nx = nx, ny = ny](std::size_t row) {
        std::size_t hint = 0; // the nearest of one node is near the next
        for (std::size_t i = 0; i < nx; ++i) {
            const Point x = {low[0] + made.spacing * static_cast<double>(i),
                             low[1] + made.spacing * static_cast<double>(row % ny),
                             low[2] + made.spacing * static_cast<double>(row / ny)};
            made.values[row * nx + i] = nearest.signed_distance(x, hint);
        }
    };
    constexpr std::size_t kOfOneThread = 100'000; // nodes, which take less than threads do to come
    SharedOut(made.values.size() < kOfOneThread ? 1 : 0).run(ny * nz, fill_row);
    made.deepest = -*std::min_element(made.values.begin(), made.values.end());
    field = std::make_shared<const DistanceField>(std::move(made));
}

std::span<const std::array<double, 3>> MeshShape::vertices() const {
    return field ? std::span<const Point>(field->vertices) : std::span<const Point>();
}
std::span<const std::array<std::uint32_t, 3>> MeshShape::triangles() const {
    using Triangles = std::span<const std::array<std::uint32_t, 3>>;
    return field ? Triangles(field->triangles) : Triangles();
}
int MeshShape::cells() const {
    return field ? field->cells : 0;
}

bool MeshShape::operator==(const MeshShape& other) const {
    return field == other.field ||
           (cells() == other.cells() && equal(vertices(), other.vertices()) && equal(triangles(), other.triangles()));
}

// The spline's derivative along each axis is a mean of differences between nodes, none of which is more than 1.
double distance_to(const MeshShape& mesh, const Point& y) {
    const DistanceField& field = *mesh.field;
    if (!field.reaches(y)) {
        return length(plus(y, -1, field.box.nearest(y)));
    }
    const double value = field.at(y).value;
    return value > 0 ? value / std::sqrt(3.0) : value;
}

SurfaceDistance surface_at(const MeshShape& mesh, const Point& y) {
    const DistanceField& field = *mesh.field;
    if (!field.reaches(y)) {
        const Point away = plus(y, -1, field.box.nearest(y));
        return {length(away), unit(away)};
    }
    const Jet jet = field.at(y);
    const double slope = length(jet.slope);
    return {jet.value, slope > 0 ? scaled(1 / slope, jet.slope) : Point{0, 1, 0}, slope};
}

Symmetric curvature_at(const MeshShape& mesh, const Point& y) {
    return mesh.field->at(y).curve;
}

/// By steps that are as long as the distance allows, or a part of the grid's cell that hides nothing; then by halves.
std::optional<Entry> entry(const MeshShape& mesh, const Point& from, const Point& way) {
    const double whole = length(way), least = mesh.field->spacing / 16;
    double outside = 0, part = 0;
    for (double distance = distance_to(mesh, from); distance > 0; distance = distance_to(mesh, plus(from, part, way))) {
        if (!(part < 1) || !(whole > 0)) {
            return {};
        }
        outside = part;
        part = std::min(part + std::max(distance, least) / whole, 1.0);
    }
    for (int halving = 0; halving < 52 && outside < part; ++halving) {
        const double middle = (outside + part) / 2;
        (distance_to(mesh, plus(from, middle, way)) > 0 ? outside : part) = middle;
    }
    const SurfaceDistance surface = surface_at(mesh, plus(from, part, way));
    return dot(surface.normal, way) < 0 ? std::optional(Entry{part, surface.normal, surface.slope}) : std::nullopt;
}

double middle_of(const MeshShape& mesh) {
    return mesh.field->deepest;
}

// -- Height fields

struct HeightField {
    std::array<std::size_t, 2> counts;
    std::array<double, 2> spacing;
    std::vector<double> heights;
    std::vector<double> nodes; ///< of the spline: one more on each side, which goes on straight; x fastest
    double cosine;             ///< of the mean slope
    double bound;              ///< of the steepest, at least

    /// The height over a place, and its derivatives by x and z.
    Jet at(double x, double z) const {
        const Spline in_x(x / spacing[0], counts[0] - 1), in_z(z / spacing[1], counts[1] - 1);
        Jet sum;
        for (std::size_t k = 0; k < 3; ++k) {
            const double* const row = nodes.data() + (in_z.first + k) * (counts[0] + 2) + in_x.first;
            double v = 0, d = 0, dd = 0;
            for (std::size_t i = 0; i < 3; ++i) {
                v += in_x.value[i] * row[i];
                d += in_x.slope[i] * row[i] / spacing[0];
                dd += in_x.curve[i] * row[i] / (spacing[0] * spacing[0]);
            }
            const double slope = in_z.slope[k] / spacing[1];
            sum.value += in_z.value[k] * v;
            sum.slope = {sum.slope[0] + in_z.value[k] * d, 0, sum.slope[2] + slope * v};
            sum.curve[0] += in_z.value[k] * dd;
            sum.curve[2] += slope * d;
            sum.curve[5] += in_z.curve[k] / (spacing[1] * spacing[1]) * v;
        }
        return sum;
    }
};

namespace {

/// The nodes whose spline meets the values of a line, in their place: 1/8, 3/4, 1/8 of neighbours make a value, and
/// the ends are straight. By elimination, which is stable: 3/4 outweighs both.
void meet(double* line, std::size_t count, std::size_t stride) {
    std::vector<double> factor(count, 0.0);
    for (std::size_t i = 1; i + 1 < count; ++i) {
        const double pivot = 0.75 - 0.125 * factor[i - 1];
        factor[i] = 0.125 / pivot;
        line[i * stride] = (line[i * stride] - 0.125 * line[(i - 1) * stride]) / pivot;
    }
    for (std::size_t i = count - 1; i-- > 1;) {
        line[i * stride] -= factor[i] * line[(i + 1) * stride];
    }
}

} // namespace

HeightShape::HeightShape(const std::array<std::size_t, 2>& counts, const std::array<double, 2>& spacing,
                         std::span<const double> heights) {
    constexpr std::size_t kMost = std::size_t{1} << 26;
    if (counts[0] < 2 || counts[1] < 2 || counts[0] > kMost / counts[1]) {
        refuse_shape(
            printed("%zu x %zu heights are not allowed: at least 2 along x and along z, and at most %zu in all",
                    counts[0], counts[1], kMost));
    }
    if (heights.size() != counts[0] * counts[1]) {
        refuse_shape(printed("%zu heights given for a field of %zu x %zu: there must be as many", heights.size(),
                             counts[0], counts[1]));
    }
    for (const double s : spacing) {
        if (!std::isfinite(s) || !(s > 0)) {
            refuse_shape(printed("spacing = %g of heights is not allowed: it must be finite and > 0", s));
        }
    }
    for (std::size_t n = 0; n < heights.size(); ++n) {
        if (!(std::abs(heights[n]) <= 1e9)) {
            refuse_shape(printed("height %zu of a field is not allowed: it must be finite and within 1e9 m", n));
        }
    }
    const std::size_t nx = counts[0], nz = counts[1], row = nx + 2;
    HeightField made{counts, spacing, {heights.begin(), heights.end()}, std::vector<double>(row * (nz + 2)), 1, 0};
    for (std::size_t k = 0; k < nz; ++k) {
        std::copy_n(heights.begin() + static_cast<std::ptrdiff_t>(k * nx), nx,
                    made.nodes.begin() + static_cast<std::ptrdiff_t>((k + 1) * row + 1));
    }
    double* const nodes = made.nodes.data();
    const auto go_on = [](double* line, std::size_t count, std::size_t stride) {
        line[0] = 2 * line[stride] - line[2 * stride];
        line[(count + 1) * stride] = 2 * line[count * stride] - line[(count - 1) * stride];
    };
    for (std::size_t k = 1; k <= nz; ++k) {
        meet(nodes + k * row + 1, nx, 1);
        go_on(nodes + k * row, nx, 1);
    }
    for (std::size_t i = 0; i < row; ++i) {
        meet(nodes + row + i, nz, row);
        go_on(nodes + i, nz, row);
    }
    std::array<double, 2> mean = {0, 0}, most = {0, 0};
    for (std::size_t k = 0; k < nz; ++k) {
        mean[0] += (heights[k * nx + nx - 1] - heights[k * nx]) / (static_cast<double>((nx - 1) * nz) * spacing[0]);
    }
    for (std::size_t i = 0; i < nx; ++i) {
        mean[1] += (heights[(nz - 1) * nx + i] - heights[i]) / (static_cast<double>((nz - 1) * nx) * spacing[1]);
    }
    for (std::size_t n = 0; n + 1 < made.nodes.size(); ++n) {
        if (n % row + 1 < row) {
            most[0] = std::max(most[0], std::abs(nodes[n + 1] - nodes[n]) / spacing[0]);
        }
        if (n + row < made.nodes.size()) {
            most[1] = std::max(most[1], std::abs(nodes[n + row] - nodes[n]) / spacing[1]);
        }
    }
    made.cosine = 1 / std::sqrt(1 + mean[0] * mean[0] + mean[1] * mean[1]);
    made.bound = std::min(made.cosine, 1 / std::sqrt(1 + most[0] * most[0] + most[1] * most[1]));
    field = std::make_shared<const HeightField>(std::move(made));
}

std::array<std::size_t, 2> HeightShape::counts() const {
    return field ? field->counts : std::array<std::size_t, 2>{0, 0};
}
std::array<double, 2> HeightShape::spacing() const {
    return field ? field->spacing : std::array<double, 2>{0, 0};
}
std::span<const double> HeightShape::heights() const {
    return field ? std::span<const double>(field->heights) : std::span<const double>();
}

bool HeightShape::operator==(const HeightShape& other) const {
    return field == other.field ||
           (counts() == other.counts() && spacing() == other.spacing() && equal(heights(), other.heights()));
}

double distance_to(const HeightShape& ground, const Point& y) {
    const double above = y[1] - ground.field->at(y[0], y[2]).value;
    return above * (above > 0 ? ground.field->bound : ground.field->cosine);
}

SurfaceDistance surface_at(const HeightShape& ground, const Point& y) {
    const Jet jet = ground.field->at(y[0], y[2]);
    const Point up = {-jet.slope[0], 1, -jet.slope[2]};
    const double size = length(up), cosine = ground.field->cosine;
    return {cosine * (y[1] - jet.value), scaled(1 / size, up), cosine * size};
}

Symmetric curvature_at(const HeightShape& ground, const Point& y) {
    Symmetric curve = ground.field->at(y[0], y[2]).curve;
    for (double& c : curve) {
        c *= -ground.field->cosine;
    }
    return curve;
}

} // namespace hybmss
