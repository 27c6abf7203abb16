#pragma once

/// \file
/// Vectors, rotations, and how deep a point lies in an obstacle, in the obstacle's own axes and about its position.

#include "hybmss/contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace hybmss {

using Point = std::array<double, 3>;

inline double dot(const Point& a, const Point& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(const Point& a, const Point& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Row by row.
using Matrix = std::array<double, 9>;

inline Point to_space(const Matrix& r, const Point& y) {
    return {r[0] * y[0] + r[1] * y[1] + r[2] * y[2], r[3] * y[0] + r[4] * y[1] + r[5] * y[2],
            r[6] * y[0] + r[7] * y[1] + r[8] * y[2]};
}
/// By the transposed matrix.
inline Point from_space(const Matrix& r, const Point& x) {
    return {r[0] * x[0] + r[3] * x[1] + r[6] * x[2], r[1] * x[0] + r[4] * x[1] + r[7] * x[2],
            r[2] * x[0] + r[5] * x[1] + r[8] * x[2]};
}
inline Point plus(const Point& a, double factor, const Point& b) {
    return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}
inline double length(const Point& a) {
    return std::sqrt(dot(a, a));
}

/// `r` turned further by the vector `angle` (Rodrigues), column by column.
inline Matrix turned(const Matrix& r, const Point& angle) {
    const double phi = length(angle);
    if (phi == 0) {
        return r;
    }
    const double sine = std::sin(phi), half = std::sin(phi / 2), versine = 2 * half * half;
    const Point n = {angle[0] / phi, angle[1] / phi, angle[2] / phi};
    Matrix out{};
    for (std::size_t c = 0; c < 3; ++c) {
        const Point p = {r[c], r[3 + c], r[6 + c]}, q = cross(n, p), qq = cross(n, q);
        for (std::size_t a = 0; a < 3; ++a) {
            out[3 * a + c] = p[a] + sine * q[a] + versine * qq[a];
        }
    }
    return out;
}

/// Where an obstacle's velocities bring it.
inline RigidPose pose_after(RigidPose pose, double time) {
    if (time > 0) {
        pose.position = plus(pose.position, time, pose.velocity);
        pose.rotation = turned(pose.rotation, {time * pose.angular_velocity[0], time * pose.angular_velocity[1],
                                               time * pose.angular_velocity[2]});
    }
    return pose;
}
/// m/s, in space, of the obstacle's point that is at `place` in its axes.
inline Point velocity_at(const RigidPose& pose, const Point& place) {
    return plus(pose.velocity, 1, cross(pose.angular_velocity, to_space(pose.rotation, place)));
}

/// The pose with a rotation: one up to what engines in float leave of it is the rotation nearby. Throws
/// std::invalid_argument for what is not finite or no rotation; `whose` it is.
RigidPose rigid(RigidPose pose, const std::string& whose);
/// The same of one an obstacle. Throws for another count, too.
std::vector<RigidPose> rigid(std::span<const RigidPose> poses, std::size_t obstacles);

/// The obstacles with what they leave to defaults, for a body with this critical time step. Throws
/// std::invalid_argument for what the structs do not allow.
std::vector<Obstacle> completed(std::span<const Obstacle> obstacles, double body_time_step);
/// Throws std::invalid_argument where one is free; `why` not.
void require_led(std::span<const Obstacle> obstacles, const char* why);
/// Throws std::invalid_argument unless it is one of so many and its position is finite.
void check_node(const SurfaceNode& node, std::size_t nodes);

/// Signed distance below zero inside, where it is exact, or a field in its place; outside a lower bound. `normal`: of
/// unit length, the way out, also where several are as short: any of them. `slope`: by how much the distance grows
/// along it, 1 where it is exact.
struct SurfaceDistance {
    double distance;
    Point normal;
    double slope = 1;
};

inline double distance_to(const PlaneShape& plane, const Point& y) {
    return dot(plane.normal, y);
}
inline SurfaceDistance surface_at(const PlaneShape& plane, const Point& y) {
    return {dot(plane.normal, y), plane.normal};
}

inline double distance_to(const SphereShape& sphere, const Point& y) {
    return std::sqrt(dot(y, y)) - sphere.radius;
}
inline SurfaceDistance surface_at(const SphereShape& sphere, const Point& y) {
    const double r = std::sqrt(dot(y, y));
    // At the centre, where r^2 may also have underflowed, every way is as long.
    return {r - sphere.radius, r > 0 ? Point{y[0] / r, y[1] / r, y[2] / r} : Point{0, 1, 0}};
}

inline double distance_to(const BoxShape& box, const Point& y) {
    return std::max(
        {std::abs(y[0]) - box.size[0] / 2, std::abs(y[1]) - box.size[1] / 2, std::abs(y[2]) - box.size[2] / 2});
}
inline SurfaceDistance surface_at(const BoxShape& box, const Point& y) {
    std::size_t nearest = 0;
    double distance = std::abs(y[0]) - box.size[0] / 2;
    for (std::size_t a = 1; a < 3; ++a) {
        if (const double d = std::abs(y[a]) - box.size[a] / 2; d > distance) {
            distance = d;
            nearest = a;
        }
    }
    Point normal = {0, 0, 0};
    normal[nearest] = y[nearest] < 0 ? -1 : 1;
    return {distance, normal};
}

/// The point of the axis that is nearest.
inline Point nearest_on_axis(const CapsuleShape& capsule, const Point& y) {
    const double square = dot(capsule.axis, capsule.axis);
    const double part = square > 0 ? std::clamp(dot(y, capsule.axis) / square, -0.5, 0.5) : 0;
    return {part * capsule.axis[0], part * capsule.axis[1], part * capsule.axis[2]};
}
inline double distance_to(const CapsuleShape& capsule, const Point& y) {
    return length(plus(y, -1, nearest_on_axis(capsule, y))) - capsule.radius;
}
inline SurfaceDistance surface_at(const CapsuleShape& capsule, const Point& y) {
    const Point away = plus(y, -1, nearest_on_axis(capsule, y));
    const double r = length(away);
    if (r > 0) {
        return {r - capsule.radius, {away[0] / r, away[1] / r, away[2] / r}};
    }
    // On the axis: at right angles to it, which is the shortest way from everywhere there.
    const Point& n = capsule.axis;
    const bool along_x = std::abs(n[0]) > std::abs(n[1]) && std::abs(n[0]) > std::abs(n[2]);
    const Point out = cross(n, along_x ? Point{0, 1, 0} : Point{1, 0, 0});
    const double size = length(out);
    return {-capsule.radius, size > 0 ? Point{out[0] / size, out[1] / size, out[2] / size} : Point{0, 1, 0}};
}

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
using Symmetric = std::array<double, 6>;
/// sum += factor a a^T
inline void add_square(double factor, const Point& a, Symmetric& sum) {
    std::size_t entry = 0;
    for (std::size_t p = 0; p < 3; ++p) {
        for (std::size_t q = p; q < 3; ++q) {
            sum[entry++] += factor * a[p] * a[q];
        }
    }
}

/// 1/m: by how much the normal changes as the point moves, the second derivatives of the distance, where these are
/// defined inside.
inline Symmetric curvature_at(const PlaneShape&, const Point&) {
    return {};
}
inline Symmetric curvature_at(const BoxShape&, const Point&) {
    return {};
}
/// (1 - n n^T) / r
inline Symmetric curvature_about(const Point& away) {
    const double square = dot(away, away);
    if (!(square > 0)) {
        return {};
    }
    const double r = std::sqrt(square);
    Symmetric curvature = {1 / r, 0, 0, 1 / r, 0, 1 / r};
    add_square(-1 / (r * square), away, curvature);
    return curvature;
}
inline Symmetric curvature_at(const SphereShape&, const Point& y) {
    return curvature_about(y);
}
inline Symmetric curvature_at(const CapsuleShape& capsule, const Point& y) {
    const Point away = plus(y, -1, nearest_on_axis(capsule, y));
    Symmetric curvature = curvature_about(away);
    const double square = dot(capsule.axis, capsule.axis), r = length(away);
    if (r > 0 && std::abs(dot(y, capsule.axis)) < square / 2) { // beside the axis nothing changes along it
        add_square(-1 / (r * square), capsule.axis, curvature);
    }
    return curvature;
}

/// Where a straight way comes in from outside.
struct Entry {
    double part; ///< of the way that is done there, 0 .. 1
    Point normal;
    double slope = 1; ///< of the distance, likewise
};

inline std::optional<Entry> entry(const SphereShape& sphere, const Point& from, const Point& way) {
    // |from + t way| = radius, the first t; c >= 0 outside
    const double a = dot(way, way), b = dot(from, way), c = dot(from, from) - sphere.radius * sphere.radius;
    const double discriminant = b * b - a * c;
    if (!(b < 0) || !(discriminant > 0)) {
        return {};
    }
    const double t = std::max(c, 0.0) / (-b + std::sqrt(discriminant));
    return t <= 1 ? std::optional(Entry{t, surface_at(sphere, plus(from, t, way)).normal}) : std::nullopt;
}
inline std::optional<Entry> entry(const BoxShape& box, const Point& from, const Point& way) {
    Entry in{-std::numeric_limits<double>::infinity(), {0, 0, 0}};
    double out = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        const double half = box.size[a] / 2;
        if (way[a] == 0) {
            if (!(std::abs(from[a]) < half)) {
                return {};
            }
            continue;
        }
        const double side = way[a] > 0 ? -1 : 1; // where it comes in
        if (const double t = (side * half - from[a]) / way[a]; t > in.part) {
            in = {t, {0, 0, 0}};
            in.normal[a] = side;
        }
        out = std::min(out, (-side * half - from[a]) / way[a]);
    }
    return in.part >= 0 && in.part < out ? std::optional(in) : std::nullopt;
}

/// The first entry into a ball about either end or into what is round between them.
inline std::optional<Entry> entry(const CapsuleShape& capsule, const Point& from, const Point& way) {
    std::optional<Entry> first;
    const SphereShape ball = {capsule.radius};
    for (const double end : {-0.5, 0.5}) {
        const std::optional<Entry> in = entry(ball, plus(from, -end, capsule.axis), way);
        first = in && (!first || in->part < first->part) ? in : first;
    }
    const double square = dot(capsule.axis, capsule.axis);
    if (!(square > 0)) {
        return first;
    }
    const auto across = [&](const Point& x) { return plus(x, -dot(x, capsule.axis) / square, capsule.axis); };
    const std::optional<Entry> in = entry(ball, across(from), across(way));
    const bool between = in && std::abs(dot(plus(from, in->part, way), capsule.axis)) <= square / 2;
    return between && (!first || in->part < first->part) ? in : first;
}

// Hulls, meshes and height fields: made_shapes.cpp. The distance of a mesh and of a height field is a field, whose
// slope is not 1 everywhere; forces are by its very gradient.

double distance_to(const HullShape& hull, const Point& y);
SurfaceDistance surface_at(const HullShape& hull, const Point& y);
inline Symmetric curvature_at(const HullShape&, const Point&) {
    return {};
}
std::optional<Entry> entry(const HullShape& hull, const Point& from, const Point& way);
double middle_of(const HullShape& hull);

double distance_to(const MeshShape& mesh, const Point& y);
SurfaceDistance surface_at(const MeshShape& mesh, const Point& y);
Symmetric curvature_at(const MeshShape& mesh, const Point& y);
std::optional<Entry> entry(const MeshShape& mesh, const Point& from, const Point& way);
double middle_of(const MeshShape& mesh);

double distance_to(const HeightShape& ground, const Point& y);
SurfaceDistance surface_at(const HeightShape& ground, const Point& y);
Symmetric curvature_at(const HeightShape& ground, const Point& y);

/// The corners of the triangles around a hull or a mesh; none of another shape.
std::vector<std::array<Point, 3>> triangles_of(const ObstacleShape& shape);
/// Whether it has the data that its functions look at.
bool is_made(const ObstacleShape& shape);

/// How deep a point is at the end of a straight way, and the way out: the nearest, unless it came in by another side or
/// has gone through, for then it is back there. Above zero: it touches nothing.
template <class Shape>
SurfaceDistance surface_after(const Shape& shape, const Point& from, const Point& to) {
    const SurfaceDistance end = surface_at(shape, to);
    if constexpr (std::is_same_v<Shape, PlaneShape> || std::is_same_v<Shape, HeightShape>) {
        return end;
    } else {
        const Point way = plus(to, -1, from);
        SurfaceDistance back = surface_at(shape, from);
        if (back.distance < 0) {
            back.distance += back.slope * dot(way, back.normal);
        } else if (const std::optional<Entry> in = entry(shape, from, way)) {
            back = {(1 - in->part) * in->slope * dot(way, in->normal), in->normal, in->slope};
        } else {
            return end;
        }
        return end.distance < 0 && dot(end.normal, back.normal) > 0 ? end : back;
    }
}

/// What takes back `depth`, where an acceleration of 1 takes `way`. Where the distance has hardly a slope, as in the
/// middle between two sides, it would be without bound: no more than where it has half of one.
inline double stopping_push(const SurfaceDistance& surface, double depth, double way) {
    return depth / way * (surface.slope < 0.5 ? 2 * surface.slope : 1);
}

/// The depth in m from where the way out may be on the other side.
inline double middle_of(const PlaneShape&) {
    return std::numeric_limits<double>::infinity();
}
inline double middle_of(const SphereShape& sphere) {
    return sphere.radius;
}
inline double middle_of(const BoxShape& box) {
    return *std::min_element(box.size.begin(), box.size.end()) / 2;
}
inline double middle_of(const CapsuleShape& capsule) {
    return capsule.radius;
}
inline double middle_of(const HeightShape&) {
    return std::numeric_limits<double>::infinity();
}
/// Of any of them.
double middle_of(const ObstacleShape& shape);

} // namespace hybmss
