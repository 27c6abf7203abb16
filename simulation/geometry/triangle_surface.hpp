#pragma once

/// \file
/// A body given by its surface: triangles -> cells.

#include "hybmss/simulation/scene.hpp"
#include "hybmss/skin.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace hybmss {

using TriangleSurface = TriangleMesh;

/// Reads an STL or OBJ file; all its objects together. Throws std::runtime_error that says what is wrong, without the
/// file's name.
TriangleSurface read_surface(const std::filesystem::path& path);

/// Makes one vertex of those at the very same place (STL repeats them) and drops triangles that are none any more.
void weld(TriangleSurface& surface);

enum class Orientation { consistent, mixed };

/// Whether all triangles of the welded surface turn their same side outwards. Throws std::runtime_error where it is not
/// closed: where an edge belongs to an odd number of triangles.
Orientation require_closed(const TriangleSurface& surface);

/// The cells whose centre lies inside, as a body with label 1 there; its grid is the bounding box in whole cells,
/// centred on it. Inside is where a ray's crossings wind around (consistent), or are odd in number (mixed). Of the body
/// that is returned `cells`, `cell_size`, `origin` and `labels` are set. Throws std::runtime_error where the grid has
/// more nodes than can be numbered or than memory holds.
SceneBody voxelised(const TriangleSurface& surface, Orientation orientation, double cell_size);

} // namespace hybmss
