#pragma once

#include "layouts/lattice/lattice_arrays.hpp"

namespace hybmss {

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
/// own, 24 bytes.
///
/// `width`: lanes of the kernels' vectors.
template <class T>
LatticeArrays<T> active_rows(const Lattice& lattice, const Material& material, int width);

extern template LatticeArrays<float> active_rows(const Lattice&, const Material&, int);
extern template LatticeArrays<double> active_rows(const Lattice&, const Material&, int);

/// The lanes that active rows of the given width store, and the axes along which they store the fewest.
struct ActiveLanes {
    LatticeAxes axes;
    std::size_t lanes;
};
ActiveLanes count_active_lanes(const Lattice& lattice, std::size_t width);

/// The lanes that active rows store, in vectors of 16, by the grid's nodes, which flat rows store. Above 1 for a box.
double active_share(const Lattice& lattice);

} // namespace hybmss
