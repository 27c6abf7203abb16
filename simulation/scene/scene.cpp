#include "hybmss/simulation/scene.hpp"

#include "layouts/read_file.hpp"
#include "simulation/scene/scene_body.hpp"
#include "simulation/scene/scene_keys.hpp"

#include <algorithm>

namespace hybmss {

using namespace scene_format;

namespace scene_format {

bool is_array_of_tables(const SceneValue& value) {
    const auto* items = value.as<SceneValue::Array>();
    return items && !items->empty() &&
           std::all_of(items->begin(), items->end(), [](const SceneValue& v) { return v.as<SceneValue::Table>(); });
}

bool has_several_bodies(const SceneValue::Table& root) {
    return std::any_of(root.begin(), root.end(),
                       [](const auto& member) { return member.name == "body" && is_array_of_tables(member.value); });
}

void require_known(Scene& scene, const SceneValue::Member& member, std::span<const SceneTable> more) {
    const std::span<const SceneTable> all = scene_tables();
    const auto table = std::find_if(all.begin(), all.end(),
                                    [&](const SceneTable& one) { return one.read && one.name == member.name; });
    const bool is_table = member.value.as<SceneValue::Table>(), are_tables = is_array_of_tables(member.value);
    if (table != all.end() && (table->repeated ? are_tables : is_table)) {
        return;
    }
    scene.source.entries[member.name] = {member.place.line, member.place.column,
                                         is_table || are_tables ? "" : member.value.place.value};
    if (has_several_bodies({member})) {
        throw scene_error(scene, member.name,
                          "several bodies: only `hybmss run` and `hybmss explain` take such scenes");
    }
    std::vector<SceneTable> known;
    std::copy_if(all.begin(), all.end(), std::back_inserter(known), [](const SceneTable& one) { return one.read; });
    std::copy_if(more.begin(), more.end(), std::back_inserter(known),
                 [](const SceneTable& one) { return one.repeated && one.name != "body"; });
    if (const auto others = world_tables();
        more.empty() && std::any_of(others.begin(), others.end(), [&](const auto& one) {
            return one.read == nullptr && one.repeated && one.name == member.name;
        })) {
        throw scene_error(scene, member.name, "it is for scenes of [[body]] tables, which have names");
    }
    throw scene_error(scene, member.name,
                      table == all.end() ? "unknown table; allowed are " + name_list(known)
                      : table->repeated  ? "it must be given as [[" + member.name + "]], any number of times"
                                         : "it must be a table, [" + member.name + "]");
}

void read_scene(Scene& scene, const SceneValue::Table& root) {
    for (const SceneValue::Member& member : root) {
        require_known(scene, member);
    }
    for (const SceneTable& table : scene_tables()) {
        const std::string name(table.name);
        const auto member = std::find_if(root.begin(), root.end(), [&](const auto& one) { return one.name == name; });
        if (!table.read) {
            continue;
        }
        if (member == root.end()) {
            if (table.required) {
                scene.source.entries[name] = {1, 1, {}};
                throw scene_error(scene, name,
                                  "missing; a scene needs a table [" + name + "] with " + name_list(table.keys()));
            }
        } else if (!table.repeated) {
            table.read(scene, member->value, name);
        } else {
            std::size_t number = 0;
            for (const SceneValue& item : *member->value.as<SceneValue::Array>()) {
                table.read(scene, item, name + "[" + std::to_string(number++) + "]");
            }
        }
    }
    if (scene.body.size[0] > 0 && scene.body.cell_size == 0 && !scene.solver.accuracy) {
        throw scene_error(scene, "body.size",
                          "its mesh must be told: by cell_size, or by accuracy in [solver], which chooses it");
    }
    read_body_files(scene);
}

} // namespace scene_format

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

namespace {

/// Of a table with rows of a time and N numbers.
template <std::size_t N>
std::array<double, N - 1> value_of(const std::vector<std::array<double, N>>& table, double time) {
    const auto after =
        std::upper_bound(table.begin(), table.end(), time, [](double t, const auto& row) { return t < row[0]; });
    const auto before = after == table.begin() ? after : after - 1;
    std::array<double, N - 1> value{};
    std::copy(before->begin() + 1, before->end(), value.begin());
    if (before != after && after != table.end()) {
        const double part = (time - (*before)[0]) / ((*after)[0] - (*before)[0]);
        for (std::size_t a = 0; a + 1 < N; ++a) {
            value[a] += part * ((*after)[a + 1] - value[a]);
        }
    }
    return value;
}

} // namespace

std::array<double, 3> value_at(const std::array<double, 3>& constant, const TimeTable& table, double time) {
    return table.empty() ? constant : value_of(table, time);
}

double value_at(double constant, const NumberTable& table, double time) {
    return table.empty() ? constant : value_of(table, time)[0];
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
    const auto append_table = [&](const SceneTable& table, bool top) {
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
    };
    for (const SceneTable& table : scene_tables()) {
        append_table(table, table.read != nullptr);
    }
    for (const SceneTable& table : world_tables()) {
        append_table(table, table.repeated);
    }
    text.pop_back();
    return text;
}

} // namespace hybmss
