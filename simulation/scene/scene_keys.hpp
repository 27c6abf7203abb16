#pragma once

/// \file
/// What a row of the table of scene keys is made of: how a value stands in the text, and which member holds it. From a
/// row come reading, checking, writing and the documentation.

#include "hybmss/simulation/world_scene.hpp"
#include "simulation/scene/scene_value.hpp"

#include <array>
#include <concepts>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace hybmss::scene_format {

// -- Formats: how a value is read, how its numbers are checked, how it is written

struct NumberFormat {
    static constexpr std::string_view kType = "number";
    static double read(const Given& given);
    static void check(const Check& check, double value) { check.number(value); }
    static SceneValue write(double value, const Range&) { return {value}; }
};
/// Of any integral type: a key's range is within it.
struct IntegerFormat {
    static constexpr std::string_view kType = "integer";
    static std::int64_t read(const Given& given) { return given.integer(given.value); }
    static void check(const Check& check, std::int64_t value) { check.number(static_cast<double>(value)); }
    static SceneValue write(std::int64_t value, const Range&) { return {value}; }
};
/// Three numbers or three integers.
template <class T>
struct VectorFormat {
    static constexpr std::string_view kType = std::same_as<T, double> ? "3 numbers" : "3 integers";
    static std::array<T, 3> read(const Given& given);
    static void check(const Check& check, const std::array<T, 3>& values) {
        for (const T value : values) {
            check.number(static_cast<double>(value));
        }
    }
    static SceneValue write(const std::array<T, 3>& v, const Range&) {
        return {SceneValue::Array{{v[0]}, {v[1]}, {v[2]}}};
    }
};
template <>
std::array<double, 3> VectorFormat<double>::read(const Given& given);
template <>
std::array<std::int64_t, 3> VectorFormat<std::int64_t>::read(const Given& given);
struct BoxFormat {
    static constexpr std::string_view kType = "2 x 3 numbers";
    static BoxRegion read(const Given& given);
    static void check(const Check& check, const BoxRegion& box);
    static SceneValue write(const BoxRegion& box, const Range& range);
};
struct VectorInTime {
    std::array<double, 3> constant;
    TimeTable table;
};
/// Three numbers, or rows of a time and three numbers.
struct VectorInTimeFormat {
    static constexpr std::string_view kType = "3 numbers, or n x 4";
    static VectorInTime read(const Given& given);
    static void check(const Check& check, const VectorInTime& vector);
    static SceneValue write(const VectorInTime& vector, const Range& range);
};
struct NumberInTime {
    double constant;
    NumberTable table;
};
/// A number, or rows of a time and a number.
struct NumberInTimeFormat {
    static constexpr std::string_view kType = "number, or n x 2";
    static NumberInTime read(const Given& given);
    static void check(const Check& check, const NumberInTime& number);
    static SceneValue write(const NumberInTime& number, const Range& range);
};
/// Rows of numbers, of any length each.
struct RowsFormat {
    static constexpr std::string_view kType = "rows of numbers";
    static std::vector<std::vector<double>> read(const Given& given);
    static void check(const Check& check, const std::vector<std::vector<double>>& rows);
    static SceneValue write(const std::vector<std::vector<double>>& rows, const Range& range);
};
struct FlagFormat {
    static constexpr std::string_view kType = "boolean";
    static bool read(const Given& given) { return given.as<bool>(); }
    static void check(const Check&, bool) {}
    static SceneValue write(bool value, const Range&) { return {value}; }
};
struct TextFormat {
    static constexpr std::string_view kType = "string";
    static std::string read(const Given& given);
    static void check(const Check&, const std::string&) {}
    static SceneValue write(const std::string& value, const Range&) { return {value}; }
};
/// A text of letters, digits, _ and - alone.
struct NameFormat : TextFormat {
    static std::string read(const Given& given);
};
/// A set of axes by their letters: "zx".
struct AxesFormat {
    static constexpr std::string_view kType = "string";
    static AxisSet read(const Given& given);
    static void check(const Check& check, AxisSet axes);
    static SceneValue write(AxisSet axes, const Range&);
};
/// One of the words of the range, as whatever counts from 0: an enumerator, or a boolean.
struct ChoiceFormat {
    static constexpr std::string_view kType = "string";
    static int read(const Given& given);
    static void check(const Check&, auto) {}
    static SceneValue write(auto value, const Range& range) {
        return {std::string(word(range, static_cast<int>(value)))};
    }
    /// "" where there are not so many.
    static std::string_view word(const Range& range, int number);
};
/// Whether, and as what kind of file: a boolean, or a word of the range; true is the first of these.
struct SkinFileFormat : ChoiceFormat {
    static constexpr std::string_view kType = "boolean or string";
    static int read(const Given& given) {
        const bool* const flag = given.value.as<bool>();
        return flag ? static_cast<int>(*flag) : 1 + ChoiceFormat::read(given);
    }
    static SceneValue write(SkinFile file, const Range& range) {
        return file == SkinFile::none || file == SkinFile::vtp ? SceneValue{file == SkinFile::vtp}
                                                               : ChoiceFormat::write(static_cast<int>(file) - 1, range);
    }
};
/// One axis by its letter.
struct AxisFormat : ChoiceFormat {
    static void check(const Check& check, int axis);
};
/// Which nodes: a face of the bounding box by its name, or a table with one shape.
struct RegionFormat {
    static constexpr std::string_view kType = "region";
    static Region read(const Given& given);
    static void check(const Check& check, const Region& region);
    static SceneValue write(const Region& region, const Range&);
};
struct RegionListFormat {
    static constexpr std::string_view kType = "regions";
    static std::vector<Region> read(const Given& given);
    static void check(const Check& check, const std::vector<Region>& regions);
    static SceneValue write(const std::vector<Region>& regions, const Range& range);
};

/// The format that follows from a member's type.
template <class T>
auto format_of(const T&) {
    if constexpr (std::same_as<T, bool>) {
        return FlagFormat{};
    } else if constexpr (std::integral<T>) {
        return IntegerFormat{};
    } else {
        static_assert(std::same_as<T, double>, "say which format it has");
        return NumberFormat{};
    }
}
inline auto format_of(const std::string&) {
    return TextFormat{};
}
template <class T>
auto format_of(const std::array<T, 3>&) {
    return VectorFormat<T>{};
}
inline auto format_of(const BoxRegion&) {
    return BoxFormat{};
}
inline RegionFormat format_of(const Region&) {
    return {};
}
template <class T>
auto format_of(const std::optional<T>&) {
    return format_of(T{});
}

// -- Members: what of its owner a key sets. `get` gives nothing where the key would not be given

template <class Class, class T>
Class class_of(T Class::*);

/// A member, or a member of a member; with no path a region as a whole.
template <auto... path>
struct Member;
template <>
struct Member<> {
    using Owner = Region;
    static const Region& of(const Region& owner) { return owner; }
    static void set(Region& owner, const Region& value) { owner = value; }
};
template <auto first, auto... rest>
struct Member<first, rest...> {
    using Owner = decltype(class_of(first));
    using Stored = std::remove_cvref_t<decltype(((std::declval<Owner&>().*first).*....*rest))>;

    static const Stored& of(const Owner& owner) { return ((owner.*first).*....*rest); }
    static auto get(const Owner& owner) { return optional(of(owner)); }
    template <class T>
    static void set(Owner& owner, T value) {
        if constexpr (std::is_enum_v<Stored> || std::integral<Stored>) {
            ((owner.*first).*....*rest) = static_cast<Stored>(value);
        } else {
            ((owner.*first).*....*rest) = std::move(value);
        }
    }

private:
    template <class T>
    static std::optional<T> optional(const std::optional<T>& value) {
        return value;
    }
    template <class T>
    static std::optional<T> optional(const T& value) {
        return value;
    }
};
/// A member whose 0, or empty text, means that the key is not given.
template <auto... path>
struct Unless0 : Member<path...> {
    using typename Member<path...>::Owner, typename Member<path...>::Stored;
    static std::optional<Stored> get(const Owner& owner) {
        const Stored& value = Member<path...>::of(owner);
        return value == Stored{} ? std::nullopt : std::optional<Stored>(value);
    }
};
/// One of the types that a variant may hold: a member, or the owner itself, a region.
template <class T, auto... path>
struct Alternative : Member<path...> {
    static std::optional<T> get(const typename Member<path...>::Owner& owner) {
        const T* held = std::get_if<T>(&Member<path...>::of(owner));
        return held ? std::optional<T>(*held) : std::nullopt;
    }
};
/// A value, a vector by default, and the table that may stand in its place.
template <auto constant, auto table, class Value = VectorInTime>
struct InTime {
    using Owner = decltype(class_of(constant));
    static std::optional<Value> get(const Owner& owner) { return Value{owner.*constant, owner.*table}; }
    static void set(Owner& owner, Value value) {
        owner.*constant = value.constant;
        owner.*table = std::move(value.table);
    }
};

// -- Rows and tables

/// How a key's value gets into its owner and out of it.
template <class Owner>
struct Field {
    std::string_view type;
    void (*read)(const Given&, Owner&);
    void (*check)(const Check&, const Owner&);
    void (*write)(const Owner&, std::string_view key, const Range&, SceneValue::Table&);
};

template <class Format, class Access>
constexpr Field<typename Access::Owner> field = {
    Format::kType, [](const Given& given, typename Access::Owner& owner) { Access::set(owner, Format::read(given)); },
    [](const Check& check, const typename Access::Owner& owner) {
        if (const auto value = Access::get(owner)) {
            Format::check(check, *value);
        }
    },
    [](const typename Access::Owner& owner, std::string_view key, const Range& range, SceneValue::Table& table) {
        if (const auto value = Access::get(owner)) {
            table.push_back({std::string(key), Format::write(*value, range)});
        }
    }};
template <auto... path>
constexpr auto member = field<decltype(format_of(std::declval<typename Member<path...>::Stored>())), Member<path...>>;
template <class Format, auto... path>
constexpr auto member_as = field<Format, Member<path...>>;

template <class Owner>
struct Key {
    std::string_view name, unit;
    Range range;
    std::string_view default_value; ///< "required"; "none"; or what holds where the key is not given
    std::string_view meaning;
    Field<Owner> field;
};

/// The keys of a struct; they serve every table and every key whose value is such a struct.
template <class Owner>
struct KeyTable {
    std::string_view name, meaning;
    std::span<const Key<Owner>> keys;
    /// Which keys go together in a scene's text, and what follows from those that are not given.
    void (*complete)(const GivenTable&, Owner&) = nullptr;
    /// What values must be to each other.
    void (*relate)(const TableCheck&, const Owner&) = nullptr;

    std::vector<SceneKey> described() const {
        std::vector<SceneKey> all;
        for (const Key<Owner>& key : keys) {
            all.push_back(
                {name, key.name, key.field.type, key.unit, key.range.allowed, key.default_value, key.meaning});
        }
        return all;
    }
    Owner read(Scene& scene, const SceneValue& value, const std::string& path) const {
        const GivenTable given = {{scene, path, described(), true}, scene, value};
        given.note_keys();
        Owner owner;
        for (const Key<Owner>& key : keys) {
            if (const SceneValue* its = given.find(key.name)) {
                key.field.read({given.at(key.name, key.range), scene, *its}, owner);
            }
        }
        if (complete) {
            complete(given, owner);
        }
        if (relate) {
            relate(given, owner);
        }
        return owner;
    }
    void check(const TableCheck& table, const Owner& owner) const {
        for (const Key<Owner>& key : keys) {
            key.field.check(table.at(key.name, key.range), owner);
        }
        if (relate) {
            relate(table, owner);
        }
    }
    SceneValue write(const Owner& owner) const {
        SceneValue::Table written;
        for (const Key<Owner>& key : keys) {
            key.field.write(owner, key.name, key.range, written);
        }
        return {std::move(written)};
    }
};

/// A key whose value is a table with the keys of another struct.
template <const auto& table>
struct TableFormat {
    static constexpr std::string_view kType = "table";
    static auto read(const Given& given) {
        given.template as<SceneValue::Table>();
        return table.read(given.source, given.value, given.path);
    }
    static void check(const Check& check, const auto& owner) {
        table.check({check.scene, check.path, table.described(), false}, owner);
    }
    static SceneValue write(const auto& owner, const Range&) { return table.write(owner); }
};

/// A table of the format as a whole. Without `read` it is the value of a key.
struct SceneTable {
    std::string_view name, meaning;
    bool required, repeated; ///< [[name]], any number of times
    std::vector<SceneKey> (*keys)();
    void (*read)(Scene&, const SceneValue&, const std::string& path) = nullptr; ///< one of them
    void (*check)(const Scene&) = nullptr;
    SceneValue::Array (*write)(const Scene&) = nullptr; ///< all of them
};

/// All tables, in the order in which they are read, written and documented.
std::span<const SceneTable> scene_tables();
/// Those that scenes of several bodies have besides; without `read`.
std::span<const SceneTable> world_tables();

bool is_array_of_tables(const SceneValue& value);
/// Whether the scene has [[body]] tables.
bool has_several_bodies(const SceneValue::Table& root);

/// Refuses a table of a scene that is none of scene_tables() or `more`, or that is not of its kind.
void require_known(Scene& scene, const SceneValue::Member& member, std::span<const SceneTable> more = {});

/// Reads all tables of a scene, and the files that its body names.
void read_scene(Scene& scene, const SceneValue::Table& root);

/// A scene's text as values.
struct SceneText {
    SceneValue::Table root;
    std::string canonical; ///< SceneSource::canonical
};
/// The tables of contacts and attachments, each with its name.
std::vector<std::pair<std::string, SceneValue>> world_values(const WorldScene& world);
/// Of a scene with [[body]] tables.
WorldScene read_world(const SceneText& text, const std::string& filename);

} // namespace hybmss::scene_format
