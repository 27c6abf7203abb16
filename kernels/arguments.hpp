#pragma once

// What kernels are called with: plain pointers, strides and counts. Nothing here owns memory or checks anything.

#include "hybmss/accuracy.hpp"
#include "layouts/lattice/vector_neighbors.hpp"
#include "layouts/network/network_blocks.hpp"

#include <cstddef>
#include <cstdint>

namespace hybmss::kernels {

// The compile-time choices of a kernel, beside the level of accuracy.

enum class Volume { none, quadratic, mean_stretch };

/// Where the pressure kappa phi'(J) of a polyhedron comes from: its own volume, or the mean of its nodes'.
enum class Pressure { quadratic, mean_stretch, of_nodes };

using hybmss::Accuracy;

/// What a lattice layer does with a vector of nodes whose force is complete: leave it in `partial`, or integrate in
/// place without or with damping and gravity. Asked anew for each vector: a branch that is always foretold right, where
/// a function for each answer would triple what there is to compile.
enum class Finish { store, integrate, integrate_driven };

/// Which vector a spring contributes to a sweep's sums, at end b; the opposite at end a. With p = p_b - p_a, d = x_b -
/// x_a, n = d/|d|, e = |d|/l - 1 and g(e) = quadratic e^2 + cubic e^3:
enum class SpringLaw {
    elastic,            ///< H p of the energy 1/2 k (|d| - l)^2: k [ (1 - l/|d|) (I - n n^T) + n n^T ] p
    damping,            ///< k (n.p) n: for p the velocity, the force of a dashpot k by the time it lags
    stiffening,         ///< k l g(e) n: the derivative of the energy k l^2 (quadratic e^3/3 + cubic e^4/4)
    stiffening_tangent, ///< H p of that energy: k [ g/(1 + e) (I - n n^T) + g' n n^T ] p
    // Not of springs but of cells below the volume ratio J0, with the energy crush V0 (J0 - J)^3 / 3:
    crush,         ///< its derivative
    crush_tangent, ///< its H p
    // Nor these, but of cells whose kappa does not go by the springs' stiffness, with the energy kappa V0 phi(J):
    own_volume,
    own_volume_tangent,
};

/// What a lattice's sweep of second derivatives sums up.
struct LatticeSum {
    SpringLaw law;
    Volume volume;
    bool operator==(const LatticeSum&) const = default;
};

/// What a pass over the nodes' blocks B does: x = B r alone; or a term of a smoother (grid_arguments.hpp), from x = 0,
/// without a direction to keep, or the next one.
enum class BlockUse { multiply, first, restart, next };

/// Of the items that a kernel goes over.
using Range = std::ptrdiff_t;

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

/// Of cells with springs on means, by the cube diagonals' k_c: k_e / 16, k_f / 16, bending / 1024, coupling, twist /
/// 1024, fourth / 64 (PatternConstants); the numbers are those of sums in place of means (kernels/means/mean_cell.hpp).
template <class T>
struct MeanConstants {
    T edge, face, bending, coupling, twist, joint_twist, fourth;
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
///
/// Of bodies side by side (bodies_layer) each element of the state is so many, one a body, and `row`, `lanes`,
/// `cell_lanes` and `plane` count them all; the second and third without padding. Masses and stiffnesses are once for
/// all.
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
    T* partial[3];          ///< forces on the lower plane, from the layer below and this one
    T* above[3];            ///< forces on the upper plane, from this layer; set, not added to
    T volume_ratio;         ///< kappa h^2 / (32 k_c h): the volume force's constant by the cube diagonal's
    MeanConstants<T> means; ///< of cells with springs on means, which have the cube diagonals' stiffness alone
    Finish finish;
    StepConstants<T> step;
    const VectorNeighbors* neighbors; ///< active-rows: one a vector of the lower plane but its first
    std::ptrdiff_t upper_lanes;       ///< active-rows
};

struct LayerEnergy {
    double springs; ///< in units of force times h
    double volume;  ///< in units of 32 times the same
};

/// Springs of a network in blocks of kMaxWidth; no node occurs in two blocks of one colour.
template <class T>
struct NetworkSprings {
    const std::int32_t* a;
    const std::int32_t* b;
    const T* rest[3];
    const T* stiffness;
    const T* inverse_length2;   ///< 1 / l^2
    const std::uint8_t* in_row; ///< one a block: whether lane i has the nodes a + i and b + i of lane 0
};

/// Hexahedral cells of a network, likewise; array c of `node` holds corner c.
template <class T>
struct NetworkCells {
    const std::int32_t* node[8];
    const T* rest_edge[9]; ///< a0, b0, c0: the means of four parallel edges at rest, x y z each
    const T* kappa;
    const T* inverse_volume; ///< 1 / V0
    const std::uint8_t* in_row;
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

/// Runs of springs and what they refer to (network_blocks.hpp); those from the same low nodes follow each other.
template <class T>
struct SpringRuns {
    const SpringRun* runs;
    const SpringRunShape<T>* shapes;
    const LaneValues<T>* stiffnesses;
};
template <class T>
struct CellRuns {
    const CellRun* runs;
    const CellRunShape<T>* shapes;
    const LaneValues<T>* kappas;
};

/// Cells of a network with springs on means: runs of packed nodes where `runs` is not null, else blocks.
template <class T>
struct MeanCells {
    MeanConstants<T> constants;
    const MeanBlock<T>* blocks;
    const CellRun* runs;
    const MeanRunShape<T>* shapes;
    const LaneValues<T>* stiffnesses;
};

// ---- second derivatives, and passes by other laws of the springs

/// The constants of g(e), without unit; zero where the law has none. And which second derivatives elasticity and
/// volumes have: the energy's as the numbers stand here, those of no state indefinite where they are zero.
template <class T>
struct StiffeningConstants {
    T quadratic, cubic;
    T least_tension = T(-1e30); ///< what t = 1 - l/|d| is bounded by: springs under compression push sideways
    T geometric = 1;            ///< factor of what pressure and patterns' tensions add as the corners move
};

/// The entries of a symmetric 3x3 block, in the order in which their arrays come.
inline constexpr int kBlockEntries = 6; ///< xx, yy, zz, xy, xz, yz

/// A LatticeLayer for second derivatives: `components` values a node come out, three of a product K p, six of a
/// diagonal block.
///
/// Lengths are in units of the cell edge, `direction` too, and so are those by which blocks are divided: both results
/// are made of k h, in N.
template <class T, int components>
struct LatticeHessianLayer {
    std::ptrdiff_t row;
    std::ptrdiff_t lanes;
    std::ptrdiff_t plane;
    const T* displacement[3];         ///< of the lower node plane; the upper one follows after `plane` elements
    const T* direction[3];            ///< p, likewise; for products alone
    const T* stiffness[7];            ///< as in LatticeLayer
    T* partial[components];           ///< sums of the lower plane, from the layer below and this one
    T* above[components];             ///< sums of the upper plane, from this layer; set, not added to
    T volume_ratio;                   ///< as in LatticeLayer
    MeanConstants<T> means;           ///< as in LatticeLayer
    const VectorNeighbors* neighbors; ///< as in LatticeLayer for active-rows; null for flat rows
    std::ptrdiff_t upper_lanes;       ///< as in LatticeLayer; for active-rows
    StiffeningConstants<T> stiffening;
    T crush_bound; ///< J0 - 1; of the laws of crushed cells, whose modulus is in volume_ratio in place of kappa
    // Of the laws of own volumes, whose kappa h^2 / 32 is in stiffness[6]: what is below the bound has mean stretch in
    // place of the quadratic energy, or all has.
    T least_quadratic;
    bool all_mean_stretch;
};

/// Nodes of a network as separate arrays; m. For cells with springs on means, also packed ones: in [0], null in the
/// others.
template <class T>
struct HessianArrays {
    const T* displacement[3];
    const T* direction[3];
    T* product[3]; ///< N; added to
    StiffeningConstants<T> stiffening;
};

/// Nodes of a network in packed arrays, x y z 0 a node; m.
template <class T>
struct PackedHessian {
    const T* displacement;
    const T* direction;
    T* product; ///< N; added to
    StiffeningConstants<T> stiffening;
};

/// Volumes of nodes, m^3, and what follows from them, at the first element of a node's displacement.
template <class T>
struct NodalVolumeArrays {
    T* dilation;        ///< V' - V0
    T* dilation_change; ///< its change by a direction
    T* pressure;        ///< kappa phi'(J)
    T* pressure_change;
    const T* kappa;
    const T* inverse_volume; ///< 1 / V0
};

/// The diagonal blocks of a network's nodes, N/m, an array for each entry; added to.
template <class T>
struct DiagonalBlocks {
    T* entry[kBlockEntries];
    StiffeningConstants<T> stiffening;
};

// ---- multigrid's cycles: grid_arguments.hpp

template <class T>
struct NodeBlocks;
template <class T>
struct GridStencil;
template <class T>
struct PatternedCells;
template <class T>
struct CellTurns;
template <class T>
struct TurnedRows;

// ---- cells of another size at rest

/// What their springs, volumes and patterns are made of, by the shear modulus G and the edge h.
template <class T>
struct ActuationLaw {
    T edge, face, cube;   ///< k / (G h): a cell's share of each spring, or on means all of it
    T quadratic, cubic;   ///< of SpringStiffening
    T crush, crush_ratio; ///< beta / J0^2, and J0
    T bending, coupling, twist, joint_twist, fourth; ///< of PatternConstants, by G h
    bool mean_stretch;                               ///< cells' volumes have it, those with kappa < 0 alone where
    bool by_sign;
};

/// Cells in the order of their numbers; `count` of them, a multiple of kMaxWidth: those at the end weigh nothing.
template <class T>
struct ActuatedCells {
    const std::uint32_t* place[8]; ///< of the corners in a component of a field, its stride counted in
    const T* weight;               ///< G h^2 times the cell's scale, N
    const T* kappa;                ///< over G
    const T* stretch[3];           ///< of the axes at rest, > 0
    Range count;
    ActuationLaw<T> law;
    T by_edge;                ///< the unit of length over h
    const T* displacement[3]; ///< in the unit of length
    const T* direction[3];    ///< likewise
    T* result;                ///< N: the components of the corners one after the other, `count` of each
};

// ---- what cells remember

/// Branches of a Prony series at most.
inline constexpr int kMaxRelaxations = 4;

/// What a time makes of the strains h of a branch while Green's strain changes steadily by c: h + gained c - lost h.
/// Meanwhile it takes out, by the square in the norm of the elastic energy, `of_sums` times that of h before + h after,
/// and `of_changes` times that of c.
template <class T>
struct RelaxationCourse {
    T gained, lost, part;
    T of_sums, of_changes;
};

/// Where what lies beside each of a block of kMaxWidth slots is in their arrays: from `start` on one after the other,
/// or at lanes[from + i] where from >= 0. One a block and neighbouring row.
struct SlotRow {
    std::int32_t start, from;
};

/// A slot is a node, and the cell whose low corner it is: one without stiffness where there is none. So a body's nodes
/// one after the other, rows along x, are its cells too. A slot before and some behind a block's may be read: arrays
/// are longer at both ends.
template <class T>
struct RelaxingCells {
    const T* displacement[3];
    const SlotRow* rows; ///< of the corners further in y, in z, in both: those of low x. Three a block
    const std::int32_t* lanes;
    T quarter_by_edge;     ///< the unit of length over four times the edge
    const T *shear, *lame; ///< by what a body has
    int branches;
    RelaxationCourse<T> course[kMaxRelaxations];
    /// By blocks a line of kMaxWidth for each of: Green's strain xx, yy, zz, xy, yz, xz; a branch's strains likewise;
    /// in float what these have been rounded by.
    T* strains;
    /// What the cells' corners feel: 4 a + r the component a of that at low x, and at high y (r & 1) and z (r & 2); the
    /// opposite corner feels the opposite. By the first Piola stress P: P_x +- P_y +- P_z.
    T* pull[12];
};

/// What a cell has of strains, beside Green's, by branch.
template <class T>
inline constexpr int kRelaxationLines = sizeof(T) == 4 ? 12 : 6;

/// The slots' sums over the cells around them.
template <class T>
struct RelaxingNodes {
    const T* pull[12];
    const SlotRow* rows; ///< of the cells before in y, in z, in both, of high x. Three a block
    const std::int32_t* lanes;
    T* force[3];
};

// ---- vertices in cells

/// A cell with vertices: `count` of them from `first` on.
template <class T>
struct SkinCell {
    std::uint32_t nodes[8];
    Range first, count;
    T middle[3];          ///< at rest, m
    std::uint32_t inside; ///< all of them
};

/// The first of three arrays of a vertex's values: its place from the cell's middle, -1 to 1 along each axis in the
/// cell; the same, as near as the cell goes; its normal at rest.
inline constexpr int kSkinPlace = 0, kSkinNearest = 3, kSkinNormal = 6, kSkinValues = 9;

/// Vertices in the order of their cells. Vectors are read whole: arrays of values have kMaxWidth more at their end.
template <class T>
struct SkinVertices {
    const SkinCell<T>* cells;
    const T* values[kSkinValues];
    const std::uint32_t* order; ///< their numbers: where they are put
    T half_size;                ///< of a cell, m
    T inverse_half_size;
    const T* displacement[3]; ///< m
    std::ptrdiff_t displacement_stride;
    T* positions[3];
    std::ptrdiff_t positions_stride;
    T* normals[3]; ///< where wanted
    std::ptrdiff_t normals_stride;
};

// ---- stresses of cells

/// The first of the arrays that take a value of each cell: first Piola stress row by row; Cauchy stress and Green
/// strain xx, yy, zz, xy, yz, xz; and one array each.
inline constexpr int kStressPiola = 0, kStressCauchy = 9, kStressGreen = 15, kStressVolumeRatio = 21,
                     kStressEnergy = 22, kStressVonMises = 23, kStressPressure = 24, kStressValues = 25;

/// Cells anywhere in a body. Lengths by the cell size, moduli in Pa. Vectors are read whole: arrays of cells have
/// kMaxWidth more at their end. Nothing is written beyond the last cell.
template <class T>
struct StressCells {
    const T* displacement[3];
    const std::int32_t* corners[8]; ///< node numbers
    const std::uint8_t* in_a_row;   ///< so many cells from this one on have nodes one after the other
    const T* scale;                 ///< of stiffness
    const T* quadratic;             ///< volume moduli at the scale 1, by energy
    const T* mean_stretch;
    T springs[3]; ///< of edges, face and cube diagonals: k/h
    StiffeningConstants<T> stiffening;
    T crush, crush_bound;                            ///< modulus; J - 1 below which it acts
    T bending, coupling, twist, joint_twist, fourth; ///< of patterns, by h; for springs on means
    T* values[kStressValues];                        ///< null where not wanted
};

} // namespace hybmss::kernels
