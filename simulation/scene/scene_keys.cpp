#include "simulation/scene/scene_keys.hpp"

#include <vector>

namespace hybmss {

const KeyRule* find_key_rule(std::string_view table, std::string_view name) {
    for (const KeyRule& rule : key_rules()) {
        if (rule.key.table == table && rule.key.name == name) {
            return &rule;
        }
    }
    return nullptr;
}

const TableRule* find_table_rule(std::string_view name) {
    for (const TableRule& rule : table_rules()) {
        if (rule.name == name) {
            return &rule;
        }
    }
    return nullptr;
}

std::string key_list(std::string_view table) {
    std::string list;
    const auto add = [&](std::string_view name) { list.append(list.empty() ? "" : ", ").append(name); };
    for (const TableRule& rule : table_rules()) {
        if (table.empty() && !rule.inner) {
            add(rule.name);
        }
    }
    for (const KeyRule& rule : key_rules()) {
        if (rule.key.table == table) {
            add(rule.key.name);
        }
    }
    return list;
}

std::span<const SceneKey> scene_keys() {
    static const std::vector<SceneKey> keys = [] {
        std::vector<SceneKey> all;
        for (const KeyRule& rule : key_rules()) {
            all.push_back(rule.key);
        }
        return all;
    }();
    return keys;
}

std::string scene_keys_markdown() {
    std::string text;
    const auto append = [&](auto... parts) { (text.append(parts), ...); };
    for (const TableRule& table : table_rules()) {
        if (table.inner) {
            append("### `", table.name, "`\n\n");
        } else {
            append("### `", table.repeated ? "[[" : "[", table.name, table.repeated ? "]]" : "]", "`\n\n");
        }
        append(table.meaning, table.required ? " Required." : "", "\n\n");
        append("| key | type | unit | allowed | default | meaning |\n|---|---|---|---|---|---|\n");
        for (const KeyRule& rule : key_rules()) {
            const SceneKey& key = rule.key;
            if (key.table == table.name) {
                append("| `", key.name, "` | ", key.type, " | ", key.unit, " | ", key.allowed, " | ", key.default_value,
                       " | ", key.meaning, " |\n");
            }
        }
        append("\n");
    }
    text.pop_back();
    return text;
}

} // namespace hybmss
