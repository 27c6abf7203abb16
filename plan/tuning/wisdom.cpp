#include "hybmss/wisdom.hpp"

#include "plan/tuning/wisdom_store.hpp"
#include "plan/tuning/wisdom_text.hpp"

#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

namespace hybmss {
namespace {

std::string cause(int error) {
    return std::generic_category().message(error);
}

} // namespace

Wisdom::Wisdom() : implementation_(std::make_unique<Implementation>()) {}
Wisdom::Wisdom(const Wisdom& other) : Wisdom() {
    merge(other);
}
Wisdom::Wisdom(Wisdom&&) noexcept = default;
Wisdom& Wisdom::operator=(Wisdom other) noexcept {
    implementation_.swap(other.implementation_);
    return *this;
}
Wisdom::~Wisdom() = default;

void Wisdom::merge(const Wisdom& other) {
    if (&other == this) {
        return;
    }
    WisdomEntries theirs;
    {
        const std::lock_guard lock(other.implementation_->mutex);
        theirs = other.implementation_->entries;
    }
    const std::lock_guard lock(implementation_->mutex);
    // What this one alone has is what stays in `entries` after the swap.
    theirs.merge(implementation_->entries);
    implementation_->entries.swap(theirs);
}

std::size_t Wisdom::entries() const {
    const std::lock_guard lock(implementation_->mutex);
    return implementation_->entries.size();
}

void Wisdom::import_text(std::string_view text, const std::string& name) {
    Wisdom imported;
    imported.implementation_->entries = parse_wisdom(text, name);
    merge(imported);
}

void Wisdom::import_file(const std::filesystem::path& path) {
    if (std::error_code ignored; std::filesystem::is_directory(path, ignored)) {
        throw WisdomError(path.string() + ": cannot be read: it is a directory");
    }
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw WisdomError(path.string() + ": cannot be read: " + cause(errno));
    }
    std::ostringstream text;
    text << file.rdbuf();
    if (file.bad()) {
        throw WisdomError(path.string() + ": cannot be read: " + cause(errno));
    }
    import_text(text.str(), path.string());
}

std::string Wisdom::export_text() const {
    const std::lock_guard lock(implementation_->mutex);
    return wisdom_text(implementation_->entries);
}

void Wisdom::export_file(const std::filesystem::path& path) const {
    const std::string text = export_text();
    // One name a process: two that tune at the same time must not write into one file.
    std::filesystem::path partial = path;
    partial += ".partial-" + std::to_string(getpid());
    const auto fail = [&](int error) {
        std::error_code ignored;
        std::filesystem::remove(partial, ignored);
        throw WisdomError(path.string() + ": cannot be written: " + cause(error));
    };
    errno = 0;
    std::ofstream file(partial, std::ios::binary | std::ios::trunc);
    file << text;
    file.close();
    if (!file) {
        fail(errno);
    }
    std::error_code error;
    std::filesystem::rename(partial, path, error);
    if (error) {
        fail(error.value());
    }
}

std::optional<WisdomEntry> WisdomStore::find(const Wisdom& wisdom, const std::string& key) {
    const std::lock_guard lock(wisdom.implementation_->mutex);
    const auto found = wisdom.implementation_->entries.find(key);
    return found == wisdom.implementation_->entries.end() ? std::nullopt : std::optional(found->second);
}

void WisdomStore::put(Wisdom& wisdom, const std::string& key, WisdomEntry entry) {
    const std::lock_guard lock(wisdom.implementation_->mutex);
    wisdom.implementation_->entries.insert_or_assign(key, std::move(entry));
}

} // namespace hybmss
