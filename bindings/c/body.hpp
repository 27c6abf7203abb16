#pragma once

#include "hybmss/hybmss.h"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"

#include <cstddef>
#include <variant>

namespace hybmss::c_interface {

struct LatticeBody {
    Lattice lattice;
    Material material;
};

/// Throw std::invalid_argument for a number that names none.
VolumeEnergy volume_energy(hybmss_volume_energy number);
Material material(const hybmss_material* given);

} // namespace hybmss::c_interface

struct hybmss_body {
    std::variant<hybmss::c_interface::LatticeBody, hybmss::Network> shape;
    std::size_t node_count;
};
