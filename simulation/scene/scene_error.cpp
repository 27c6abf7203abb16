#include "hybmss/simulation/scene.hpp"
#include "simulation/scene/one_line.hpp"

namespace hybmss {
namespace {

/// "fix[1].where" -> "fix.where": the line tells which one.
std::string without_indices(const std::string& path) {
    std::string key;
    bool inside = false;
    for (char c : path) {
        inside = inside || c == '[';
        if (!inside) {
            key += c;
        }
        inside = inside && c != ']';
    }
    return key;
}

} // namespace

SceneError scene_error(const Scene& scene, const std::string& path, const std::string& reason) {
    const SceneSource& source = scene.source;
    std::string message = source.file.empty() ? "scene" : source.file;
    std::string value;
    if (const auto entry = source.entries.find(path); entry != source.entries.end()) {
        message.append(":").append(std::to_string(entry->second.line));
        message.append(":").append(std::to_string(entry->second.column));
        value = entry->second.value;
    }
    message.append(": ").append(without_indices(path));
    if (!value.empty()) {
        message.append(" = ").append(value);
    }
    return SceneError(one_line(message.append(": ").append(reason)));
}

} // namespace hybmss
