#include "hybmss/simulation/scene.hpp"

#include "layouts/read_file.hpp"
#include "simulation/scene/scene_keys.hpp"

namespace hybmss {

using namespace scene_format;

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

Scene within_ranges(Scene scene) {
    for (const SceneTable& table : scene_tables()) {
        if (table.check) {
            table.check(scene);
        }
    }
    return scene;
}

std::string scene_keys_markdown() {
    std::string text;
    const auto append = [&](auto... parts) { (text.append(parts), ...); };
    for (const SceneTable& table : scene_tables()) {
        const bool top = table.read != nullptr;
        append("### `",
               !top             ? ""
               : table.repeated ? "[["
                                : "[",
               table.name,
               !top             ? ""
               : table.repeated ? "]]"
                                : "]",
               "`\n\n");
        append(table.meaning, table.required ? " Required." : "", "\n\n");
        append("| key | type | unit | allowed | default | meaning |\n|---|---|---|---|---|---|\n");
        for (const SceneKey& key : table.keys()) {
            append("| `", key.name, "` | ", key.type, " | ", key.unit, " | ", key.allowed, " | ", key.default_value,
                   " | ", key.meaning, " |\n");
        }
        append("\n");
    }
    text.pop_back();
    return text;
}

} // namespace hybmss
