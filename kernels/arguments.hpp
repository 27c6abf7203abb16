#pragma once

// What kernels are called with: plain pointers, strides and counts. Nothing here owns memory or checks anything.

#include "hybmss/accuracy.hpp"
#include "layouts/lattice/vector_neighbors.hpp"

#include <cstddef>
#include <cstdint>

namespace hybmss::kernels {

/// The compile-time choices of a kernel.
enum class Volume { none, quadratic, mean_stretch };
inline constexpr int kVolumeCount = 3;

using hybmss::Accuracy;
inline constexpr int kAccuracyCount = 3;

/// Second derivatives at the level `fast` are those of `accurate`: what a poorer direction costs a solver in iterations
/// is more than estimates save.
inline constexpr int kTangentCount = 2;
constexpr int tangent_index(Accuracy accuracy) {
    return accuracy == Accuracy::exact ? 1 : 0;
}

/// What a lattice layer does with a vector of nodes whose force is complete: leave it in `partial`, or integrate in
/// place without or with damping and gravity.
enum class Finish { store, integrate, integrate_driven };
inline constexpr int kFinishCount = 3;

/// The widest vector: all arrays are padded to multiples of it, so that kernels need no tail loop.
inline constexpr std::ptrdiff_t kMaxWidth = 16;

/// Constants of one semi-implicit Euler step, in the units of the state.
template <class T>
struct StepConstants {
    T time_step;        ///< dt
    T velocity_factor;  ///< 1 / (1 + dt c)
    T force_factor;     ///< dt / (1 + dt c), multiplies the inverse mass
    T velocity_gain[3]; ///< g dt / (1 + dt c)
};

/// One layer of cells of a lattice and the node planes below and above it.
///
/// Lengths are in units of the cell edge: u / h. A node plane is `row` = nx + 1 nodes wide; it takes `lanes` elements,
/// a multiple of kMaxWidth. Cells are numbered like the node at their low corner; those in the last column, in the last
/// row and in the padding are void (stiffness zero), so that one flat loop covers a layer: over the lanes up to
/// `cell_lanes`, behind which there are nodes of the last row alone, and their springs along the body's side:
///
///     y ^   o---o---o---o     nodes n + row ...        every cell n has its corners at
///       |   | 3 | 4 | v |                              n, n + 1, n + row, n + row + 1 and the same + plane
///       |   o---o---o---o     nodes n ...
///       +--> x
///
/// Planes lie `plane` >= lanes + row + 1 elements apart: the void cells of the last row reach one row behind the lanes,
/// where everything is zero and remains so. `partial` and `above` are `plane` elements long too.
///
/// In the layout active-rows, rows have no fixed distance, and planes differ in length: `neighbors` has the place of
/// row and plane, `lanes` and `upper_lanes` are what the two planes take, `plane` is where the upper one begins.
template <class T>
struct LatticeLayer {
    std::ptrdiff_t row;
    std::ptrdiff_t lanes;
    std::ptrdiff_t cell_lanes; ///< flat-rows: a multiple of kMaxWidth
    std::ptrdiff_t plane;
    T* displacement[3]; ///< of the lower node plane; the upper one follows after `plane` elements
    T* velocity[3];
    const T* inverse_mass; ///< 1 / (m h)
    /// Stiffness times h, per cell number: the edges along x, y, z from its low corner; the face diagonals of its low
    /// faces normal to z, y, x; the cube diagonals.
    const T* stiffness[7];
    T* partial[3];  ///< forces on the lower plane, from the layer below and this one
    T* above[3];    ///< forces on the upper plane, from this layer; set, not added to
    T volume_ratio; ///< kappa h^2 / (32 k_c h): the volume force's constant by the cube diagonal's
    StepConstants<T> step;
    const VectorNeighbors* neighbors; ///< active-rows: one a vector of the lower plane but its first
    std::ptrdiff_t upper_lanes;       ///< active-rows
};

struct LayerEnergy {
    double springs; ///< in units of force times h
    double volume;  ///< in units of 32 times the same
};

/// Springs of a network in blocks of the vector's width; no node occurs twice in one colour.
template <class T>
struct NetworkSprings {
    const std::int32_t* a;
    const std::int32_t* b;
    const T* rest[3];
    const T* stiffness;
    const T* inverse_length2; ///< 1 / l^2
};

/// Hexahedral cells of a network, likewise; array c of `node` holds corner c.
template <class T>
struct NetworkCells {
    const std::int32_t* node[8];
    const T* rest_edge[9]; ///< a0, b0, c0: the means of four parallel edges at rest, x y z each
    const T* kappa;
    const T* inverse_volume; ///< 1 / V0
};

/// Nodes of a network as separate arrays; m.
template <class T>
struct NodeArrays {
    T* displacement[3];
    T* velocity[3];
    T* force[3];
    const T* inverse_mass;
};

/// Nodes of a network in packed arrays, x y z 0 a node; m.
template <class T>
struct PackedNodes {
    T* displacement;
    T* velocity;
    T* force;
    const T* inverse_mass; ///< 1 / m three times and 0
};

} // namespace hybmss::kernels
