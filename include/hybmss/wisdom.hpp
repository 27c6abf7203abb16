#pragma once

/// \file
/// What measuring found, to be used again: which candidate is fastest for a class of bodies on this machine.

#include "hybmss/export.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace hybmss {

/// Why wisdom was refused, in one line: `FILE:LINE: reason`. Also thrown where a file cannot be read or written.
class HYBMSS_EXPORT WisdomError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A set of entries, one for each class of bodies that was measured. Name it in PlanOptions::wisdom.
///
/// May be used by several threads at the same time. The text is described in docs/tuning.md.
class HYBMSS_EXPORT Wisdom {
public:
    Wisdom();
    Wisdom(const Wisdom&);
    Wisdom(Wisdom&&) noexcept;
    Wisdom& operator=(Wisdom) noexcept;
    ~Wisdom();

    /// Adds a file's entries; where both have one, the file's replaces it. All or nothing: throws WisdomError, and
    /// leaves the object as it was, where the file is damaged, was written by another version of the library or with
    /// other layouts, or on a machine of another CPU model or with other instruction sets.
    void import_file(const std::filesystem::path& path);
    /// The same of a text; `name` stands for the file in messages.
    void import_text(std::string_view text, const std::string& name);

    /// Writes all entries under a temporary name in the same directory, then renames. Throws WisdomError.
    void export_file(const std::filesystem::path& path) const;
    std::string export_text() const;

    /// Adds the other's entries; where both have one, the other's replaces it.
    void merge(const Wisdom& other);

    std::size_t entries() const;

private:
    friend struct WisdomStore;
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

} // namespace hybmss
