#pragma once

/// \file
/// The bodies of the regression matrix.

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "reference/body.hpp"

#include <optional>
#include <string>
#include <vector>

namespace hybmss::verify {

/// One body in one variant: a lattice with its material, or a network made by hand.
struct TestBody {
    std::string name;    ///< e.g. "box 3x2x5"
    std::string variant; ///< e.g. "A=1 quadratic"
    std::optional<Lattice> lattice;
    Material material;    ///< of the lattice
    Network network;      ///< where there is no lattice
    double cell_size = 1; ///< m; a strain of 1 means displacements of this size
};

/// How much of the matrix to run.
enum class Extent {
    full, ///< all bodies
    quick ///< those of at most 1000 cells
};

/// Boxes, masks and networks, each in all of its variants. Random parts follow from the seed alone.
std::vector<TestBody> test_bodies(Extent extent, unsigned seed);

/// A few small ones, for checks that need many runs of each: a box, a mask with mixed stiffness, a network.
std::vector<TestBody> property_bodies(unsigned seed);

reference::Body reference_body(const TestBody& body);

} // namespace hybmss::verify
