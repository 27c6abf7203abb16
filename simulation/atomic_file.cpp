#include "simulation/atomic_file.hpp"

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace hybmss {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
    throw std::runtime_error(path.string() + ": cannot be written: " + std::generic_category().message(error));
}

} // namespace

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)), partial_(path_) {
    partial_ += ".partial";
    errno = 0;
    stream_.open(partial_, std::ios::binary | std::ios::trunc);
    if (!stream_) {
        fail(path_, errno);
    }
}

AtomicFile::~AtomicFile() {
    if (!partial_.empty()) {
        stream_.close();
        std::error_code ignored;
        std::filesystem::remove(partial_, ignored);
    }
}

void AtomicFile::commit() {
    errno = 0;
    stream_.close();
    if (!stream_) {
        fail(path_, errno);
    }
    std::error_code error;
    std::filesystem::rename(partial_, path_, error);
    if (error) {
        fail(path_, error.value());
    }
    partial_.clear();
}

void write_file(const std::filesystem::path& path, const std::string& content) {
    AtomicFile file(path);
    file.stream() << content;
    file.commit();
}

} // namespace hybmss
