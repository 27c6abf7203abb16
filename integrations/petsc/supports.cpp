#include "integrations/petsc/supports.hpp"

namespace hybmss::distributed {

std::vector<HeldComponent> held_components(const Block& block, const Supports& supports) {
    std::vector<HeldComponent> held;
    const NodeBox& mine = block.owned();
    for (PetscInt k = mine.low[2]; k < mine.low[2] + mine.size[2]; ++k) {
        for (PetscInt j = mine.low[1]; j < mine.low[1] + mine.size[1]; ++j) {
            for (PetscInt i = mine.low[0]; i < mine.low[0] + mine.size[0]; ++i) {
                if (const auto displacement = supports(i, j, k)) {
                    for (std::size_t c = 0; c < 3; ++c) {
                        held.push_back({3 * mine.index(i, j, k) + c, (*displacement)[c]});
                    }
                }
            }
        }
    }
    return held;
}

void set_held(Vec vector, const std::vector<HeldComponent>& held) {
    PetscScalar* values = nullptr;
    check(VecGetArray(vector, &values));
    for (const HeldComponent& component : held) {
        values[component.index] = component.displacement;
    }
    check(VecRestoreArray(vector, &values));
}

void clear_held(Vec vector, const std::vector<HeldComponent>& held) {
    PetscScalar* values = nullptr;
    check(VecGetArray(vector, &values));
    for (const HeldComponent& component : held) {
        values[component.index] = 0;
    }
    check(VecRestoreArray(vector, &values));
}

} // namespace hybmss::distributed
