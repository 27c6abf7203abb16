#include "app/view/messages.hpp"

#include "layouts/messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

namespace hybmss {
namespace {

template <class T>
void append(std::string& bytes, T value) {
    static_assert(std::endian::native == std::endian::little && std::is_arithmetic_v<T>);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// The six faces of a cell by its corners' numbers, counter-clockwise seen from outside.
constexpr std::size_t kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                      {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

} // namespace

std::optional<ViewMessage> parse_view_message(std::string_view text) {
    std::vector<std::string_view> words;
    for (std::size_t at = 0; words.size() < 6;) {
        const std::size_t end = text.find(' ', at);
        words.push_back(text.substr(at, end - at));
        if (end == std::string_view::npos) {
            break;
        }
        at = end + 1;
    }
    struct Form {
        std::string_view word;
        ViewMessage::Kind kind;
        std::size_t words;
    };
    using Kind = ViewMessage::Kind;
    constexpr Form kForms[] = {{"run", Kind::run, 1},   {"pause", Kind::pause, 1},    {"restart", Kind::restart, 1},
                               {"step", Kind::step, 2}, {"speed", Kind::speed, 2},    {"show", Kind::show, 2},
                               {"pull", Kind::pull, 5}, {"release", Kind::release, 1}};
    const auto* const form = std::find_if(std::begin(kForms), std::end(kForms), [&](const Form& one) {
        return one.word == words[0] && one.words == words.size();
    });
    if (form == std::end(kForms)) {
        return std::nullopt;
    }
    ViewMessage message;
    message.kind = form->kind;
    const auto number = [&](std::size_t least, std::size_t most) {
        return parse_number(words[1], message.number) && message.number >= least && message.number <= most;
    };
    bool good = true;
    if (form->kind == Kind::step) {
        good = number(1, 1000000);
    } else if (form->kind == Kind::show || form->kind == Kind::pull) {
        good = number(0, 0xffffffff);
    } else if (form->kind == Kind::speed) {
        good = parse_number(words[1], message.speed) && message.speed >= 1e-6 && message.speed <= 1e3;
    }
    for (std::size_t a = 0; a < 3 && form->kind == Kind::pull; ++a) {
        double& x = message.place[a];
        good = good && parse_number(words[2 + a], x) && std::abs(x) <= 1e6;
    }
    return good ? std::optional(message) : std::nullopt;
}

Surface surface_of(std::span<const std::array<std::uint32_t, 8>> cells) {
    // Faces by their corners' numbers in order: two cells' common one comes twice, side by side.
    struct Face {
        std::array<std::uint32_t, 4> sorted, around;
    };
    std::vector<Face> faces;
    faces.reserve(6 * cells.size());
    for (const auto& cell : cells) {
        for (const auto& corners : kFaces) {
            Face& face = faces.emplace_back();
            for (std::size_t c = 0; c < 4; ++c) {
                face.around[c] = cell[corners[c]];
            }
            face.sorted = face.around;
            std::sort(face.sorted.begin(), face.sorted.end());
        }
    }
    std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
        return a.sorted != b.sorted ? a.sorted < b.sorted : a.around < b.around;
    });
    Surface surface;
    for (std::size_t f = 0; f < faces.size();) {
        std::size_t end = f + 1;
        while (end < faces.size() && faces[end].sorted == faces[f].sorted) {
            ++end;
        }
        if (end == f + 1) {
            const auto& n = faces[f].around;
            surface.triangles.push_back({n[0], n[1], n[2]});
            surface.triangles.push_back({n[0], n[2], n[3]});
            surface.nodes.insert(surface.nodes.end(), n.begin(), n.end());
        }
        f = end;
    }
    std::sort(surface.nodes.begin(), surface.nodes.end());
    surface.nodes.erase(std::unique(surface.nodes.begin(), surface.nodes.end()), surface.nodes.end());
    for (auto& triangle : surface.triangles) {
        for (std::uint32_t& node : triangle) {
            const auto place = std::lower_bound(surface.nodes.begin(), surface.nodes.end(), node);
            node = static_cast<std::uint32_t>(place - surface.nodes.begin());
        }
    }
    return surface;
}

std::string surfaces_message(std::span<const Surface> surfaces) {
    std::uint32_t triangles = 0, first = 0;
    for (const Surface& surface : surfaces) {
        triangles += static_cast<std::uint32_t>(surface.triangles.size());
    }
    std::string bytes;
    append(bytes, std::uint32_t{1});
    append(bytes, triangles);
    for (const Surface& surface : surfaces) {
        for (const auto& triangle : surface.triangles) {
            for (const std::uint32_t point : triangle) {
                append(bytes, first + point);
            }
        }
        first += static_cast<std::uint32_t>(surface.nodes.size());
    }
    return bytes;
}

std::string frame_message(const ViewFrame& frame) {
    std::string bytes;
    append(bytes, std::uint32_t{2});
    append(bytes, static_cast<std::uint32_t>(frame.obstacles.size()));
    append(bytes, frame.time);
    append(bytes, frame.steps);
    append(bytes, frame.steps_a_second);
    for (const VtuObstacle& obstacle : frame.obstacles) {
        append(bytes, static_cast<float>(obstacle.kind));
        for (const double x : obstacle.size) {
            append(bytes, static_cast<float>(x));
        }
        for (const double x : obstacle.position) {
            append(bytes, static_cast<float>(x));
        }
        for (const double x : obstacle.rotation) {
            append(bytes, static_cast<float>(x));
        }
    }
    bytes.append(reinterpret_cast<const char*>(frame.points.data()), frame.points.size() * sizeof frame.points[0]);
    return bytes;
}

} // namespace hybmss
