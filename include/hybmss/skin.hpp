#pragma once

/// \file
/// Triangles that move with a lattice: what is drawn of a body, or touched.

#include "hybmss/contact.hpp"
#include "hybmss/export.h"
#include "hybmss/lattice.hpp"
#include "hybmss/plan_options.hpp"
#include "hybmss/vector_field.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace hybmss {

/// Vertices at rest (m, from the grid's low corner) and triangles of their numbers, counter-clockwise seen from
/// outside.
struct TriangleMesh {
    std::vector<std::array<double, 3>> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    bool operator==(const TriangleMesh&) const = default;
};

/// The faces of cells that no other cell shares, two triangles each; vertices are the nodes on them, in their order.
HYBMSS_EXPORT TriangleMesh boundary_mesh(const Lattice& lattice);

/// The same triangles with their vertices moved off the nodes, by half a cell along each axis at most: to the middle of
/// where the surface crosses the lines between the centres of the cells around. Along such a line it is told by how
/// much of the two cells is filled, exactly where it is a plane across; cells of less than a half are outside. Where
/// all cells are whole, terraces are smoothed after that (Taubin 1995), which also rounds edges.
HYBMSS_EXPORT TriangleMesh smooth_boundary_mesh(const Lattice& lattice);

/// A mesh in a lattice. A vertex has a place in a cell, or beside the nearest one, and moves as the cell's nodes do, by
/// their trilinear interpolation; beside a cell it goes on linearly from the cell's nearest point. Affine motions are
/// followed exactly. Normals turn as the cell's map turns areas at that point: by the cofactor of its gradient. T is
/// float or double.
///
/// Memory: 10 values a vertex. Made in time proportional to vertices and cells. Not changed by use: may be used by
/// several threads at the same time.
template <class T>
class HYBMSS_EXPORT Skin {
public:
    /// Of the options the threads and the task runner. Throws std::invalid_argument for a lattice without cells, a
    /// vertex beyond 1e9 m, a triangle of vertices that do not exist.
    Skin(const Lattice& lattice, const TriangleMesh& mesh, const PlanOptions& options = {});
    Skin(Skin&&) noexcept;
    Skin& operator=(Skin&&) noexcept;
    ~Skin();

    std::size_t vertex_count() const;
    std::size_t node_count() const;

    /// Sets the vertices' positions (m), and their unit normals where these are given (the mean of the triangles around
    /// a vertex at rest, by their areas; 0 where there is none), at displacements of the body's nodes (m). Memory is
    /// the caller's; throws std::invalid_argument for fields of another size, without memory or that share some.
    void update(VectorField<const T> displacement, VectorField<T> positions, VectorField<T> normals = {}) const;

    /// The mesh's triangles, in their order, less those with a vertex in a cell that `cut`, the lattice less some
    /// cells, has lost.
    std::vector<std::array<std::uint32_t, 3>> triangles_left(const Lattice& cut) const;

private:
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// The points of a mesh in a lattice that obstacles touch (ExplicitDynamics::set_skin_obstacles): its vertices, and
/// where edges are longer than 3/2 of a cell, points between. Each moves as a vertex of Skin does.
/// `origin`: the low corner of the grid, m. Throws std::invalid_argument as Skin does.
HYBMSS_EXPORT std::vector<SkinPoint> skin_points(const Lattice& lattice, const TriangleMesh& mesh,
                                                 const std::array<double, 3>& origin = {0, 0, 0});

extern template class Skin<float>;
extern template class Skin<double>;

} // namespace hybmss
