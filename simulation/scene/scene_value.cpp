#include "simulation/scene/scene_keys.hpp"

#include "layouts/messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace hybmss::scene_format {
void Check::number(double value) const {
    if (!range.holds(value)) { // as of what is not finite
        refuse(value, range.allowed);
    }
}

void Check::refuse(double value, std::string_view allowed) const {
    const std::string number = as_written ? "" : printed("%g is not allowed: ", value);
    throw scene_error(scene, path, (number + "it must be ").append(allowed));
}

const SceneValue::Array& Given::array(const SceneValue& item, std::size_t size) const {
    const auto* items = item.as<SceneValue::Array>();
    if (!items || items->size() != size) {
        refuse();
    }
    return *items;
}

double Given::real(const SceneValue& item) const {
    const auto* real = item.as<double>();
    if (!real && !item.as<std::int64_t>()) {
        refuse();
    }
    return real ? *real : static_cast<double>(*item.as<std::int64_t>());
}

double Given::number(const SceneValue& item) const {
    const double number = real(item);
    Check::number(number);
    return number;
}

std::int64_t Given::integer(const SceneValue& item) const {
    if (!item.as<std::int64_t>()) {
        refuse();
    }
    number(item);
    return *item.as<std::int64_t>();
}

std::array<double, 3> Given::vector(const SceneValue& item) const {
    const SceneValue::Array& items = array(item, 3);
    return {number(items[0]), number(items[1]), number(items[2])};
}

std::string_view TableCheck::allowed(std::string_view key) const {
    return std::find_if(keys.begin(), keys.end(), [&](const SceneKey& one) { return one.name == key; })->allowed;
}

void GivenTable::note_keys() const {
    for (const SceneValue::Member& member : *value.as<SceneValue::Table>()) {
        SceneSource::Entry& entry = source.source.entries[at(member.name, {}).path] = member.value.place;
        if (std::none_of(keys.begin(), keys.end(), [&](const SceneKey& key) { return key.name == member.name; })) {
            entry.line = member.place.line;
            entry.column = member.place.column;
            refuse(member.name, "unknown key; allowed are " + name_list(keys));
        }
    }
    for (const SceneKey& key : keys) {
        if (key.default_value == "required" && !has(key.name)) {
            missing(key.name);
        }
    }
}

const SceneValue* GivenTable::find(std::string_view key) const {
    for (const SceneValue::Member& member : *value.as<SceneValue::Table>()) {
        if (member.name == key) {
            return &member.value;
        }
    }
    return nullptr;
}

void GivenTable::missing(std::string_view key, std::string_view wanted) const {
    source.source.entries[at(key, {}).path] = {value.place.line, value.place.column, {}};
    std::string reason = "missing; it ";
    refuse(key, wanted.empty() ? reason.append("must be ").append(allowed(key)) : reason.append(wanted));
}

// -- Formats

double NumberFormat::read(const Given& given) {
    if (!given.value.as<double>() && !given.value.as<std::int64_t>()) {
        given.Check::refuse(0, std::string("a number ").append(given.range.allowed));
    }
    return given.number(given.value);
}

template <>
std::array<double, 3> VectorFormat<double>::read(const Given& given) {
    return given.vector(given.value);
}

template <>
std::array<std::int64_t, 3> VectorFormat<std::int64_t>::read(const Given& given) {
    const SceneValue::Array& items = given.array(given.value, 3);
    return {given.integer(items[0]), given.integer(items[1]), given.integer(items[2])};
}

BoxRegion BoxFormat::read(const Given& given) {
    const SceneValue::Array& corners = given.array(given.value, 2);
    const BoxRegion box{given.vector(corners[0]), given.vector(corners[1])};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (box.low[axis] > box.high[axis]) {
            given.refuse();
        }
    }
    return box;
}

void BoxFormat::check(const Check& check, const BoxRegion& box) {
    VectorFormat<double>::check(check, box.low);
    VectorFormat<double>::check(check, box.high);
}

SceneValue BoxFormat::write(const BoxRegion& box, const Range& range) {
    return {
        SceneValue::Array{VectorFormat<double>::write(box.low, range), VectorFormat<double>::write(box.high, range)}};
}

namespace {

/// Whether a value is rows rather than a constant.
bool has_rows(const SceneValue& value) {
    const auto* items = value.as<SceneValue::Array>();
    return items && !items->empty() && items->front().as<SceneValue::Array>();
}

template <std::size_t N>
void check_rows(const Check& check, const std::vector<std::array<double, N>>& table) {
    for (std::size_t r = 0; r < table.size(); ++r) {
        const double time = table[r][0];
        if (!(std::abs(time) <= 1e18) || (r > 0 && !(time > table[r - 1][0]))) {
            check.refuse(time, check.range.allowed);
        }
        for (std::size_t value = 1; value < N; ++value) {
            check.number(table[r][value]);
        }
    }
}

template <std::size_t N>
void read_rows(const Given& given, std::vector<std::array<double, N>>& table) {
    for (const SceneValue& item : given.as<SceneValue::Array>()) {
        const SceneValue::Array& row = given.array(item, N);
        std::array<double, N>& numbers = table.emplace_back();
        std::transform(row.begin(), row.end(), numbers.begin(), [&](const SceneValue& v) { return given.real(v); });
    }
    check_rows(given, table);
}

template <class Row>
SceneValue written_rows(const std::vector<Row>& table) {
    SceneValue::Array rows;
    for (const auto& row : table) {
        SceneValue::Array numbers;
        for (const double number : row) {
            numbers.push_back({number});
        }
        rows.push_back({std::move(numbers)});
    }
    return {std::move(rows)};
}

} // namespace

VectorInTime VectorInTimeFormat::read(const Given& given) {
    VectorInTime vector{};
    if (has_rows(given.value)) {
        read_rows(given, vector.table);
    } else {
        vector.constant = given.vector(given.value);
    }
    return vector;
}

void VectorInTimeFormat::check(const Check& check, const VectorInTime& vector) {
    if (vector.table.empty()) {
        VectorFormat<double>::check(check, vector.constant);
    }
    check_rows(check, vector.table);
}

SceneValue VectorInTimeFormat::write(const VectorInTime& vector, const Range& range) {
    return vector.table.empty() ? VectorFormat<double>::write(vector.constant, range) : written_rows(vector.table);
}

NumberInTime NumberInTimeFormat::read(const Given& given) {
    NumberInTime number{};
    if (has_rows(given.value)) {
        read_rows(given, number.table);
    } else {
        number.constant = given.number(given.value);
    }
    return number;
}

void NumberInTimeFormat::check(const Check& check, const NumberInTime& number) {
    check.number(number.constant);
    check_rows(check, number.table);
}

SceneValue NumberInTimeFormat::write(const NumberInTime& number, const Range&) {
    return number.table.empty() ? SceneValue{number.constant} : written_rows(number.table);
}

std::vector<std::vector<double>> RowsFormat::read(const Given& given) {
    std::vector<std::vector<double>> rows;
    for (const SceneValue& item : given.as<SceneValue::Array>()) {
        const auto* const row = item.as<SceneValue::Array>();
        if (!row) {
            given.refuse();
        }
        std::vector<double>& numbers = rows.emplace_back();
        std::transform(row->begin(), row->end(), std::back_inserter(numbers),
                       [&](const SceneValue& v) { return given.number(v); });
    }
    return rows;
}

void RowsFormat::check(const Check& check, const std::vector<std::vector<double>>& rows) {
    for (const std::vector<double>& row : rows) {
        for (const double number : row) {
            check.number(number);
        }
    }
}

SceneValue RowsFormat::write(const std::vector<std::vector<double>>& rows, const Range&) {
    return written_rows(rows);
}

std::string TextFormat::read(const Given& given) {
    const std::string& text = given.as<std::string>();
    if (text.empty()) {
        given.refuse();
    }
    return text;
}

std::string NameFormat::read(const Given& given) {
    std::string name = TextFormat::read(given);
    if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") !=
        std::string::npos) {
        given.refuse();
    }
    return name;
}

AxisSet AxesFormat::read(const Given& given) {
    AxisSet set = 0;
    const std::string letters = TextFormat::read(given);
    for (char c : letters) {
        if (c < 'x' || c > 'z') {
            given.refuse();
        }
        set = static_cast<AxisSet>(set | 1u << (c - 'x'));
    }
    // A repeated letter would leave fewer bits than letters.
    if (static_cast<std::size_t>(std::popcount(set)) != letters.size()) {
        given.refuse();
    }
    return set;
}

void AxesFormat::check(const Check& check, AxisSet axes) {
    if (axes < 1 || axes > kAllAxes) {
        check.refuse(axes, "1 to 7: a bit for each of x, y and z");
    }
}

SceneValue AxesFormat::write(AxisSet axes, const Range&) {
    std::string letters;
    for (int axis = 0; axis < 3; ++axis) {
        letters.append((axes >> axis & 1) != 0 ? 1 : 0, static_cast<char>('x' + axis));
    }
    return {letters};
}

int ChoiceFormat::read(const Given& given) {
    const std::string text = TextFormat::read(given);
    int number = 0;
    for (std::string_view known = word(given.range, 0); known != text; known = word(given.range, ++number)) {
        if (known.empty()) {
            given.refuse();
        }
    }
    return number;
}

std::string_view ChoiceFormat::word(const Range& range, int number) {
    std::string_view rest = range.allowed;
    for (std::size_t quote = rest.find('"'); quote != std::string_view::npos; quote = rest.find('"'), --number) {
        rest.remove_prefix(quote + 1);
        const std::size_t end = rest.find('"');
        if (number == 0) {
            return rest.substr(0, end);
        }
        rest.remove_prefix(end + 1);
    }
    return {};
}

void AxisFormat::check(const Check& check, int axis) {
    if (axis < 0 || axis > 2) {
        check.refuse(axis, "0, 1 or 2: x, y or z");
    }
}

} // namespace hybmss::scene_format
