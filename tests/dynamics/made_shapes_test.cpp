/// Hulls, meshes and height fields as obstacles: their distances against other shapes and by brute force, and what they
/// do to bodies.

#include "dynamics/contact/obstacle_geometry.hpp"
#include "hybmss/skin.hpp"
#include "tests/dynamics/touching_body.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace hybmss {
namespace {

using testing::expect_refusal;
using testing::kEdge;
using testing::TouchingBody;
using testing::Vector;

/// Points in a cube of edges 2, from the engine's own bits.
class Points {
public:
    explicit Points(unsigned seed) : engine_(seed) {}
    double number() { return static_cast<double>(engine_()) / 2147483648.0 - 1; }
    Vector point(double size = 1) { return {size * number(), size * number(), size * number()}; }
    std::mt19937& engine() { return engine_; }

private:
    std::mt19937 engine_;
};

std::vector<Vector> corners_of(const Vector& size) {
    std::vector<Vector> corners;
    for (int c = 0; c < 8; ++c) {
        corners.push_back(
            {(c & 1 ? 0.5 : -0.5) * size[0], (c & 2 ? 0.5 : -0.5) * size[1], (c & 4 ? 0.5 : -0.5) * size[2]});
    }
    return corners;
}

/// Corners of a box, and points in it and on it, in any order.
HullShape box_as_hull(const Vector& size, unsigned seed = 1) {
    Points points(seed);
    std::vector<Vector> given = corners_of(size);
    for (int i = 0; i < 100; ++i) {
        Vector inside = points.point(0.5);
        for (std::size_t a = 0; a < 3; ++a) {
            inside[a] *= size[a];
        }
        if (i % 2 == 0) {
            inside[static_cast<std::size_t>(i / 2 % 3)] =
                (i % 4 == 0 ? 0.5 : -0.5) * size[static_cast<std::size_t>(i / 2 % 3)];
        }
        given.push_back(inside);
    }
    std::shuffle(given.begin(), given.end(), points.engine());
    return HullShape(given);
}

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

const Triangles kBoxTriangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

MeshShape box_as_mesh(const Vector& size, int cells) {
    return {corners_of(size), kBoxTriangles, cells};
}

/// A surface of m x n quadrilaterals, round in both directions, each in two triangles.
template <class At>
MeshShape tube(std::uint32_t m, std::uint32_t n, int cells, const At& at) {
    std::vector<Vector> vertices;
    Triangles triangles;
    for (std::uint32_t i = 0; i < m; ++i) {
        for (std::uint32_t j = 0; j < n; ++j) {
            vertices.push_back(at(2 * std::numbers::pi * i / m, 2 * std::numbers::pi * j / n));
            const std::uint32_t right = (i + 1) % m * n, up = (j + 1) % n;
            triangles.push_back({i * n + j, right + j, right + up});
            triangles.push_back({i * n + j, right + up, i * n + up});
        }
    }
    return {vertices, triangles, cells};
}

MeshShape torus(double large, double small, std::uint32_t m, std::uint32_t n, int cells) {
    return tube(m, n, cells, [&](double u, double v) {
        const double r = large + small * std::cos(v);
        return Vector{r * std::cos(u), small * std::sin(v), -r * std::sin(u)};
    });
}
double distance_to_torus(double large, double small, const Vector& y) {
    return std::hypot(std::hypot(y[0], y[2]) - large, y[1]) - small;
}

/// An octahedron whose triangles are parted in four `times`, its vertices moved out to the sphere.
MeshShape ball(double radius, int times, int cells) {
    std::vector<Vector> vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    Triangles triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int time = 0; time < times; ++time) {
        Triangles finer;
        for (const auto& t : triangles) {
            std::array<std::uint32_t, 3> middle{};
            for (std::size_t c = 0; c < 3; ++c) { // vertices at the same place are one
                const Vector sum = plus(vertices[t[c]], 1, vertices[t[(c + 1) % 3]]);
                middle[c] = static_cast<std::uint32_t>(vertices.size());
                vertices.push_back(plus({0, 0, 0}, 1 / length(sum), sum));
            }
            finer.push_back({t[0], middle[0], middle[2]});
            finer.push_back({middle[0], t[1], middle[1]});
            finer.push_back({middle[2], middle[1], t[2]});
            finer.push_back(middle);
        }
        triangles = finer;
    }
    for (Vector& vertex : vertices) {
        vertex = plus({0, 0, 0}, radius, vertex);
    }
    return {vertices, triangles, cells};
}

HeightShape waves(std::size_t nx, std::size_t nz, double sx, double sz) {
    std::vector<double> heights;
    for (std::size_t k = 0; k < nz; ++k) {
        for (std::size_t i = 0; i < nx; ++i) {
            const double x = sx * static_cast<double>(i), z = sz * static_cast<double>(k);
            heights.push_back(0.1 * std::sin(3 * x) * std::cos(4 * z) + 0.2 * x - 0.1 * z);
        }
    }
    return {{nx, nz}, {sx, sz}, heights};
}

/// Heights of the plane through the position, across (-slope_x, 1, -slope_z).
HeightShape slope(double slope_x, double slope_z, std::size_t nx, std::size_t nz, double sx, double sz) {
    std::vector<double> heights;
    for (std::size_t k = 0; k < nz; ++k) {
        for (std::size_t i = 0; i < nx; ++i) {
            heights.push_back(slope_x * sx * static_cast<double>(i) + slope_z * sz * static_cast<double>(k));
        }
    }
    return {{nx, nz}, {sx, sz}, heights};
}

TEST(HullShape, of_a_box_is_the_box) {
    const Vector size = {1, 2, 0.7};
    const HullShape hull = box_as_hull(size);
    const BoxShape box = {size};
    EXPECT_NEAR(middle_of(hull), middle_of(box), 1e-15);
    Points points(3);
    int entered = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vector y = points.point(1.2), way = points.point(2);
        EXPECT_NEAR(distance_to(hull, y), distance_to(box, y), 1e-15);
        const SurfaceDistance one = surface_at(hull, y), other = surface_at(box, y);
        EXPECT_NEAR(one.distance, other.distance, 1e-15);
        EXPECT_LT(length(plus(one.normal, -1, other.normal)), 1e-14);
        EXPECT_EQ(one.slope, 1);
        const auto in = entry(hull, y, way), into = entry(box, y, way);
        ASSERT_EQ(in.has_value(), into.has_value());
        if (in) {
            ++entered;
            EXPECT_NEAR(in->part, into->part, 1e-13);
            EXPECT_LT(length(plus(in->normal, -1, into->normal)), 1e-14);
        }
    }
    EXPECT_GT(entered, 100);
}

/// Against all planes through three of the points that have the others on one side.
TEST(HullShape, of_any_points_is_within_all_planes_that_have_them_on_one_side) {
    for (const unsigned seed : {1u, 2u, 3u, 4u}) {
        Points points(seed);
        std::vector<Vector> given;
        for (int i = 0; i < 30; ++i) {
            given.push_back(points.point(1.0));
        }
        const HullShape hull(given);
        struct Side {
            Vector normal;
            double offset;
        };
        std::vector<Side> sides;
        for (std::size_t a = 0; a < given.size(); ++a) {
            for (std::size_t b = 0; b < given.size(); ++b) {
                for (std::size_t c = 0; c < given.size(); ++c) {
                    if (a == b || b == c || c == a) {
                        continue;
                    }
                    Vector n = cross(plus(given[b], -1, given[a]), plus(given[c], -1, given[a]));
                    n = plus({0, 0, 0}, 1 / length(n), n);
                    const double offset = dot(n, given[a]);
                    if (std::all_of(given.begin(), given.end(),
                                    [&](const Vector& x) { return dot(n, x) < offset + 1e-12; })) {
                        sides.push_back({n, offset});
                    }
                }
            }
        }
        for (int i = 0; i < 1000; ++i) {
            const Vector y = points.point(0.8);
            double distance = -std::numeric_limits<double>::infinity();
            for (const Side& side : sides) {
                distance = std::max(distance, dot(side.normal, y) - side.offset);
            }
            EXPECT_NEAR(distance_to(hull, y), distance, 1e-12) << seed;
        }
        EXPECT_LE(distance_to(hull, {50, 0, 0}), 50);
        EXPECT_GT(distance_to(hull, {50, 0, 0}), 40);
    }
}

/// Points on a sphere, on edges and in faces as a mesh generator leaves them in float, and many at one place.
TEST(HullShape, stands_what_lies_on_faces_and_edges) {
    Points points(5);
    std::vector<Vector> given;
    const double cosine = std::cos(0.3), sine = std::sin(0.3);
    for (int i = 0; i <= 12; ++i) {
        for (int j = 0; j <= 12; ++j) {
            for (const double face : {-1.0, 1.0}) {
                const double u = i / 6.0 - 1, v = j / 6.0 - 1;
                for (Vector x : {Vector{u, v, face}, Vector{u, face, v}, Vector{face, u, v}}) {
                    x = {cosine * x[0] - sine * x[1], sine * x[0] + cosine * x[1], x[2]};
                    for (double& c : x) {
                        c = static_cast<float>(c);
                    }
                    given.push_back(x);
                }
            }
        }
    }
    const HullShape hull(given);
    for (const Vector& x : given) {
        EXPECT_LE(distance_to(hull, x), 1e-6);
    }
    EXPECT_NEAR(middle_of(hull), 1, 1e-6);
    for (int i = 0; i < 1000; ++i) {
        const Vector y = points.point(0.9);
        const Vector there = {cosine * y[0] - sine * y[1], sine * y[0] + cosine * y[1], y[2]};
        EXPECT_NEAR(distance_to(hull, there), distance_to(BoxShape{{2, 2, 2}}, y), 1e-6);
    }
    std::vector<Vector> sphere;
    for (int i = 0; i < 1500; ++i) {
        const Vector x = points.point();
        sphere.push_back(plus({0, 0, 0}, 1 / length(x), x));
    }
    const HullShape round(sphere);
    for (int i = 0; i < 100; ++i) {
        const Vector y = points.point(0.5);
        EXPECT_NEAR(distance_to(round, y), length(y) - 1, 0.03);
        EXPECT_GE(distance_to(round, y), length(y) - 1 - 1e-12);
    }
}

TEST(HullShape, refuses_what_has_no_inside) {
    const std::vector<Vector> corners = corners_of({1, 1, 1});
    expect_refusal([&] { HullShape(std::span(corners).first(3)); }, {"3 points given", "at least 4"});
    expect_refusal([&] { HullShape(std::span(corners).first(4)); }, {"in a plane"});
    expect_refusal([&] { HullShape(std::vector<Vector>(9, corners[0])); }, {"in a plane"});
    expect_refusal([&] { HullShape(std::vector<Vector>{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}); }, {"in a plane"});
    std::vector<Vector> bad = corners;
    bad[5][1] = std::numeric_limits<double>::quiet_NaN();
    expect_refusal([&] { HullShape{bad}; }, {"point 5", "finite"});
    Points points(1);
    std::vector<Vector> sphere;
    for (int i = 0; i < 4000; ++i) {
        const Vector x = points.point();
        sphere.push_back(plus({0, 0, 0}, 1 / length(x), x));
    }
    expect_refusal([&] { HullShape{sphere}; }, {"more than 4096 triangles", "fewer points"});
}

/// Where the nearest face is nearest by two cells, so that no edge is seen.
TEST(MeshShape, of_a_box_is_the_box_but_for_its_edges) {
    const Vector size = {1, 2, 0.7};
    const MeshShape mesh = box_as_mesh(size, 40);
    const BoxShape box = {size};
    Points points(4);
    int compared = 0;
    for (int i = 0; i < 20000; ++i) {
        Vector y = points.point(0.5);
        std::array<double, 3> in{};
        for (std::size_t a = 0; a < 3; ++a) {
            y[a] *= size[a];
            in[a] = std::abs(y[a]) - size[a] / 2;
        }
        std::sort(in.begin(), in.end());
        if (in[2] - in[1] > 0.2 && in[2] > -0.3) { // the spline takes nodes within 3/2 cells of 0.05
            ++compared;
            const SurfaceDistance one = surface_at(mesh, y), other = surface_at(box, y);
            EXPECT_NEAR(one.distance, other.distance, 1e-14);
            EXPECT_LT(length(plus(one.normal, -1, other.normal)), 1e-12);
            EXPECT_NEAR(one.slope, 1, 1e-12);
        }
        EXPECT_NEAR(distance_to(mesh, y), distance_to(box, y), 0.05);
        EXPECT_GE(distance_to(mesh, y), distance_to(box, y) - 1e-14); // it loses at its edges alone
    }
    EXPECT_GT(compared, 300);
    EXPECT_NEAR(middle_of(mesh), 0.35, 0.03);
}

/// By the square of the grid's spacing, where its mesh is as fine as that.
TEST(MeshShape, of_a_sphere_converges_to_it) {
    double before = 0;
    for (const int cells : {8, 16, 32}) {
        const MeshShape mesh = ball(1, cells == 8 ? 3 : cells == 16 ? 4 : 5, cells);
        Points points(6);
        double error = 0, turned = 0;
        for (int i = 0; i < 500; ++i) {
            const Vector x = points.point();
            const Vector y = plus({0, 0, 0}, (1 + 0.05 * points.number()) / length(x), x);
            const SurfaceDistance at = surface_at(mesh, y);
            error = std::max(error, std::abs(at.distance - (length(y) - 1)));
            turned = std::max(turned, length(plus(at.normal, -1 / length(y), y)));
        }
        EXPECT_LT(turned, 1.0 / cells);
        EXPECT_LT(error, 0.6 * std::pow(2.0 / cells, 2));
        if (before > 0) {
            EXPECT_GT(before / error, 3) << cells;
        }
        before = error;
    }
}

TEST(MeshShape, knows_its_inside_where_it_is_not_convex) {
    const MeshShape mesh = torus(1, 0.4, 96, 48, 48);
    Points points(7);
    int inside = 0;
    for (int i = 0; i < 5000; ++i) {
        const Vector y = points.point(1.5);
        const double exact = distance_to_torus(1, 0.4, y), found = surface_at(mesh, y).distance;
        if (exact > -0.2 && exact < 0.05) { // beyond a cell the box alone is known
            EXPECT_NEAR(found, exact, 0.01);
        }
        inside += found < 0;
        EXPECT_LE(distance_to(mesh, y), std::max(exact, 0.0) + 0.01); // a lower bound
        EXPECT_EQ(distance_to(mesh, y) < 0, found < 0);
    }
    EXPECT_GT(inside, 300);
    EXPECT_GT(distance_to(mesh, {0, 0, 0}), 0.3); // in its hole
    EXPECT_LE(distance_to(mesh, {9, 0, 0}), 7.6);
    EXPECT_GT(distance_to(mesh, {9, 0, 0}), 7.5);
}

/// At a sharp corner and a sharp edge the nearest triangle alone does not tell.
TEST(MeshShape, knows_its_outside_at_sharp_corners) {
    const std::vector<Vector> needle = {{0.9, 3, 0.1}, {0, 0, 0}, {0.3, 0, 0.1}, {0.1, 0, 0.3}};
    const HullShape hull(needle);
    const MeshShape mesh(needle, Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}, 100);
    Points points(13);
    int outside = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vector y = {0.45 + 0.5 * points.number(), 1.5 + 1.53 * points.number(), 0.15 + 0.17 * points.number()};
        if (distance_to(hull, y) > 1e-9) { // the spline is no less than the distance, which is convex
            ++outside;
            EXPECT_GT(surface_at(mesh, y).distance, 0);
        }
    }
    EXPECT_GT(outside, 10000);
}

/// The first place inside along a way.
TEST(MeshShape, is_entered_where_a_way_comes_in_first) {
    const MeshShape mesh = torus(1, 0.4, 48, 24, 32);
    Points points(8);
    int entered = 0;
    for (int i = 0; i < 300; ++i) {
        const Vector from = points.point(2), way = points.point(4);
        if (distance_to(mesh, from) <= 0) {
            continue;
        }
        double first = 2;
        for (int s = 0; s <= 1000 && first > 1; ++s) {
            first = distance_to(mesh, plus(from, s / 1000.0, way)) < 0 ? s / 1000.0 : first;
        }
        const auto in = entry(mesh, from, way);
        if (first <= 1) {
            ASSERT_TRUE(in) << i;
            EXPECT_LE(in->part, first + 1e-12);
        }
        if (in) {
            ++entered;
            const Vector place = plus(from, in->part, way);
            EXPECT_NEAR(distance_to(mesh, place), 0, 1e-10);
            EXPECT_LT(dot(in->normal, way), 0);
        }
    }
    EXPECT_GT(entered, 30);
}

/// However its triangles share vertices, and whichever side they turn outwards.
TEST(MeshShape, is_the_same_of_triangles_apart_and_turned_over) {
    const std::vector<Vector> corners = corners_of({1, 1, 1});
    std::vector<Vector> apart;
    Triangles own, over;
    for (const auto& t : kBoxTriangles) {
        const auto n = static_cast<std::uint32_t>(apart.size());
        own.push_back({n, n + 1, n + 2});
        over.push_back({t[1], t[0], t[2]});
        apart.insert(apart.end(), {corners[t[0]], corners[t[1]], corners[t[2]]});
    }
    const MeshShape a(corners, kBoxTriangles, 12), b(apart, own, 12), c(corners, over, 12);
    Points points(9);
    for (int i = 0; i < 200; ++i) {
        const Vector y = points.point(0.7);
        EXPECT_EQ(distance_to(a, y), distance_to(b, y));
        EXPECT_NEAR(distance_to(a, y), distance_to(c, y), 1e-15);
    }
    EXPECT_FALSE(a == b);
    EXPECT_TRUE(a == MeshShape(corners, kBoxTriangles, 12));
    EXPECT_FALSE(a == MeshShape(corners, kBoxTriangles, 13));
}

TEST(MeshShape, refuses_what_encloses_nothing) {
    const std::vector<Vector> corners = corners_of({1, 1, 1});
    const auto with = [&](auto change) {
        return [&corners, change] {
            std::vector<Vector> vertices = corners;
            Triangles triangles = kBoxTriangles;
            change(vertices, triangles);
            MeshShape(vertices, triangles);
        };
    };
    expect_refusal(with([](auto&, auto& t) { t.pop_back(); }), {"not closed", "3 of its edges", "from ("});
    expect_refusal(with([](auto&, auto& t) { std::swap(t[3][0], t[3][1]); }), {"not closed", "two of another turn"});
    expect_refusal(with([](auto&, auto& t) { t.insert(t.end(), kBoxTriangles.begin(), kBoxTriangles.end()); }),
                   {"not closed", "18 to more than two"});
    expect_refusal(with([](auto&, auto& t) { t[2][1] = 8; }), {"triangle 2", "vertex 8", "below 8"});
    expect_refusal(with([](auto& v, auto&) { v[4][0] = std::numeric_limits<double>::infinity(); }),
                   {"vertex 4", "finite"});
    expect_refusal(with([](auto&, auto& t) { t.clear(); }), {"encloses no space"});
    expect_refusal(with([](auto&, auto& t) { t = {{0, 1, 2}, {0, 2, 1}}; }), {"encloses no space"});
    expect_refusal(with([](auto& v, auto& t) {
                       v.push_back({0, -0.5, -0.5}); // the middle of an edge of triangle 1, left to one side alone
                       t.push_back({0, 8, 1});
                   }),
                   {"triangle 12", "no area"});
    for (const int cells : {3, 257, -1}) {
        expect_refusal([&] { MeshShape(corners, kBoxTriangles, cells); }, {"cells = ", "4 to 256"});
    }
}

TEST(HeightShape, of_a_plane_is_the_plane) {
    const HeightShape ground = slope(0.5, -0.3, 7, 5, 0.25, 0.4);
    const double size = std::sqrt(1 + 0.25 + 0.09);
    const PlaneShape plane = {{-0.5 / size, 1 / size, 0.3 / size}};
    Points points(10);
    for (int i = 0; i < 1000; ++i) {
        const Vector y = {0.75 + 0.75 * points.number(), points.number(), 0.8 + 0.8 * points.number()};
        const SurfaceDistance one = surface_at(ground, y), other = surface_at(plane, y);
        EXPECT_NEAR(distance_to(ground, y), distance_to(plane, y), 1e-14);
        EXPECT_NEAR(one.distance, other.distance, 1e-14);
        EXPECT_LT(length(plus(one.normal, -1, other.normal)), 1e-13);
        EXPECT_NEAR(one.slope, 1, 1e-14);
    }
}

TEST(HeightShape, meets_its_heights_and_is_level_beyond_them) {
    const HeightShape ground = waves(9, 6, 0.2, 0.3);
    const auto over = [&](double x, double z) { // f is linear in y
        const SurfaceDistance low = surface_at(ground, {x, 0, z}), high = surface_at(ground, {x, 1, z});
        return low.distance / (low.distance - high.distance);
    };
    for (std::size_t k = 0; k < 6; ++k) {
        for (std::size_t i = 0; i < 9; ++i) {
            EXPECT_NEAR(over(0.2 * static_cast<double>(i), 0.3 * static_cast<double>(k)), ground.heights()[9 * k + i],
                        1e-14);
        }
    }
    EXPECT_NEAR(over(-5, 0.6), over(0, 0.6), 1e-14);
    EXPECT_NEAR(over(0.5, 99), over(0.5, 1.5), 1e-14);
    EXPECT_NEAR(over(7, -3), ground.heights()[8], 1e-14);
    EXPECT_NEAR(surface_at(ground, {-5, 0, -5}).normal[1], 1, 1e-15);
}

/// No point of the ground is nearer than the distance says.
TEST(HeightShape, tells_no_more_than_how_far_the_ground_is) {
    const HeightShape ground = waves(9, 6, 0.2, 0.3);
    Points points(11);
    for (int i = 0; i < 200; ++i) {
        const Vector y = {0.8 + points.number(), 0.6 + 0.5 * points.number(), 0.7 + points.number()};
        const double distance = distance_to(ground, y);
        if (distance > 0) {
            for (int d = 0; d < 200; ++d) {
                const Vector way = points.point();
                EXPECT_GE(distance_to(ground, plus(y, 0.999 * distance / length(way), way)), 0);
            }
        }
    }
}

TEST(HeightShape, refuses_what_is_no_field) {
    const std::vector<double> heights(6, 0.0);
    expect_refusal([&] { HeightShape({1, 6}, {1, 1}, heights); }, {"1 x 6", "at least 2"});
    expect_refusal([&] { HeightShape({2, 2}, {1, 1}, heights); }, {"6 heights", "2 x 2"});
    expect_refusal([&] { HeightShape({std::size_t{1} << 40, std::size_t{1} << 40}, {1, 1}, heights); }, {"at most"});
    expect_refusal([&] { HeightShape({2, 3}, {1, 0}, heights); }, {"spacing = 0", "> 0"});
    std::vector<double> bad = heights;
    bad[4] = std::numeric_limits<double>::quiet_NaN();
    expect_refusal([&] { HeightShape({2, 3}, {1, 1}, bad); }, {"height 4", "finite"});
}

/// By differences, where distances are fields.
TEST(MadeShapes, forces_are_the_gradient_of_the_distance) {
    const MeshShape mesh = torus(1, 0.4, 48, 24, 32);
    const HeightShape ground = waves(9, 6, 0.2, 0.3);
    Points points(12);
    const auto hold = [&](const auto& shape, const Vector& y) {
        const SurfaceDistance at = surface_at(shape, y);
        const Symmetric curvature = curvature_at(shape, y);
        EXPECT_NEAR(length(at.normal), 1, 1e-14);
        constexpr std::size_t kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        for (std::size_t a = 0; a < 3; ++a) {
            const auto moved = [&](double step) {
                Vector there = y;
                there[a] += step;
                return surface_at(shape, there);
            };
            const SurfaceDistance more = moved(1e-5), less = moved(-1e-5);
            EXPECT_NEAR(at.slope * at.normal[a], (more.distance - less.distance) / 2e-5, 1e-4);
            for (std::size_t b = 0; b < 3; ++b) {
                // second derivatives jump where the nearest node changes: 1 in 1e4 of the ways crosses such a place
                EXPECT_NEAR(curvature[kEntry[a][b]], (more.slope * more.normal[b] - less.slope * less.normal[b]) / 2e-5,
                            1e-3);
            }
        }
    };
    int inside = 0;
    for (int i = 0; i < 300; ++i) {
        const Vector y = points.point(1.4);
        if (distance_to(mesh, y) < 0) {
            ++inside;
            hold(mesh, y);
        }
        hold(ground, {0.8 + 0.75 * points.number(), points.number(), 0.75 + 0.7 * points.number()});
    }
    EXPECT_GT(inside, 20);
}

/// The solids of `of`, as each shape that can say it.
template <class T>
std::vector<T> steps_on(const Obstacle& obstacle, int threads = 1) {
    PlanOptions options;
    options.threads = threads;
    TouchingBody<T> body(Lattice::box(8, 8, 8, kEdge), {obstacle}, options);
    body.set_velocity({0.3, -1, 0.2});
    body.dynamics.step({body.time_step, {0, -10, 0}}, 150);
    EXPECT_GT(body.dynamics.obstacle_readings().at(0).greatest_depth, 1e-4);
    return body.displacements();
}

/// A box as a hull and a plane as a height field push as the box and the plane do.
TEST(MadeShapes, move_bodies_as_the_shapes_do_that_they_are) {
    RigidPose pose{.position = {0.35, -0.62, 0.4}, .velocity = {0.1, 0, 0}, .angular_velocity = {0, 0.5, 0.1}};
    pose.rotation = turned(pose.rotation, {0.1, 0.4, 0.05});
    const Obstacle box = {.shape = BoxShape{{1, 1, 1}}, .pose = pose, .friction = 0.4};
    Obstacle hull = box;
    hull.shape = box_as_hull({1, 1, 1});
    const double size = std::sqrt(1 + 0.04 + 0.01);
    RigidPose low{.position = {-2, -0.45, -2}, .velocity = {0, 0.05, 0}};
    const Obstacle plane = {.shape = PlaneShape{{-0.2 / size, 1 / size, 0.1 / size}}, .pose = low, .friction = 0.4};
    Obstacle ground = plane;
    ground.shape = slope(0.2, -0.1, 11, 13, 0.5, 0.5);
    for (const auto& [of, as] : {std::pair(box, hull), std::pair(plane, ground)}) {
        const std::vector<double> one = steps_on<double>(of), other = steps_on<double>(as);
        for (std::size_t i = 0; i < one.size(); ++i) {
            ASSERT_NEAR(one[i], other[i], 1e-11) << i; // rounding, grown by 150 steps of rubbing
        }
    }
}

std::vector<Obstacle> made_obstacles() {
    const RigidPose below{.position = {0.5, -0.3, 0.5}, .velocity = {0, 0.2, 0}, .angular_velocity = {0.3, 0.5, 0.1}};
    RigidPose ground{.position = {-1, -0.05, -1}};
    return {{.shape = box_as_hull({0.7, 0.6, 0.8}), .pose = below, .friction = 0.4},
            {.shape = torus(0.4, 0.25, 24, 12, 32), .pose = {.position = {0.2, -0.2, 0.3}}, .friction = 0.2},
            {.shape = waves(31, 21, 0.1, 0.15), .pose = ground, .friction = 0.6}};
}

template <class T>
class MadeObstacles : public ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(MadeObstacles, Precisions);

TYPED_TEST(MadeObstacles, give_what_the_body_gains) {
    for (const Obstacle& obstacle : made_obstacles()) {
        TouchingBody<TypeParam> body(Lattice::box(8, 8, 8, kEdge), {obstacle});
        const Vector start = {0.3, -1.5, 0.2};
        body.set_velocity(start);
        body.dynamics.step({body.time_step}, 400);
        const Vector now = body.mean(body.velocities());
        const ObstacleReading reading = body.dynamics.obstacle_readings().at(0);
        const double rounding = sizeof(TypeParam) == 4 ? 2e-5 : 1e-12;
        EXPECT_GT(reading.impulse[1], 1);
        EXPECT_GT(reading.dissipated, 0);
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(body.mass() * (now[a] - start[a]), reading.impulse[a], rounding * body.mass()) << a;
        }
    }
}

TYPED_TEST(MadeObstacles, have_the_same_bits_for_any_number_of_threads) {
    for (const Obstacle& obstacle : made_obstacles()) {
        const std::vector<TypeParam> one = steps_on<TypeParam>(obstacle, 1);
        EXPECT_EQ(one, steps_on<TypeParam>(obstacle, 2));
        EXPECT_EQ(one, steps_on<TypeParam>(obstacle, 8));
    }
}

/// Blocks sleep as before: what comes from far is seen, and what stays far changes no bit.
TYPED_TEST(MadeObstacles, are_seen_from_far_and_left_alone_there) {
    for (Obstacle obstacle : made_obstacles()) {
        obstacle.pose.velocity = {0, 0, 0};
        obstacle.pose.angular_velocity = {0, 0, 0};
        obstacle.pose.position[1] -= 2;
        TouchingBody<TypeParam> body(Lattice::box(4, 4, 4, kEdge), {obstacle}),
            woken(Lattice::box(4, 4, 4, kEdge), {obstacle}), alone(Lattice::box(4, 4, 4, kEdge), {});
        for (auto* one : {&body, &woken, &alone}) {
            one->set_velocity({0, -4, 0});
        }
        body.dynamics.step({body.time_step}, 50);
        alone.dynamics.step({body.time_step}, 50);
        EXPECT_EQ(body.displacements(), alone.displacements());
        body.dynamics.step({body.time_step}, 950);
        for (int i = 0; i < 1000; ++i) { // setting the state makes every node be looked at
            woken.dynamics.step({body.time_step});
            const std::vector<TypeParam> v = woken.velocities();
            woken.dynamics.set_velocities(VectorField<const TypeParam>::aos(v.data(), v.size() / 3));
        }
        EXPECT_GT(body.dynamics.obstacle_readings().at(0).greatest_depth, 0);
        EXPECT_EQ(body.displacements(), woken.displacements());
    }
}

/// Without friction, and standing still, none gives energy to a body that beats against it.
TYPED_TEST(MadeObstacles, give_no_energy) {
    for (Obstacle obstacle : made_obstacles()) {
        obstacle.pose.velocity = {0, 0, 0};
        obstacle.pose.angular_velocity = {0, 0, 0};
        obstacle.friction = 0;
        TouchingBody<TypeParam> body(Lattice::box(8, 8, 8, kEdge), {obstacle});
        body.set_velocity({0.5, -2, 0.1});
        const double start = body.energy();
        for (int i = 0; i < 20; ++i) {
            body.dynamics.step({0.5 * body.time_step}, 40);
            EXPECT_LT(body.energy(), 1.02 * start);
            EXPECT_GE(body.dynamics.effect_energies().at(0).dissipated, -1e-3 * start);
        }
        EXPECT_NEAR(body.energy() + body.dynamics.effect_energies().at(0).dissipated, start, 0.02 * start);
        EXPECT_GT(body.mean(body.velocities())[1], -1.5); // it was thrown back, or stopped
    }
}

TEST(MadeObstacles, are_touched_by_skins_too) {
    const Lattice lattice = Lattice::box(4, 4, 4, kEdge);
    const RigidPose below{.position = {0.3, -0.45, 0.3}};
    std::vector<std::vector<double>> moved;
    for (const ObstacleShape& shape : {ObstacleShape(BoxShape{{1, 1, 1}}), ObstacleShape(box_as_hull({1, 1, 1}))}) {
        TouchingBody<double> body(lattice, {});
        body.dynamics.set_skin_obstacles(skin_points(lattice, boundary_mesh(lattice)),
                                         std::array{Obstacle{.shape = shape, .pose = below, .friction = 0.3}});
        body.set_velocity({0.1, -1, 0});
        body.dynamics.step({body.time_step, {0, -10, 0}}, 200);
        EXPECT_GT(body.dynamics.obstacle_readings().at(0).impulse[1], 1);
        moved.push_back(body.displacements());
    }
    for (std::size_t i = 0; i < moved[0].size(); ++i) {
        ASSERT_NEAR(moved[0][i], moved[1][i], 1e-11);
    }
}

TEST(MadeObstacles, without_data_are_refused) {
    for (const ObstacleShape& shape :
         {ObstacleShape(HullShape{}), ObstacleShape(MeshShape{}), ObstacleShape(HeightShape{})}) {
        expect_refusal([&] { TouchingBody<double>(Lattice::box(1, 1, 1, kEdge), {{.shape = shape}}); },
                       {"obstacle 0", "is empty"});
    }
}

} // namespace
} // namespace hybmss
