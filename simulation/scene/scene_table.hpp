#pragma once

/// \file
/// One TOML table of a scene, read through the table of keys: every key known, every value of its type and range.

#include "simulation/scene/scene_keys.hpp"
#include "simulation/scene/toml_text.hpp"

#include <array>
#include <string>
#include <string_view>

namespace hybmss {

/// Reads values and notes in `scene.source` where they stood. Each reader throws SceneError. Keys are those of `table`.
class SceneTable {
public:
    /// Refuses unknown keys and missing required ones. `table` names the rules, `path` this table in messages and
    /// sources.
    SceneTable(Scene& scene, const TomlText& text, const toml::table& values, std::string_view table, std::string path);

    bool has(std::string_view key) const { return values_.contains(key); }
    double number(std::string_view key) const;
    std::array<double, 3> vector(std::string_view key) const;
    std::array<std::int64_t, 3> counts(std::string_view key) const;
    std::int64_t integer(std::string_view key) const;
    /// One of the key's choices.
    std::string choice(std::string_view key) const;
    std::string text(std::string_view key) const;
    /// A text of letters, digits, _ and - alone.
    std::string name(std::string_view key) const;
    AxisSet axes(std::string_view key) const;
    Region region(std::string_view key) const;
    BoxRegion box(std::string_view key) const;
    bool boolean(std::string_view key) const;
    /// The inner table `table` that is the value of `key`.
    SceneTable inner(std::string_view key, std::string_view table) const;

    std::string path(std::string_view key) const { return path_ + "." + std::string(key); }
    /// The error that `key` is not given, where others make it required: "missing; " and what it must be.
    SceneError missing(std::string_view key, std::string_view wanted = {}) const;
    /// The error that the value of `key` is not what its rule allows.
    SceneError not_allowed(std::string_view key) const;

private:
    const KeyRule& rule(std::string_view key) const;
    double checked_number(const toml::node& node, std::string_view key) const;
    std::array<double, 3> vector_of(const toml::node* node, std::string_view key) const;

    Scene& scene_;
    const TomlText& text_;
    const toml::table& values_;
    std::string_view table_;
    std::string path_;
};

} // namespace hybmss
