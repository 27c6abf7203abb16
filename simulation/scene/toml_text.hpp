#pragma once

/// \file
/// The scene's text beside its parsed tree, so that messages can quote what was written.

#include "hybmss/simulation/scene.hpp"

#include <string>
#include <string_view>
#include <vector>

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

/// The text by lines.
class TomlText {
public:
    explicit TomlText(std::string_view text);

    /// Position and text of a value; long values and those of several lines are cut short.
    SceneSource::Entry quote(const toml::source_region& region) const;

private:
    std::vector<std::string_view> lines_;
};

inline TomlText::TomlText(std::string_view text) {
    while (!text.empty()) {
        const std::size_t end = text.find('\n');
        lines_.push_back(text.substr(0, end));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
}

inline SceneSource::Entry TomlText::quote(const toml::source_region& region) const {
    constexpr std::size_t kLongest = 60;
    SceneSource::Entry entry{region.begin.line, region.begin.column, {}};
    if (region.begin.line < 1 || region.begin.line > lines_.size()) {
        return entry;
    }
    // Columns count characters, not bytes: bytes 10xxxxxx continue a UTF-8 character.
    const std::string_view line = lines_[region.begin.line - 1];
    const bool one_line = region.end.line == region.begin.line;
    unsigned column = 0;
    for (char c : line) {
        column += (static_cast<unsigned char>(c) & 0xC0u) != 0x80u;
        if (column >= region.begin.column && (!one_line || column < region.end.column) && c != '\r') {
            entry.value += c;
        }
    }
    if (!one_line || entry.value.size() > kLongest) {
        entry.value.resize(std::min(entry.value.size(), kLongest));
        entry.value += " ...";
    }
    return entry;
}

} // namespace hybmss
