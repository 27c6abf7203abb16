#pragma once

#include "layouts/lattice/lattice_arrays.hpp"

namespace hybmss {

/// The layout "flat-rows": every grid node has a place, connectivity is a sum of strides, void cells have stiffness
/// zero.
///
///     plane 0: row 0 | row 1 | ... | row ny | zeros to `plane`;  plane 1: ...;  plane nz
///
/// Planes are normal to z or to y, whichever wastes fewer lanes on void cells: a bar of 4 x 4 x 24 cells has 24 planes
/// of 25 nodes in 32 lanes, or 4 of 125 in 128. Mirrored axes and components make the same forces.
///
/// Rows are nx + 1 nodes long and not padded (a padded row costs more lanes than it saves); planes are padded so that
/// they start on a vector and one row of zeros separates them. See kernels::LatticeLayer for how a kernel walks it.
///
/// The stiffness of planes with the same cells below and above is held once.
template <class T>
LatticeArrays<T> flat_rows(const Lattice& lattice, const Material& material);

extern template LatticeArrays<float> flat_rows(const Lattice&, const Material&);
extern template LatticeArrays<double> flat_rows(const Lattice&, const Material&);

} // namespace hybmss
