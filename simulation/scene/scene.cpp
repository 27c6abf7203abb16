#include "hybmss/simulation/scene.hpp"

#include "layouts/read_file.hpp"
#include "simulation/scene/scene_keys.hpp"

#include <algorithm>

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

bool RegionWithout::operator==(const RegionWithout& other) const {
    return of == other.of && without == other.without;
}

std::array<double, 3> value_at(const std::array<double, 3>& constant, const TimeTable& table, double time) {
    if (table.empty()) {
        return constant;
    }
    const auto after =
        std::upper_bound(table.begin(), table.end(), time, [](double t, const auto& row) { return t < row[0]; });
    const auto before = after == table.begin() ? after : after - 1;
    std::array<double, 3> value = {(*before)[1], (*before)[2], (*before)[3]};
    if (before != after && after != table.end()) {
        const double part = (time - (*before)[0]) / ((*after)[0] - (*before)[0]);
        for (std::size_t a = 0; a < 3; ++a) {
            value[a] += part * ((*after)[a + 1] - value[a]);
        }
    }
    return value;
}

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
