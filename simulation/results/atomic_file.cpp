#include "simulation/results/atomic_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace hybmss {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
    throw std::runtime_error(path.string() + ": cannot be written: " + why);
}

/// The file at the end of all links, which need not exist.
std::filesystem::path without_links(const std::filesystem::path& path) {
    std::filesystem::path target = path;
    std::error_code error;
    for (int links = 0; std::filesystem::is_symlink(target, error); ++links) {
        const std::filesystem::path next = std::filesystem::read_symlink(target, error);
        if (error || links == 40) { // as many as Linux follows
            refuse(path, std::generic_category().message(error ? error.value() : ELOOP));
        }
        target = target.parent_path() / next;
        // What /dev/stdout or /dev/fd/3 stands for is open already: a new file in its place would part from it.
        if (target.string().starts_with("/proc/") && std::filesystem::is_regular_file(target, error)) {
            refuse(path, "it is a file that is open already; give the file's own path");
        }
    }
    return target;
}

/// Whether a path is written directly.
bool is_direct(const std::filesystem::path& path) {
    using std::filesystem::file_type;
    std::error_code error; // a path that cannot be reached is told of when it is opened
    switch (std::filesystem::status(path, error).type()) {
    case file_type::fifo:
    case file_type::character:
        return true;
    case file_type::directory:
        refuse(path, "it is a directory");
    case file_type::block:
    case file_type::socket:
        refuse(path, "it is a block device or a socket; a file or a pipe is needed");
    default:
        return false;
    }
}

} // namespace

AtomicFile::Buffer::int_type AtomicFile::Buffer::overflow(int_type c) {
    errno = 0;
    const int_type result = std::filebuf::overflow(c);
    if (error_ == 0 && traits_type::eq_int_type(result, traits_type::eof())) {
        error_ = errno;
    }
    return result;
}

std::streamsize AtomicFile::Buffer::xsputn(const char* text, std::streamsize count) {
    errno = 0;
    const std::streamsize written = std::filebuf::xsputn(text, count);
    if (error_ == 0 && written != count) {
        error_ = errno;
    }
    return written;
}

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)) {
    const bool direct = is_direct(path_);
    target_ = direct ? path_ : without_links(path_);
    if (!direct) {
        partial_ = target_;
        partial_ += ".partial";
        lock_partial();
    }
    errno = 0;
    if (!buffer_.open(direct ? target_ : partial_, std::ios::out | std::ios::binary | std::ios::trunc)) {
        const int error = errno;
        release();
        fail(error);
    }
}

AtomicFile::~AtomicFile() {
    buffer_.close();
    release();
}

void AtomicFile::fail(int error) const {
    refuse(path_, std::generic_category().message(error != 0 ? error : EIO));
}

/// The lock goes with the process, so that what a killed one left is no hindrance.
void AtomicFile::lock_partial() {
    const auto give_up = [this](const std::string& why) {
        if (lock_ >= 0) {
            close(lock_);
        }
        refuse(path_, why);
    };
    for (;;) {
        lock_ = open(partial_.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
        if (lock_ < 0) {
            give_up(std::generic_category().message(errno));
        }
        struct stat held {
        }, named{};
        if (fstat(lock_, &held) != 0 || !S_ISREG(held.st_mode)) {
            give_up(partial_.filename().string() + " is no regular file");
        }
        // Some file systems have no locks.
        if (flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            give_up("it is being written already, by another process or under another option");
        }
        if (stat(partial_.c_str(), &named) == 0 && named.st_dev == held.st_dev && named.st_ino == held.st_ino) {
            return;
        }
        close(lock_); // the other process was just done with it
    }
}

void AtomicFile::release() {
    if (!partial_.empty()) {
        std::error_code ignored;
        std::filesystem::remove(partial_, ignored);
        partial_.clear();
    }
    if (lock_ >= 0) {
        close(lock_);
        lock_ = -1;
    }
}

void AtomicFile::commit() {
    errno = 0;
    const bool closed = buffer_.close();
    if (!closed || !stream_) {
        fail(buffer_.error() != 0 ? buffer_.error() : errno);
    }
    if (!partial_.empty()) {
        std::error_code error;
        std::filesystem::rename(partial_, target_, error);
        if (error) {
            fail(error.value());
        }
        partial_.clear();
    }
    release();
}

void write_file(const std::filesystem::path& path, const std::string& content) {
    AtomicFile file(path);
    file.stream() << content;
    file.commit();
}

void remove_file(const std::filesystem::path& path) {
    if (!is_direct(path)) {
        std::error_code error;
        std::filesystem::remove(without_links(path), error);
        if (error) {
            throw std::runtime_error(path.string() + ": cannot be removed: " + error.message());
        }
    }
}

} // namespace hybmss
