#pragma once

/// \file
/// Meshes of one body, coarse to fine.

#include "hybmss/simulation/scene.hpp"

#include <array>
#include <cstdint>

namespace hybmss {

/// The smallest whole numbers in the ratio of a box's edges, each at most 1000; zeros where there are none.
std::array<std::int64_t, 3> whole_ratio(const std::array<double, 3>& size);

/// A box in `multiple` times so many cells, or a body of labels with each cell cut in `multiple`^3.
class MeshFamily {
public:
    /// Throws SceneError where no cubes fill a box of the given size.
    explicit MeshFamily(const Scene& scene);

    /// Whether the scene leaves the mesh free.
    bool is_free() const { return free_; }
    /// The scene's own mesh, where it has one.
    std::int64_t own_multiple() const { return own_; }
    /// The first with at least so many cells along the shortest edge.
    std::int64_t multiple_of(std::int64_t cells_across) const;
    std::array<std::int64_t, 3> cells(std::int64_t multiple) const;
    double cell_size(std::int64_t multiple) const { return unit_edge_ / static_cast<double>(multiple); }
    /// The body on that mesh; its labels too.
    SceneBody body(std::int64_t multiple) const;

private:
    SceneBody body_;
    std::array<std::int64_t, 3> unit_ = {1, 1, 1}; ///< cells at multiple 1
    double unit_edge_ = 1;                         ///< m
    std::int64_t own_ = 1;
    bool free_ = false;
};

} // namespace hybmss
