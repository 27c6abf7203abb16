#pragma once

/// \file
/// The one table of scene keys: the parser checks by it, its messages quote it, docs/report/scene_keys.md shows it.

#include "hybmss/simulation/scene.hpp"

#include <span>
#include <string>
#include <string_view>

namespace hybmss {

enum class KeyKind { number, vector, counts, integer, text, choice, region, table, axes, boolean };

/// A key with what the parser checks: `valid` holds for every number in the value (it sees finite numbers only);
/// `choices` are the words of a choice, parted by blanks.
struct KeyRule {
    SceneKey key;
    KeyKind kind;
    bool (*valid)(double) = nullptr;
    std::string_view choices = {};

    bool required() const { return key.default_value == "required"; }
};

/// A table of the format. `repeated`: [[name]], any number of times. `inner`: the value of a key of another table.
struct TableRule {
    std::string_view name;
    bool required = false, repeated = false, inner = false;
    std::string_view meaning;
};

std::span<const KeyRule> key_rules();
std::span<const TableRule> table_rules();

/// nullptr where there is no such key.
const KeyRule* find_key_rule(std::string_view table, std::string_view name);
const TableRule* find_table_rule(std::string_view name);

/// "cells, cell_size": the keys of a table, or the tables of a scene for "".
std::string key_list(std::string_view table);

} // namespace hybmss
