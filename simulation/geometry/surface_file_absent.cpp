#include "simulation/geometry/triangle_surface.hpp"

#include <stdexcept>

namespace hybmss {

TriangleSurface read_surface(const std::filesystem::path&) {
    throw std::runtime_error("this build of hybmss reads no surfaces; it was made without assimp (libassimp-dev)");
}

} // namespace hybmss
