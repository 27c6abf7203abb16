#pragma once

/// \file
/// A scene of several bodies that touch each other and are tied. Plain data; read from TOML or filled by hand.

#include "hybmss/simulation/scene.hpp"

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hybmss {

/// One body of several, with all that the scene says of it alone and of all bodies: fixes, moves, loads, labels, cuts
/// and probes are its own; gravity, damping, solver and output are everybody's.
struct NamedScene {
    std::string name;
    Scene scene;
    bool operator==(const NamedScene&) const = default;
};

/// Bodies that touch, every one the others.
struct SceneContact {
    std::vector<std::string> between;
    bool self = false;    ///< and each of them itself, but for its own neighbourhood
    double friction = 0;  ///< Coulomb's coefficient
    double stiffness = 0; ///< 1/s^2, as BodyContact::stiffness; 0: by the critical time step
    bool operator==(const SceneContact&) const = default;
};

/// Nodes of a body, each tied to what lies there when the bodies begin.
struct SceneAttachment {
    struct Nodes {
        std::string body;
        Region where;
        bool operator==(const Nodes&) const = default;
    };
    struct Target {
        std::string body = {};                           ///< "": in space
        std::optional<std::array<double, 3>> point = {}; ///< m, in space: all nodes to this one; else where each begins
        bool operator==(const Target&) const = default;
    };
    Nodes from;
    Target to;
    double stiffness = std::numeric_limits<double>::infinity(); ///< N/m in all, shared evenly; infinite: welded
    bool operator==(const SceneAttachment&) const = default;
};

struct WorldScene {
    std::vector<NamedScene> bodies; ///< of equal gravity, damping, solver and output
    std::vector<SceneContact> contacts;
    std::vector<SceneAttachment> attachments;
    SceneSource source;
    bool operator==(const WorldScene&) const = default;
};

/// Reads what has [[body]] tables as a world, what has one [body] as a scene. Throws SceneError.
std::variant<Scene, WorldScene> parse_any_scene(std::string_view text, const std::string& filename);
std::variant<Scene, WorldScene> load_any_scene(const std::string& path);

/// As TOML text that parse_any_scene() makes an equal scene of, with obstacles body by body. Throws as the other does.
std::string to_toml(const WorldScene& scene);

/// The scene itself. Throws SceneError where bodies have no name of their own, something names a body that is not
/// there, or a number is out of its key's range: for worlds filled by hand.
WorldScene within_ranges(WorldScene scene);

} // namespace hybmss
