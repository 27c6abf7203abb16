#include "integrations/petsc/commands.hpp"

#include <algorithm>
#include <cstdio>

namespace hybmss::distributed {

Grid BodyArguments::grid() const {
    Grid grid{cells, cell_size, {}};
    if (hollow) {
        grid.scale = [all = cells](PetscInt i, PetscInt j, PetscInt k) {
            const std::array<PetscInt, 3> at = {i, j, k};
            for (std::size_t a = 0; a < 3; ++a) {
                if (std::min(at[a], all[a] - 1 - at[a]) < 2) {
                    return 1.0f;
                }
            }
            return 0.0f;
        };
    }
    return grid;
}

PlanOptions BodyArguments::plan_options() const {
    PlanOptions options;
    options.threads = threads;
    // What is chosen must not depend on a machine's load, or a restart would go on with other roundings.
    options.effort = Effort::estimate;
    return options;
}

double BodyArguments::cell_count() const {
    return static_cast<double>(cells[0]) * static_cast<double>(cells[1]) * static_cast<double>(cells[2]);
}

bool save_and_compare(const ResultArguments& arguments, const Block& block, Vec displacement) {
    if (!arguments.save.empty()) {
        check(VecView(displacement, open_binary(block.communicator(), arguments.save, FILE_MODE_WRITE)));
    }
    if (arguments.compare.empty()) {
        return true;
    }
    OwnedVec other;
    check(VecDuplicate(displacement, other.make()));
    if (VecLoad(other, open_binary(block.communicator(), arguments.compare, FILE_MODE_READ)) != 0) {
        throw std::invalid_argument(arguments.compare + ": no displacements of this grid");
    }
    double greatest = 0, difference = 0;
    check(VecNorm(other, NORM_INFINITY, &greatest));
    check(VecAXPY(other, -1, displacement));
    check(VecNorm(other, NORM_INFINITY, &difference));
    if (block.rank() == 0) {
        std::printf("difference from %s: %.3g of the greatest displacement (allowed: %.3g)\n",
                    arguments.compare.c_str(), difference / greatest, arguments.tolerance);
    }
    return difference <= arguments.tolerance * greatest;
}

} // namespace hybmss::distributed
