#pragma once

/// \file
/// A body given by its surface: triangles -> cells.

#include "hybmss/simulation/scene.hpp"
#include "hybmss/skin.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

namespace hybmss {

using TriangleSurface = TriangleMesh;
using Vector3 = std::array<double, 3>;

/// Reads an STL, OBJ, PLY or glTF file; all its objects together, each where the file puts it. Throws
/// std::runtime_error that says what is wrong, without the file's name.
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

/// The same grid with all cells that the surface reaches, and their `fills`. These are made of the volumes that are
/// inside the cells, exact to rounding: of what a cut cell has, the part |d_a| goes to the neighbour along each axis a
/// towards which its centre of mass lies d cell sizes off the cell's centre. So the volume and its first moments, which
/// bending feels, are those of the surface's inside, wherever the surface runs; an inner cell beside it may have more
/// than 1. What fills less than a twentieth of a cell goes to its neighbours as a whole. Throws where `orientation` is
/// mixed, too: which side is inside must be told. Where shells overlap, the cells within are whole.
SceneBody filled(const TriangleSurface& surface, Orientation orientation, double cell_size);

/// Of each cell of a body's grid whether its centre is inside another surface: 1 or 0.
std::vector<std::uint8_t> centres_inside(const TriangleSurface& surface, Orientation orientation,
                                         const SceneBody& grid);

/// Of each cell of a body's grid the part that is inside another surface, exact to rounding; what is outside of the
/// grid is left out. Throws as filled() does.
std::vector<float> parts_inside(const TriangleSurface& surface, Orientation orientation, const SceneBody& grid);

/// A convex polygon in space, its corners in order.
using Polygon = std::vector<Vector3>;

/// visit(cell, the part of a triangle in it) for a triangle in units of cells, cut along the cells' faces. What is on
/// the last face along an axis is in the cell behind it; what is outside of cells from 0 to these is left out.
void for_each_piece(const Polygon& triangle, const std::array<std::int64_t, 3>& cells,
                    const std::function<void(const std::array<int, 3>& cell, const Polygon& piece)>& visit);

/// m^3; negative where the triangles turn their outer sides inwards.
double enclosed_volume(const TriangleSurface& surface);

} // namespace hybmss
