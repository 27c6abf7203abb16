#pragma once

#include "integrations/petsc/block.hpp"

#include <array>
#include <functional>
#include <optional>

namespace hybmss::distributed {

/// Which nodes are held, and where: displacements in m by the node's place in the grid, nothing for a free node. All
/// three components are held.
using Supports = std::function<std::optional<std::array<double, 3>>(PetscInt i, PetscInt j, PetscInt k)>;

/// A held component among the owned ones: its index in a rank's array of Block::nodes(), and its displacement.
struct HeldComponent {
    std::size_t index;
    double displacement;
};

std::vector<HeldComponent> held_components(const Block& block, const Supports& supports);

/// Sets the held components of a rank's vector: to their displacements, or to zero.
void set_held(Vec vector, const std::vector<HeldComponent>& held);
void clear_held(Vec vector, const std::vector<HeldComponent>& held);

} // namespace hybmss::distributed
