#pragma once

/// \file
/// The file of a checkpoint: named sections of bytes, and a digest of them all.

#include <cstring>
#include <filesystem>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace hybmss {

/// Sections by name. Numbers keep every bit.
class CheckpointSections {
public:
    void put(const std::string& name, std::string bytes) { sections_[name] = std::move(bytes); }
    template <class T>
    void put(const std::string& name, std::span<const T> values) {
        static_assert(std::is_trivially_copyable_v<T>);
        put(name, std::string(reinterpret_cast<const char*>(values.data()), values.size_bytes()));
    }
    template <class T>
    void put(const std::string& name, const std::vector<T>& values) {
        put(name, std::span<const T>(values));
    }

    bool has(const std::string& name) const { return sections_.contains(name); }
    /// Throws std::runtime_error where there is no such section.
    const std::string& text(const std::string& name) const;
    /// Throws std::runtime_error where there is no such section, or one of another length.
    template <class T>
    std::vector<T> values(const std::string& name) const {
        const std::string& bytes = text(name);
        if (bytes.size() % sizeof(T) != 0) {
            throw std::runtime_error("its section \"" + name + "\" has a wrong length");
        }
        std::vector<T> all(bytes.size() / sizeof(T));
        if (!all.empty()) {
            std::memcpy(all.data(), bytes.data(), bytes.size());
        }
        return all;
    }
    template <class T>
    std::vector<T> values(const std::string& name, std::size_t count) const {
        std::vector<T> all = values<T>(name);
        if (all.size() != count) {
            throw std::runtime_error("its section \"" + name + "\" has " + std::to_string(all.size()) +
                                     " values, not the " + std::to_string(count) + " of this body");
        }
        return all;
    }

    const std::map<std::string, std::string>& all() const { return sections_; }

private:
    std::map<std::string, std::string> sections_;
};

/// Under a temporary name first, then renamed. Throws std::runtime_error where it cannot be written.
void write_checkpoint_file(const std::filesystem::path& path, const CheckpointSections& sections);

/// Throws std::runtime_error, one line without the path, for a file that is missing, foreign, cut short or damaged.
CheckpointSections read_checkpoint_file(const std::filesystem::path& path);

} // namespace hybmss
