#pragma once

/// \file
/// Values of a scene's text, whatever its syntax, and what is told where one of them is refused.

#include "hybmss/simulation/scene.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace hybmss::scene_format {

struct SceneValue {
    struct Member;
    using Array = std::vector<SceneValue>;
    using Table = std::vector<Member>;

    /// Nothing stands for what means nothing in a scene, such as a date.
    std::variant<std::monostate, bool, std::int64_t, double, std::string, Array, Table> data;
    SceneSource::Entry place = {};

    template <class T>
    const T* as() const {
        return std::get_if<T>(&data);
    }
};
struct SceneValue::Member {
    std::string name;
    SceneValue value;
    SceneSource::Entry place = {}; ///< of the name
};

/// What a key's value must be: in words, and for every number in it. Numbers that are not finite are never allowed. The
/// words of a choice are those in quotes, in the order of their enumeration.
struct Range {
    std::string_view allowed;
    double low = std::numeric_limits<double>::lowest(), high = std::numeric_limits<double>::max();
    bool above_low = false, below_high = false; ///< the bound itself is not allowed

    bool holds(double v) const { return (above_low ? v > low : v >= low) && (below_high ? v < high : v <= high); }
};

/// One key of the format, as messages and the documentation know it.
struct SceneKey {
    std::string_view table; ///< "material"; "fix" for [[fix]]; "where" and "where.sphere" for inline tables
    std::string_view name, type;
    std::string_view unit;          ///< "" where there is none
    std::string_view allowed;       ///< what a value must be
    std::string_view default_value; ///< "required" where there is none
    std::string_view meaning;
};

/// One key of a scene whose numbers are held against its range. Throws SceneError.
struct Check {
    const Scene& scene;
    std::string path; ///< "fix[1].where"
    Range range;
    bool as_written; ///< the numbers are those of the scene's text, which messages quote

    void number(double value) const;
    [[noreturn]] void refuse(double value, std::string_view allowed) const;
};

/// The value of a key in a scene's text, read by its type. Throws SceneError where it is of another, or out of range.
struct Given : Check {
    Scene& source; ///< where inner tables note their keys
    const SceneValue& value;

    [[noreturn]] void refuse() const { Check::refuse(0, range.allowed); }
    template <class T>
    const T& as() const {
        const T* found = value.as<T>();
        return found ? *found : (refuse(), *found);
    }
    /// Of so many values.
    const SceneValue::Array& array(const SceneValue& item, std::size_t size) const;
    /// A number of any size, and one within the range.
    double real(const SceneValue& item) const;
    double number(const SceneValue& item) const;
    std::int64_t integer(const SceneValue& item) const;
    std::array<double, 3> vector(const SceneValue& item) const;
};

/// One table of a scene, for what its keys must be together. Throws SceneError.
struct TableCheck {
    const Scene& scene;
    std::string path;
    std::vector<SceneKey> keys;
    bool as_written;

    Check at(std::string_view key, const Range& range) const {
        return {scene, path + "." + std::string(key), range, as_written};
    }
    [[noreturn]] void refuse(std::string_view key, const std::string& reason) const {
        throw scene_error(scene, at(key, {}).path, reason);
    }
    /// The value of `key` is not what its range says.
    [[noreturn]] void not_allowed(std::string_view key, double value = 0) const {
        at(key, {}).refuse(value, allowed(key));
    }
    std::string_view allowed(std::string_view key) const;
};

/// A table in a scene's text. Notes in the scene where its keys stand.
struct GivenTable : TableCheck {
    Scene& source;
    const SceneValue& value; ///< a table

    /// Throws SceneError where there is a key that is not one of `keys`, or a required one is missing.
    void note_keys() const;
    const SceneValue* find(std::string_view key) const;
    bool has(std::string_view key) const { return find(key) != nullptr; }
    /// How many of these keys are given.
    int count(auto... names) const { return (has(names) + ...); }
    /// `key` is not given, where others make it required: "missing; it " and what it must be.
    [[noreturn]] void missing(std::string_view key, std::string_view wanted = {}) const;
};

/// "cells, cell_size": the names of keys or tables.
std::string name_list(const auto& all) {
    std::string list;
    for (const auto& one : all) {
        list.append(list.empty() ? "" : ", ").append(one.name);
    }
    return list;
}

} // namespace hybmss::scene_format
