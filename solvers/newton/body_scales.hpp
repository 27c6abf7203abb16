#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"

namespace hybmss {

/// The sizes of a body at rest, by which a minimiser tells small from large.
struct BodyScales {
    double spring_force = 0;  ///< the largest k l, N
    double spring_length = 1; ///< a typical rest length, m
    double extent = 1;        ///< the diagonal of the bounding box, m

    static BodyScales of(const Lattice& lattice, const Material& material);
    static BodyScales of(const Network& network);
};

} // namespace hybmss
