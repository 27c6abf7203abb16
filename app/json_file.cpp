#include "app/json_file.hpp"

#include <stdexcept>

namespace hybmss {

std::unique_ptr<AtomicFile> open_json_file(const std::string& path) {
    if (path.empty()) {
        return nullptr;
    }
    try {
        return std::make_unique<AtomicFile>(path);
    } catch (const std::runtime_error& error) {
        throw std::invalid_argument(std::string("--json ") + error.what());
    }
}

} // namespace hybmss
