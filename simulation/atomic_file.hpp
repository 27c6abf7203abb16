#pragma once

/// \file
/// Files that are there whole or not at all.

#include <filesystem>
#include <fstream>
#include <string>

namespace hybmss {

/// Writes to `PATH.partial`; commit() renames it to PATH. Without a commit the partial file is removed.
/// Every failure throws std::runtime_error that names the file and the cause.
class AtomicFile {
public:
    explicit AtomicFile(std::filesystem::path path);
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile();

    std::ofstream& stream() { return stream_; }
    void commit();

private:
    std::filesystem::path path_, partial_;
    std::ofstream stream_;
};

/// The whole of a small file at once.
void write_file(const std::filesystem::path& path, const std::string& content);

} // namespace hybmss
