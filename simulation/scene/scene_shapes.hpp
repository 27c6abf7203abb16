#pragma once

/// \file
/// What a key may be one of: the shapes of a region, of a cutting tool and of an obstacle, and the ways of a motion.
/// Each is a table of its own keys, in one place for all who take it.

#include "simulation/scene/scene_keys.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace hybmss::scene_format {

// -- Ranges. Lengths and accelerations beyond 1e9 have no meaning and overflow in float

inline constexpr double kNoBound = std::numeric_limits<double>::max();

constexpr Range from(double low, double high, std::string_view allowed) {
    return {allowed, low, high};
}
constexpr Range above(double low, double high, std::string_view allowed) {
    return {allowed, low, high, true};
}
constexpr Range inside(double low, double high, std::string_view allowed) {
    return {allowed, low, high, true, true};
}
/// Of what holds no number, and where other keys tell the bounds.
constexpr Range words(std::string_view allowed) {
    return {allowed};
}

inline constexpr Range kBounded = from(-1e9, 1e9, "three numbers, each at most 1e9 in size");
inline constexpr Range kFrom0 = from(0, kNoBound, "at least 0");
inline constexpr Range kFrom0To1e9 = from(0, 1e9, "at least 0 and at most 1e9");
inline constexpr Range kFrom0To1e6 = from(0, 1e6, "at least 0 and at most 1e6");
inline constexpr Range kAbove0 = above(0, kNoBound, "above 0");
inline constexpr Range kBox =
    from(-1e9, 1e9, "[[x, y, z], [x, y, z]], low corner first, each number at most 1e9 in size");
inline constexpr Range kSphereTable = words("{center = [x, y, z], radius = r}");
inline constexpr Range kPlaneTable = words("{point = [x, y, z], normal = [x, y, z]}");
inline constexpr Range kRotationTable = words("{axis = \"x\", \"y\" or \"z\", degrees = angle}");
inline constexpr Range kRegion =
    words("\"x-min\", \"x-max\", \"y-min\", \"y-max\", \"z-min\", \"z-max\", {box = [[x, y, z], [x, y, z]]}, "
          "{sphere = {center = [x, y, z], radius = r}}, {node = index} or {of = region, without = [region, ...]}");
inline constexpr Range kRegions = words("a list of regions, as `where` takes them");
inline constexpr Range kAxes = words("a string of one to three different letters of \"xyz\"");

using Vector3 = std::array<double, 3>;

// where

inline constexpr Key<SphereRegion> kSphereKeys[] = {
    {"center", "m", kBounded, "required", "its centre", member<&SphereRegion::center>},
    {"radius", "m", kFrom0To1e9, "required", "its radius", member<&SphereRegion::radius>},
};
inline constexpr KeyTable<SphereRegion> kSphere = {"where.sphere", "The value of `sphere`.", kSphereKeys};

struct NodeFormat : IntegerFormat {
    static NodeRegion read(const Given& given) { return {IntegerFormat::read(given)}; }
    static void check(const Check& check, NodeRegion region) { IntegerFormat::check(check, region.node); }
    static SceneValue write(NodeRegion region, const Range& range) { return IntegerFormat::write(region.node, range); }
};

inline RegionWithout& difference(Region& region) {
    auto* const held = std::get_if<RegionWithout>(&region);
    return held ? *held : region.emplace<RegionWithout>();
}
struct Of {
    using Owner = Region;
    static std::optional<Region> get(const Region& region) {
        const auto* held = std::get_if<RegionWithout>(&region);
        return held && !held->of.empty() ? std::optional(held->of[0]) : std::nullopt;
    }
    static void set(Region& region, Region of) { difference(region).of = {std::move(of)}; }
};
struct Without {
    using Owner = Region;
    static std::optional<std::vector<Region>> get(const Region& region) {
        const auto* held = std::get_if<RegionWithout>(&region);
        return held ? std::optional(held->without) : std::nullopt;
    }
    static void set(Region& region, std::vector<Region> without) { difference(region).without = std::move(without); }
};

inline constexpr Key<Region> kWhereKeys[] = {
    {"box", "m", kBox, "none", "nodes inside it or on its surface", field<BoxFormat, Alternative<BoxRegion>>},
    {"sphere", "", kSphereTable, "none", "nodes inside it or on its surface",
     field<TableFormat<kSphere>, Alternative<SphereRegion>>},
    {"node", "", from(0, kNoBound, "an integer, at least 0 and below the number of nodes"), "none",
     "one node; x fastest, then y, then z", field<NodeFormat, Alternative<NodeRegion>>},
    {"of", "", kRegion, "none", "with `without`: nodes of this region", field<RegionFormat, Of>},
    {"without", "", kRegions, "none", "with `of`: regions whose nodes are left out", field<RegionListFormat, Without>},
};
inline constexpr KeyTable<Region> kWhere = {
    "where",
    "The value of `where`, unless it names a face of the bounding box. One of, or `of` and `without` together:",
    kWhereKeys};

// -- Motions and planes

inline constexpr Key<Rotation> kRotationKeys[] = {
    {"axis", "", words("\"x\", \"y\" or \"z\""), "required", "direction of the axis",
     member_as<AxisFormat, &Rotation::axis>},
    {"degrees", "degrees", from(-36000, 36000, "at most 36000 in size"), "required",
     "counter-clockwise as seen against the axis", member<&Rotation::degrees>},
};
inline constexpr KeyTable<Rotation> kRotation = {"move.rotate", "The value of `rotate`.", kRotationKeys};

inline void relate_plane(const TableCheck& table, const HalfSpace& half) {
    if (half.normal == Vector3{}) {
        table.not_allowed("normal");
    }
}

inline constexpr Key<HalfSpace> kBehindKeys[] = {
    {"point", "m", kBounded, "required", "a point of the plane", member<&HalfSpace::point>},
    {"normal", "", from(-1e9, 1e9, "three numbers, not all zero, each at most 1e9 in size"), "required",
     "its normal, of any length", member<&HalfSpace::normal>},
};
inline constexpr KeyTable<HalfSpace> kBehind = {"cut.behind", "The value of `behind`.", kBehindKeys, nullptr,
                                                relate_plane};

// -- [[obstacle]]: its shapes, each of its own keys, to a shape and a position

struct Plane {
    using Owner = SceneObstacle;
    static std::optional<HalfSpace> get(const SceneObstacle& obstacle) {
        const auto* plane = std::get_if<PlaneShape>(&obstacle.shape);
        return plane ? std::optional(HalfSpace{obstacle.position, plane->normal}) : std::nullopt;
    }
    static void set(SceneObstacle& obstacle, const HalfSpace& half) {
        obstacle.shape = PlaneShape{half.normal};
        obstacle.position = half.point;
    }
};
struct Ball {
    using Owner = SceneObstacle;
    static std::optional<SphereRegion> get(const SceneObstacle& obstacle) {
        const auto* sphere = std::get_if<SphereShape>(&obstacle.shape);
        return sphere ? std::optional(SphereRegion{obstacle.position, sphere->radius}) : std::nullopt;
    }
    static void set(SceneObstacle& obstacle, const SphereRegion& sphere) {
        obstacle.shape = SphereShape{sphere.radius};
        obstacle.position = sphere.center;
    }
};
/// Two points, written for an obstacle between them: `middle` is its position.
struct Ends {
    Vector3 from, to;

    Vector3 middle() const { return {(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2}; }
    Vector3 extent() const { return {to[0] - from[0], to[1] - from[1], to[2] - from[2]}; }
};
/// By the shortest numbers that read as this very middle and extent: rounding parts most others.
inline Ends ends_of(const Vector3& middle, const Vector3& extent) {
    const auto rounded = [](double value, int digits) {
        char text[40];
        std::snprintf(text, sizeof text, "%.*e", digits - 1, value);
        return std::strtod(text, nullptr);
    };
    Ends ends;
    for (int digits = 1; digits <= 17; ++digits) {
        for (std::size_t a = 0; a < 3; ++a) {
            ends.from[a] = rounded(middle[a] - extent[a] / 2, digits);
            ends.to[a] = rounded(middle[a] + extent[a] / 2, digits);
        }
        if (ends.middle() == middle && ends.extent() == extent) {
            break;
        }
    }
    return ends;
}
struct Cuboid {
    using Owner = SceneObstacle;
    static std::optional<BoxRegion> get(const SceneObstacle& obstacle) {
        const auto* box = std::get_if<BoxShape>(&obstacle.shape);
        if (!box) {
            return std::nullopt;
        }
        const Ends corners = ends_of(obstacle.position, box->size);
        return BoxRegion{corners.from, corners.to};
    }
    static void set(SceneObstacle& obstacle, const BoxRegion& box) {
        const Ends corners = {box.low, box.high};
        obstacle.shape = BoxShape{corners.extent()};
        obstacle.position = corners.middle();
    }
};
struct CapsuleEnds {
    Vector3 from = {0, 0, 0}, to = {0, 0, 0};
    double radius = 0;
};
struct Capsule {
    using Owner = SceneObstacle;
    static std::optional<CapsuleEnds> get(const SceneObstacle& obstacle) {
        const auto* capsule = std::get_if<CapsuleShape>(&obstacle.shape);
        if (!capsule) {
            return std::nullopt;
        }
        const Ends ends = ends_of(obstacle.position, capsule->axis);
        return CapsuleEnds{ends.from, ends.to, capsule->radius};
    }
    static void set(SceneObstacle& obstacle, const CapsuleEnds& capsule) {
        const Ends ends = {capsule.from, capsule.to};
        obstacle.shape = CapsuleShape{ends.extent(), capsule.radius};
        obstacle.position = ends.middle();
    }
};

/// A hull, a mesh or a height field about the obstacle's position.
struct MadeKeys {
    ObstacleShape shape; ///< made where the scene has the data itself; else without any, until its file is read
    Vector3 at = {0, 0, 0};
    ObstacleSource source = {};
    std::vector<std::vector<double>> rows = {}; ///< points, or heights
};
inline std::vector<std::vector<double>> rows_of(const HullShape& hull) {
    std::vector<std::vector<double>> rows;
    for (const Vector3& point : hull.points()) {
        rows.push_back({point.begin(), point.end()});
    }
    return rows;
}
inline std::vector<std::vector<double>> rows_of(const MeshShape&) {
    return {};
}
inline std::vector<std::vector<double>> rows_of(const HeightShape& ground) {
    std::vector<std::vector<double>> rows(ground.counts()[1]);
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const auto row = ground.heights().subspan(k * ground.counts()[0], ground.counts()[0]);
        rows[k].assign(row.begin(), row.end());
    }
    return rows;
}
template <class Shape>
struct Made {
    using Owner = SceneObstacle;
    static std::optional<MadeKeys> get(const SceneObstacle& obstacle) {
        const auto* shape = std::get_if<Shape>(&obstacle.shape);
        if (!shape) {
            return std::nullopt;
        }
        MadeKeys keys{*shape, obstacle.position, obstacle.source};
        if (keys.source.file.empty()) {
            keys.rows = rows_of(*shape);
        }
        if constexpr (std::is_same_v<Shape, HeightShape>) {
            keys.source.spacing = shape->field ? shape->spacing()[0] : keys.source.spacing;
        }
        return keys;
    }
    static void set(SceneObstacle& obstacle, MadeKeys keys) {
        // One that waits for its file must tell of which kind it is.
        obstacle.shape = std::holds_alternative<Shape>(keys.shape) ? std::move(keys.shape) : Shape{};
        obstacle.position = keys.at;
        obstacle.source = std::move(keys.source);
    }
};

inline constexpr Key<HalfSpace> kPlaneKeys[] = {
    {"point", "m", kBounded, "required", "a point of it", member<&HalfSpace::point>},
    {"normal", "", from(-1e9, 1e9, "three numbers, not all 0, each at most 1e9 in size"), "required",
     "points to the side of the body; of any length", member<&HalfSpace::normal>},
};
inline constexpr KeyTable<HalfSpace> kPlane = {
    "obstacle.plane", "The value of `plane`: the half-space behind it is solid.", kPlaneKeys, nullptr, relate_plane};

inline constexpr Key<SphereRegion> kBallKeys[] = {
    {"center", "m", kBounded, "required", "its middle", member<&SphereRegion::center>},
    {"radius", "m", above(0, 1e9, "above 0 and at most 1e9"), "required", "its radius", member<&SphereRegion::radius>},
};
inline constexpr KeyTable<SphereRegion> kBall = {"obstacle.sphere", "The value of an obstacle's `sphere`.", kBallKeys};

inline constexpr Key<CapsuleEnds> kCapsuleKeys[] = {
    {"from", "m", kBounded, "required", "one end of its axis", member<&CapsuleEnds::from>},
    {"to", "m", kBounded, "required", "the other end", member<&CapsuleEnds::to>},
    {"radius", "m", above(0, 1e9, "above 0 and at most 1e9"), "required", "all that is as near to the axis is solid",
     member<&CapsuleEnds::radius>},
};
inline constexpr KeyTable<CapsuleEnds> kCapsule = {"obstacle.capsule", "The value of `capsule`: a rod with round ends.",
                                                   kCapsuleKeys};

inline constexpr Range kSurfacePath = words("the path of an STL, OBJ, PLY or glTF file, from the scene's folder on");

/// Makes the shape of the keys' rows; of a file, later.
template <class Make>
void complete_made(const GivenTable& given, std::string_view key, MadeKeys& keys, const Make& make) {
    if (given.count(key, "file") == 0) {
        given.missing(key, "or file must be given");
    }
    if (given.count(key, "file") == 2) {
        given.refuse("file", "only one of " + std::string(key) + " and file may be given");
    }
    if (given.has(key)) {
        const auto uneven = std::find_if(keys.rows.begin(), keys.rows.end(), [&](const auto& row) {
            return row.size() != (key == "points" ? 3 : keys.rows[0].size());
        });
        if (uneven != keys.rows.end()) {
            given.refuse(key, "row " + std::to_string(uneven - keys.rows.begin()) + " has " +
                                  std::to_string(uneven->size()) + " numbers: each must have " +
                                  std::to_string(key == "points" ? 3 : keys.rows[0].size()));
        }
        try {
            make();
        } catch (const std::invalid_argument& error) {
            given.refuse(key, error.what());
        }
    }
}

inline void complete_hull(const GivenTable& given, MadeKeys& keys) {
    complete_made(given, "points", keys, [&] {
        std::vector<Vector3> points;
        for (const std::vector<double>& row : keys.rows) {
            points.push_back({row[0], row[1], row[2]});
        }
        keys.shape = HullShape(points);
    });
}
inline void complete_heights(const GivenTable& given, MadeKeys& keys) {
    complete_made(given, "rows", keys, [&] {
        std::vector<double> heights;
        for (const std::vector<double>& row : keys.rows) {
            heights.insert(heights.end(), row.begin(), row.end());
        }
        keys.shape = HeightShape({keys.rows.empty() ? 0 : keys.rows[0].size(), keys.rows.size()},
                                 {keys.source.spacing, keys.source.spacing}, heights);
    });
}

inline constexpr Key<MadeKeys> kHullKeys[] = {
    {"points", "m", from(-1e9, 1e9, "[[x, y, z], ...], four or more, each number at most 1e9 in size"), "none",
     "solid is all between them", field<RowsFormat, Unless0<&MadeKeys::rows>>},
    {"file", "", kSurfacePath, "none", "or the vertices of a file",
     field<TextFormat, Unless0<&MadeKeys::source, &ObstacleSource::file>>},
    {"at", "m", kBounded, "[0, 0, 0]", "where their origin lies", member<&MadeKeys::at>},
};
inline constexpr KeyTable<MadeKeys> kHull = {
    "obstacle.hull", "The value of `hull`: the convex hull of points. It has `points` or `file`.", kHullKeys,
    complete_hull};

inline constexpr Key<MadeKeys> kMeshKeys[] = {
    {"file", "", kSurfacePath, "required", "a closed mesh: each edge belongs to two triangles of the same turn",
     field<TextFormat, Unless0<&MadeKeys::source, &ObstacleSource::file>>},
    {"cells", "", from(4, 256, "an integer, at least 4 and at most 256"), "64",
     "of the grid on which distances are kept, along the longest side; edges are rounded by one",
     member<&MadeKeys::source, &ObstacleSource::cells>},
    {"at", "m", kBounded, "[0, 0, 0]", "where its origin lies", member<&MadeKeys::at>},
};
inline constexpr KeyTable<MadeKeys> kMesh = {"obstacle.mesh", "The value of `mesh`: what a closed mesh encloses.",
                                             kMeshKeys};

inline constexpr Key<MadeKeys> kHeightKeys[] = {
    {"rows", "m", from(-1e9, 1e9, "[[height, ...], ...], two or more of two or more, each at most 1e9 in size"), "none",
     "heights along y: a row along x, one row after the other along z", field<RowsFormat, Unless0<&MadeKeys::rows>>},
    {"file", "", words("the path of a text file with a row of numbers a line, from the scene's folder on"), "none",
     "or a file of them", field<TextFormat, Unless0<&MadeKeys::source, &ObstacleSource::file>>},
    {"spacing", "m", above(0, 1e9, "above 0 and at most 1e9"), "required", "between them along x and z",
     member<&MadeKeys::source, &ObstacleSource::spacing>},
    {"at", "m", kBounded, "[0, 0, 0]", "where the first one stands, at height 0", member<&MadeKeys::at>},
};
inline constexpr KeyTable<MadeKeys> kHeight = {
    "obstacle.height", "The value of `height`: all that is below a height field. It has `rows` or `file`.", kHeightKeys,
    complete_heights};

} // namespace hybmss::scene_format
