#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "layouts/aligned_array.hpp"
#include "layouts/lattice/vector_neighbors.hpp"
#include "layouts/node_numbers.hpp"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace hybmss {

/// A layout's axes as the body's: along a row, along a plane, and normal to the planes.
using LatticeAxes = std::array<std::size_t, 3>;
/// "zxy": rows along z, planes normal to y.
std::string word_of(const LatticeAxes& axes);

/// What the cells around a grid node give to it and to the springs that start there: k = (k_e/4) * the sum of the
/// scales of the cells around an edge, and so on; a mass of rho h^3/8 a cell times its fill, rho its tissue's. The same
/// numbers in every layout.
class CellShares {
public:
    CellShares(const Lattice& lattice, const Material& material, const LatticeAxes& axes);

    struct Node {
        std::array<double, 7> stiffness; ///< k h, N; in the order of kernels::LatticeLayer
        double volume;                   ///< kappa h^2 / 32 of the cell whose low corner it is, N
        double cells; ///< that touch the node, by their mass over a whole one's of the material: nonzero makes it one
                      ///< of the body
    };
    /// Of the grid node at this place along the layout's axes.
    Node at(const std::array<std::size_t, 3>& place) const;

    double mass(double cells) const { return cell_mass_ * cells; }
    double inverse_mass(double cells) const { return 1 / (mass(cells) * lattice_.cell_size()); } ///< 1 / (m h)
    double volume_ratio() const { return volume_ratio_; } ///< kappa h^2 / (32 k_c h)
    double crush_ratio() const { return crush_ratio_; }   ///< of crush_modulus(), likewise

private:
    /// Of the body's material and the tissues, by number.
    struct Own {
        double volume;  ///< kappa h^2 / 32 at the scale 1
        double density; ///< over the material's
    };
    struct Cell {
        double scale; ///< zero outside
        std::size_t tissue;
        double fill;
    };
    Cell cell_at(const std::array<int, 3>& place) const;

    const Lattice& lattice_;
    LatticeAxes axes_;
    double edge_, face_, cube_, cell_mass_, volume_ratio_, crush_ratio_;
    std::vector<Own> own_;
};

/// A lattice in memory: what flat_rows() and active_rows() fill, each in its own order, and what a sweep from plane to
/// plane needs. See kernels::LatticeLayer.
template <class T>
struct LatticeArrays {
    LatticeAxes axes;
    std::size_t row = 0, rows = 0;  ///< flat-rows: nodes of a row, rows of a plane
    std::size_t cell_lanes = 0;     ///< flat-rows: of `lanes`, those that hold all cells, whole vectors of the widest
    std::size_t planes = 0;         ///< of nodes
    std::size_t plane = 0;          ///< flat-rows: distance of planes; else length of the longest
    std::vector<std::size_t> begin; ///< of each plane; one more entry at the end of the last
    std::vector<std::size_t> lanes; ///< of each plane: elements that a sweep visits
    /// Where each plane begins in the arrays of stiffness. Planes with the same cells below and above share one: a box
    /// has three, and a sweep finds the one in the middle in cache, layer for layer.
    std::vector<std::size_t> stiffness_begin;
    double cell_size = 0;
    AlignedArray<T> stiffness[7];           ///< k h, N; with springs on means the last alone; no void face diagonals
    AlignedArray<T> volume;                 ///< kappa h^2 / 32, N, where tissues have their own; else nothing
    AlignedArray<T> inverse_mass;           ///< 1 / (m h); 0 at void nodes
    std::vector<VectorNeighbors> neighbors; ///< active-rows
    std::size_t width = 0;                  ///< active-rows: lanes of a vector
    T volume_ratio = 0;                     ///< kappa h^2 / (32 k_c h)
    T crush_ratio = 0;                      ///< of crush_modulus(), likewise
    std::vector<double> masses;             ///< kg, one a node of the body
    std::vector<NodeRun> runs;              ///< of the body's nodes, ascending

    /// Elements of every array.
    std::size_t size() const { return inverse_mass.size(); }
    std::size_t bytes() const;

    /// Room for `elements`, and for so many of the stiffness that the material has, and what fills the last vector of
    /// the widest kind: loops over whole arrays have no tail. `own_volumes`: of the tissues.
    void allocate(std::size_t elements, std::size_t stiffness_elements, const Material& material, bool own_volumes);
    /// Where the stiffness of planes begins that share none.
    std::vector<std::size_t> own_stiffness() const { return {begin.begin(), begin.end() - 1}; }
    /// Gives every plane a stiffness of its own, so that its nodes can be set apart. Changes nothing where memory does
    /// not suffice.
    void separate_planes();
    /// Sets node n, whose stiffness is at `place`.
    void set_node(std::size_t n, std::size_t place, const CellShares::Node& node, const CellShares& shares);
};

extern template struct LatticeArrays<float>;
extern template struct LatticeArrays<double>;

/// The layout "flat-rows": every grid node has a place, connectivity is a sum of strides, void cells have stiffness
/// zero.
///
///     plane 0: row 0 | row 1 | ... | row ny | zeros to `plane`;  plane 1: ...;  plane nz
///
/// Rows lie along any axis of the body and planes normal to any other: a bar of 4 x 4 x 24 cells has 24 planes of 25
/// nodes in 32 lanes, or 4 of 125 in 128, of which 120 or, with rows along z, 100 hold cells. Mirrored axes and
/// components make the same forces, sums in another order.
///
/// Rows are nx + 1 nodes long and not padded (a padded row costs more lanes than it saves); planes are padded so that
/// they start on a vector and one row of zeros separates them. See kernels::LatticeLayer for how a kernel walks it.
///
/// The stiffness of planes with the same cells below and above is held once.
template <class T>
LatticeArrays<T> flat_rows(const Lattice& lattice, const Material& material, const LatticeAxes& axes);

extern template LatticeArrays<float> flat_rows(const Lattice&, const Material&, const LatticeAxes&);
extern template LatticeArrays<double> flat_rows(const Lattice&, const Material&, const LatticeAxes&);

/// Rows along x, and planes normal to z, or to y where that sweeps fewer lanes and leaves layers enough to share among
/// threads.
LatticeAxes plain_axes(const Lattice& lattice);
/// The plain ones and all others, `shared` those that leave layers enough, by what a sweep costs, where `shared` a
/// quarter more in eight layers or fewer; the plain ones before any that gain less than 3 %.
std::vector<LatticeAxes> axes_by_cost(const Lattice& lattice, bool shared);

/// The layout "active-rows": of every row, those vectors that hold a node of the body, one after the other; void is not
/// stored. For bodies that fill a small part of their grid.
///
///     a plane's rows, cut into vectors:      in memory, plane after plane:
///
///     y ^  |....|.ooo|o...|....|                0    1    2    3    4    5
///       |  |....|oooo|oo..|..oo|             |void|oooo|oo..|..oo|.ooo|o...|  next plane: |void| ...
///       +--------------------> x                    for each: where its neighbours at +y, +z and +y+z lie
///
/// Vectors are as wide as the kernels' and begin at multiples of their width in each row. The neighbour at +x is the
/// next element: where a row's next vector is not stored, no cell reaches into it. The first vector of a plane is void,
/// all zeros, and stands for every neighbour that is not stored: what a kernel reads or adds there belongs to void
/// cells. It stands first so that the element after it, which is read too, is of the same plane.
///
/// A vector takes 14 numbers a lane (8 here, 6 of state) and 12 bytes; memory and time follow the vectors stored, not
/// the grid. Rows padded to vectors: a full box of 33 nodes a row takes 48 lanes, 1.45 times those of flat rows. Rows
/// lie along x, or along another axis where that stores at most 4/5 of the vectors: then every node is a run of its
/// own, 32 bytes.
///
/// `width`: lanes of the kernels' vectors. `axes_width`: those for which the axes are chosen, where not the same.
template <class T>
LatticeArrays<T> active_rows(const Lattice& lattice, const Material& material, int width, int axes_width = 0);

extern template LatticeArrays<float> active_rows(const Lattice&, const Material&, int, int);
extern template LatticeArrays<double> active_rows(const Lattice&, const Material&, int, int);

/// The lanes that active rows of the given width store, and the axes along which they store the fewest.
struct ActiveLanes {
    LatticeAxes axes;
    std::size_t lanes;
};
ActiveLanes count_active_lanes(const Lattice& lattice, std::size_t width);

/// The lanes that active rows store, in vectors of 16, by the grid's nodes, which flat rows store. Above 1 for a box.
double active_share(const Lattice& lattice);

} // namespace hybmss
