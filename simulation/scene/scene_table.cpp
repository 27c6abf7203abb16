#include "simulation/scene/scene_table.hpp"

#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace hybmss {

SceneTable::SceneTable(Scene& scene, const TomlText& text, const toml::table& values, std::string_view table,
                       std::string path)
    : scene_(scene), text_(text), values_(values), table_(table), path_(std::move(path)) {
    for (const auto& [key, value] : values_) {
        SceneSource::Entry entry = text_.quote(value.source());
        if (!find_key_rule(table_, key.str())) {
            entry.line = key.source().begin.line;
            entry.column = key.source().begin.column;
            scene_.source.entries[this->path(key.str())] = entry;
            throw scene_error(scene_, this->path(key.str()), "unknown key; allowed are " + key_list(table_));
        }
        scene_.source.entries[this->path(key.str())] = std::move(entry);
    }
    for (const KeyRule& rule : key_rules()) {
        if (rule.key.table == table_ && rule.required() && !has(rule.key.name)) {
            throw missing(rule.key.name);
        }
    }
}

const KeyRule& SceneTable::rule(std::string_view key) const {
    const KeyRule* found = find_key_rule(table_, key);
    if (!found) {
        throw std::logic_error("the parser reads the key " + path(key) + ", which the table of keys does not have");
    }
    return *found;
}

SceneError SceneTable::missing(std::string_view key, std::string_view wanted) const {
    const SceneSource::Entry start = text_.quote(values_.source());
    scene_.source.entries[path(key)] = {start.line, start.column, {}};
    return scene_error(scene_, path(key),
                       "missing; it " +
                           (wanted.empty() ? "must be " + std::string(rule(key).key.allowed) : std::string(wanted)));
}

SceneError SceneTable::not_allowed(std::string_view key) const {
    return scene_error(scene_, path(key), "it must be " + std::string(rule(key).key.allowed));
}

double SceneTable::checked_number(const toml::node& node, std::string_view key) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    const auto valid = rule(key).valid;
    if (!value || !std::isfinite(*value) || (valid && !valid(*value))) {
        throw not_allowed(key);
    }
    return *value;
}

double SceneTable::number(std::string_view key) const {
    const toml::node& node = *values_.get(key);
    if (!node.is_number()) {
        throw scene_error(scene_, path(key), "it must be a number " + std::string(rule(key).key.allowed));
    }
    return checked_number(node, key);
}

std::array<double, 3> SceneTable::vector_of(const toml::node* node, std::string_view key) const {
    const toml::array* array = node ? node->as_array() : nullptr;
    if (!array || array->size() != 3) {
        throw not_allowed(key);
    }
    std::array<double, 3> values{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        values[axis] = checked_number(*array->get(axis), key);
    }
    return values;
}

std::array<double, 3> SceneTable::vector(std::string_view key) const {
    return vector_of(values_.get(key), key);
}

std::array<std::int64_t, 3> SceneTable::counts(std::string_view key) const {
    const toml::array* array = values_.get(key)->as_array();
    if (!array || array->size() != 3) {
        throw not_allowed(key);
    }
    std::array<std::int64_t, 3> values{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!array->get(axis)->is_integer()) {
            throw not_allowed(key);
        }
        checked_number(*array->get(axis), key);
        values[axis] = array->get(axis)->as_integer()->get();
    }
    return values;
}

std::int64_t SceneTable::integer(std::string_view key) const {
    if (!values_.get(key)->is_integer()) {
        throw not_allowed(key);
    }
    number(key);
    return values_.get(key)->as_integer()->get();
}

std::string SceneTable::text(std::string_view key) const {
    const auto value = values_.get(key)->value_exact<std::string>();
    if (!value || value->empty()) {
        throw not_allowed(key);
    }
    return *value;
}

std::string SceneTable::name(std::string_view key) const {
    std::string value = text(key);
    if (value.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") !=
        std::string::npos) {
        throw not_allowed(key);
    }
    return value;
}

std::string SceneTable::choice(std::string_view key) const {
    const std::string word = text(key);
    std::string_view choices = rule(key).choices;
    while (!choices.empty()) {
        const std::size_t end = std::min(choices.find(' '), choices.size());
        if (choices.substr(0, end) == word) {
            return word;
        }
        choices.remove_prefix(std::min(end + 1, choices.size()));
    }
    throw not_allowed(key);
}

AxisSet SceneTable::axes(std::string_view key) const {
    AxisSet set = 0;
    const std::string letters = text(key);
    for (char c : letters) {
        if (c < 'x' || c > 'z') {
            throw not_allowed(key);
        }
        set = static_cast<AxisSet>(set | 1u << (c - 'x'));
    }
    // A repeated letter would leave fewer bits than letters.
    if (static_cast<std::size_t>(std::popcount(set)) != letters.size()) {
        throw not_allowed(key);
    }
    return set;
}

bool SceneTable::boolean(std::string_view key) const {
    const auto value = values_.get(key)->value_exact<bool>();
    if (!value) {
        throw not_allowed(key);
    }
    return *value;
}

SceneTable SceneTable::inner(std::string_view key, std::string_view table) const {
    const toml::table* values = values_.get(key)->as_table();
    if (!values) {
        throw not_allowed(key);
    }
    return SceneTable(scene_, text_, *values, table, path(key));
}

BoxRegion SceneTable::box(std::string_view key) const {
    const toml::array* corners = values_.get(key)->as_array();
    if (!corners || corners->size() != 2) {
        throw not_allowed(key);
    }
    BoxRegion box{vector_of(corners->get(0), key), vector_of(corners->get(1), key)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (box.low[axis] > box.high[axis]) {
            throw not_allowed(key);
        }
    }
    return box;
}

Region SceneTable::region(std::string_view key) const {
    if (values_.get(key)->is_string()) {
        const std::string face = text(key);
        const std::string side = face.size() == 5 ? face.substr(1) : "";
        if ((side != "-min" && side != "-max") || face[0] < 'x' || face[0] > 'z') {
            throw not_allowed(key);
        }
        return FaceRegion{face[0] - 'x', side == "-max"};
    }
    const SceneTable shape = inner(key, "where");
    if (shape.values_.size() != 1) {
        throw not_allowed(key);
    }
    if (shape.has("box")) {
        return shape.box("box");
    }
    if (shape.has("sphere")) {
        const SceneTable sphere = shape.inner("sphere", "where.sphere");
        return SphereRegion{sphere.vector("center"), sphere.number("radius")};
    }
    return NodeRegion{shape.integer("node")};
}

} // namespace hybmss
