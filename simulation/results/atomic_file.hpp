#pragma once

/// \file
/// Files that are there whole or not at all.

#include <filesystem>
#include <fstream>
#include <ostream>
#include <string>

namespace hybmss {

/// Writes to `PATH.partial`; commit() renames it to PATH. Without a commit the partial file is removed. Where PATH is a
/// symbolic link, that is done to the file it names: the link stays. A pipe or a character device (a terminal, the
/// /dev/stdout of a pipeline) cannot be replaced and is written directly. All else that is no regular file is refused,
/// and so is a file that another process is writing. Every failure throws std::runtime_error that names the file and
/// the cause.
class AtomicFile {
public:
    explicit AtomicFile(std::filesystem::path path);
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile();

    std::ostream& stream() { return stream_; }
    void commit();

private:
    /// Keeps why a write failed: the streams forget it, and it may be long before commit() asks.
    class Buffer : public std::filebuf {
    public:
        int error() const { return error_; }

    protected:
        int_type overflow(int_type c) override;
        std::streamsize xsputn(const char* text, std::streamsize count) override;

    private:
        int error_ = 0;
    };

    void lock_partial();
    void release();
    [[noreturn]] void fail(int error) const;

    std::filesystem::path path_;    ///< as it was given
    std::filesystem::path target_;  ///< without links
    std::filesystem::path partial_; ///< empty where there is none (any more)
    int lock_ = -1;                 ///< descriptor of the partial file
    Buffer buffer_;
    std::ostream stream_{&buffer_};
};

/// The whole of a small file at once.
void write_file(const std::filesystem::path& path, const std::string& content);

/// Removes the file that an AtomicFile of this path would replace, if it is there.
void remove_file(const std::filesystem::path& path);

} // namespace hybmss
