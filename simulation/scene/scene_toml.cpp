// Scenes as TOML text: read, and written.

#include "layouts/read_file.hpp"
#include "simulation/scene/scene_keys.hpp"

#include <algorithm>
#include <charconv>
#include <sstream>

// One translation unit uses toml++, so its shared library is not needed.
#define TOML_HEADER_ONLY 1
// It asserts, and without assertions has clang assume, what a wrong scene may break ("[#"), before it reports that very
// thing as an error.
#if __has_include(<toml++/impl/preprocessor.h>)
#include <toml++/impl/preprocessor.h>
#undef TOML_ASSERT_ASSUME
#define TOML_ASSERT_ASSUME(expr) static_assert(true)
#endif
#include <toml++/toml.h>

namespace hybmss {

using namespace scene_format;

namespace {

/// The text by lines, so that messages can quote what was written.
class TomlText {
public:
    explicit TomlText(std::string_view text) {
        while (!text.empty()) {
            const std::size_t end = text.find('\n');
            lines_.push_back(text.substr(0, end));
            text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        }
    }

    /// Position and text of a value; long values and those of several lines are cut short.
    SceneSource::Entry quote(const toml::source_region& region) const;

private:
    std::vector<std::string_view> lines_;
};

SceneSource::Entry TomlText::quote(const toml::source_region& region) const {
    constexpr std::size_t kLongest = 60;
    SceneSource::Entry entry{region.begin.line, region.begin.column, {}};
    if (region.begin.line < 1 || region.begin.line > lines_.size()) {
        return entry;
    }
    // Columns count characters, not bytes: bytes 10xxxxxx continue a UTF-8 character.
    const bool whole = region.end.line == region.begin.line;
    unsigned column = 0;
    for (char c : lines_[region.begin.line - 1]) {
        column += (static_cast<unsigned char>(c) & 0xC0u) != 0x80u;
        if (column >= region.begin.column && (!whole || column < region.end.column) && c != '\r') {
            entry.value += c;
        }
    }
    if (!whole || entry.value.size() > kLongest) {
        entry.value.resize(std::min(entry.value.size(), kLongest));
        entry.value += " ...";
    }
    return entry;
}

SceneValue value_of(const toml::node& node, const TomlText& text) {
    SceneValue value;
    value.place = {node.source().begin.line, node.source().begin.column, {}};
    if (const toml::table* table = node.as_table()) {
        auto& members = value.data.emplace<SceneValue::Table>();
        for (const auto& [key, item] : *table) {
            const toml::source_position at = key.source().begin;
            members.push_back({std::string(key.str()), value_of(item, text), {at.line, at.column, {}}});
            members.back().value.place = text.quote(item.source());
        }
    } else if (const toml::array* array = node.as_array()) {
        auto& items = value.data.emplace<SceneValue::Array>();
        for (const toml::node& item : *array) {
            items.push_back(value_of(item, text));
        }
    } else if (const auto* word = node.as_string()) {
        value.data = word->get();
    } else if (const auto* integer = node.as_integer()) {
        value.data = integer->get();
    } else if (const auto* real = node.as_floating_point()) {
        value.data = real->get();
    } else if (const auto* flag = node.as_boolean()) {
        value.data = flag->get();
    }
    return value;
}

// -- Writing

std::string toml_text(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') {
            char escaped[8];
            std::snprintf(escaped, sizeof escaped, "\\u%04X", static_cast<unsigned>(c));
            quoted += escaped;
        } else {
            quoted.append(c == '"' || c == '\\' ? 1 : 0, '\\') += c;
        }
    }
    return quoted + '"';
}

/// With all digits that tell it from its neighbours, and with a point or an exponent, as a float must have.
std::string toml_text(double number) {
    char digits[32];
    std::string text(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
    return text.find_first_not_of("-0123456789") == std::string::npos ? text + ".0" : text;
}

std::string toml_text(const SceneValue& value) {
    std::string list;
    const auto add = [&](const std::string& one) { list.append(list.empty() ? "" : ", ").append(one); };
    if (const auto* items = value.as<SceneValue::Array>()) {
        for (const SceneValue& item : *items) {
            add(toml_text(item));
        }
        return "[" + list + "]";
    }
    if (const auto* members = value.as<SceneValue::Table>()) {
        for (const SceneValue::Member& member : *members) {
            add(member.name + " = " + toml_text(member.value));
        }
        return "{" + list + "}";
    }
    if (const auto* text = value.as<std::string>()) {
        return toml_text(*text);
    }
    if (const auto* integer = value.as<std::int64_t>()) {
        return std::to_string(*integer);
    }
    const auto* number = value.as<double>();
    return number ? toml_text(*number) : *value.as<bool>() ? "true" : "false";
}

} // namespace

namespace {

SceneText read_toml(std::string_view text, const std::string& filename) {
    try {
        const toml::table root = toml::parse(text, std::string_view(filename));
        std::ostringstream canonical;
        canonical << toml::json_formatter(root);
        return {*value_of(root, TomlText(text)).as<SceneValue::Table>(), canonical.str()};
    } catch (const toml::parse_error& error) {
        const toml::source_position& at = error.source().begin;
        throw SceneError(one_line(filename + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                                  ": TOML syntax: " + std::string(error.description())));
    }
}

std::string read_scene_file(const std::string& path) {
    constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 26; // of text that people or their scripts write
    if (std::error_code ignored; std::filesystem::is_directory(path, ignored)) {
        throw SceneError(path + ": is a directory; a scene file (TOML) is needed");
    }
    try {
        return read_file(path, Readable::file_or_pipe, kMostBytes);
    } catch (const ReadError& error) {
        throw SceneError(path + ": cannot be read: " + error.reason);
    }
}

Scene scene_of(const SceneText& text, const std::string& filename) {
    Scene scene;
    scene.source.file = filename;
    read_scene(scene, text.root);
    scene.source.canonical = text.canonical;
    return scene;
}

} // namespace

Scene parse_scene(std::string_view text, const std::string& filename) {
    return scene_of(read_toml(text, filename), filename);
}

Scene load_scene(const std::string& path) {
    return parse_scene(read_scene_file(path), path);
}

std::variant<Scene, WorldScene> parse_any_scene(std::string_view text, const std::string& filename) {
    const SceneText read = read_toml(text, filename);
    if (has_several_bodies(read.root)) {
        return read_world(read, filename);
    }
    return scene_of(read, filename);
}

std::variant<Scene, WorldScene> load_any_scene(const std::string& path) {
    return parse_any_scene(read_scene_file(path), path);
}

namespace {

void require_writable(const Scene& scene) {
    if (scene.body.voxels.empty() && scene.body.surface.empty() &&
        (!scene.body.labels.empty() || scene.body.origin != scene.body.place.translate)) {
        throw scene_error(scene, "body.cells", "labels and an origin that come from no file cannot be written");
    }
    if (scene.body.shape == SceneCells::mesh && scene.body.mesh_file.empty()) {
        throw scene_error(scene, "body.mesh", "a mesh that comes from no file cannot be written");
    }
    for (const SceneObstacle& obstacle : scene.obstacles) {
        const auto* const ground = std::get_if<HeightShape>(&obstacle.shape);
        if (obstacle.source.file.empty() && (std::holds_alternative<MeshShape>(obstacle.shape) ||
                                             (ground && ground->spacing()[0] != ground->spacing()[1]))) {
            throw scene_error(scene, "obstacle",
                              "a mesh, or heights of two spacings, that come from no file cannot be "
                              "written");
        }
    }
}

/// `more`: a line of its own, or "".
std::string table_text(const std::string& title, const SceneValue& value, const std::string& more = "") {
    std::string text = title + "\n" + more;
    for (const SceneValue::Member& member : *value.as<SceneValue::Table>()) {
        text.append(member.name).append(" = ").append(toml_text(member.value)).append("\n");
    }
    return text;
}

std::string title_of(const SceneTable& table) {
    const std::string name(table.name);
    return table.repeated ? "[[" + name + "]]" : "[" + name + "]";
}

} // namespace

std::string to_toml(const Scene& scene) {
    require_writable(scene);
    std::string text;
    for (const SceneTable& table : scene_tables()) {
        for (const SceneValue& value : table.write ? table.write(scene) : SceneValue::Array{}) {
            text += table_text(title_of(table), value);
        }
    }
    return text;
}

std::string to_toml(const WorldScene& world) {
    std::string text, shared;
    for (const NamedScene& body : world.bodies) {
        require_writable(body.scene);
        const std::string name = "\"" + body.name + "\"\n";
        const bool first = &body == &world.bodies[0];
        std::string own;
        for (const SceneTable& table : scene_tables()) {
            for (const SceneValue& value : table.write ? table.write(body.scene) : SceneValue::Array{}) {
                if (table.name == "body") {
                    text += table_text("[[body]]", value, "name = " + name);
                } else if (table.name == "material") {
                    text += table_text("[body.material]", value);
                } else if (table.repeated) {
                    own += table_text(title_of(table), value, "body = " + name);
                } else if (first) {
                    own += table_text(title_of(table), value);
                }
            }
        }
        shared += own;
    }
    text += shared;
    for (const auto& [name, value] : world_values(world)) {
        text += table_text("[[" + name + "]]", value);
    }
    return text;
}

} // namespace hybmss
