#include "simulation/run/supports.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace hybmss {
namespace {

bool holds(AxisSet axes, std::size_t axis) {
    return (axes >> axis & 1) != 0;
}

std::string path_of(int by) {
    return by < 0 ? "fix[" + std::to_string(-1 - by) + "].where" : "move[" + std::to_string(by) + "].where";
}

std::string line_of(const Scene& scene, const std::string& path) {
    const auto entry = scene.source.entries.find(path);
    return entry == scene.source.entries.end() ? path : "line " + std::to_string(entry->second.line);
}

} // namespace

std::vector<std::uint32_t> nodes_of(const Scene& scene, std::span<const Vector3> rest, const Region& region,
                                    const std::string& path) {
    std::vector<std::uint32_t> nodes = select_nodes(rest, scene.body.cell_size, region);
    if (nodes.empty()) {
        throw scene_error(scene, path,
                          "no node of the body lies in it; the region must hold at least one of the " +
                              std::to_string(rest.size()) + " nodes");
    }
    return nodes;
}

Supports::Supports(const Scene& scene, std::span<const Vector3> rest) : moves_(scene.moves) {
    std::map<std::uint32_t, Held> held;
    std::set<std::uint32_t> fixed_nodes, moved_nodes;
    for (std::size_t f = 0; f < scene.fixes.size(); ++f) {
        const int by = -1 - static_cast<int>(f);
        for (std::uint32_t n : nodes_of(scene, rest, scene.fixes[f].where, path_of(by))) {
            fixed_nodes.insert(n);
            for (std::size_t a = 0; a < 3; ++a) {
                held[n].by[a] = holds(scene.fixes[f].axes, a) ? by : held[n].by[a];
            }
        }
    }
    // Fixes came first and never contradict each other, so a contradiction is always found at a move.
    for (std::size_t m = 0; m < moves_.size(); ++m) {
        const int by = static_cast<int>(m);
        const std::vector<std::uint32_t> nodes = nodes_of(scene, rest, moves_[m].where, path_of(by));
        centers_.push_back(rest_centroid(rest, nodes));
        end_of_motion_ = std::max(end_of_motion_, moves_[m].over);
        for (std::uint32_t n : nodes) {
            moved_nodes.insert(n);
            for (std::size_t a = 0; a < 3; ++a) {
                if (!holds(moves_[m].axes, a)) {
                    continue;
                }
                int& holder = held[n].by[a];
                if (holder != Held::kFree) {
                    throw scene_error(scene, path_of(by),
                                      "node " + std::to_string(n) + " is held along " + "xyz"[a] + " already by " +
                                          line_of(scene, path_of(holder)) + "; one axis of a node may be held once");
                }
                holder = by;
            }
        }
    }
    fixed_node_count_ = fixed_nodes.size();
    moved_node_count_ = moved_nodes.size();
    for (const auto& [n, entry] : held) {
        PrescribedNode node{.node = n, .axes = 0};
        for (std::size_t a = 0; a < 3; ++a) {
            node.axes = static_cast<AxisSet>(node.axes | (entry.by[a] != Held::kFree ? 1u << a : 0u));
        }
        held_.push_back(entry);
        held_rest_.push_back(rest[n]);
        present_.push_back(node);
    }
    accelerations_.resize(present_.size());
    at(0);
}

template <class KinematicsOf>
std::span<const PrescribedNode> Supports::set(const KinematicsOf& kinematics) {
    for (std::size_t i = 0; i < present_.size(); ++i) {
        int last = Held::kFree;
        Kinematics k;
        for (std::size_t a = 0; a < 3; ++a) {
            const int by = held_[i].by[a];
            if (by < 0) {
                continue;
            }
            if (by != last) {
                const auto m = static_cast<std::size_t>(by);
                k = kinematics(moves_[m], held_rest_[i], centers_[m]);
                last = by;
            }
            present_[i].displacement[a] = k.displacement[a];
            present_[i].velocity[a] = k.velocity[a];
            accelerations_[i][a] = k.acceleration[a];
        }
    }
    return present_;
}

std::span<const PrescribedNode> Supports::at(double time) {
    return set([time](const Move& move, const Vector3& rest, const Vector3& center) {
        return moved(move, rest, center, time);
    });
}

std::span<const PrescribedNode> Supports::at_part(double fraction) {
    return set([fraction](const Move& move, const Vector3& rest, const Vector3& center) {
        return Kinematics{moved_part(move, rest, center, fraction), {}, {}};
    });
}

} // namespace hybmss
