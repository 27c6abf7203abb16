#pragma once

/// \file
/// What a viewer's page and the program say to each other.
///
/// A page says, in words with a blank between them: "run", "pause", "restart", "step N", "speed X" (seconds of the
/// scene in one of the clock), "show N" (a frame of a finished run), "pull V X Y Z" (a point of the surface to a place,
/// m), "release". The program says in JSON what it shows and does, and in little-endian binary messages
///
///     surfaces  u32 1, u32 triangles, then three u32 each: numbers of points
///     frame     u32 2, u32 obstacles, f64 time (s), f64 steps, f64 steps a second,
///               f32 each: 16 an obstacle, as .vtu files have them; three a point (m)

#include "simulation/results/vtu_file.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

struct ViewMessage {
    enum class Kind { run, pause, restart, step, speed, show, pull, release };
    Kind kind = Kind::pause;
    std::size_t number = 0;    ///< of steps, 1 to a million; of the frame; of the point
    double speed = 1;          ///< from 1e-6 to 1e3
    Vector3 place = {0, 0, 0}; ///< m, each within 1e6
};

/// Nothing for what is no message.
std::optional<ViewMessage> parse_view_message(std::string_view text);

/// The faces of cells that no other one shares.
struct Surface {
    std::vector<std::uint32_t> nodes; ///< on it, in their order
    /// Of places in `nodes`, counter-clockwise seen from outside.
    std::vector<std::array<std::uint32_t, 3>> triangles;
};
Surface surface_of(std::span<const std::array<std::uint32_t, 8>> cells);

std::string surfaces_message(std::span<const Surface> surfaces);

struct ViewFrame {
    double time = 0, steps = 0, steps_a_second = 0;
    std::vector<VtuObstacle> obstacles;
    std::vector<std::array<float, 3>> points; ///< m, of all surfaces
};
std::string frame_message(const ViewFrame& frame);

} // namespace hybmss
