#include "integrations/petsc/block_forces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss::distributed {
namespace {

VectorField<double> aos(std::vector<double>& values) {
    return VectorField<double>::aos(values.data(), values.size() / 3);
}
VectorField<const double> aos(const std::vector<double>& values) {
    return VectorField<const double>::aos(values.data(), values.size() / 3);
}

} // namespace

BlockForces::BlockForces(const Block& block, const Material& material, const PlanOptions& options)
    : block_(block), material_(material), options_(options) {
    check(DMCreateLocalVector(block.nodes(), ghosted_.make()));
    check(DMCreateGlobalVector(block.nodes(), masses_.make()));
    const std::size_t values = 3 * block.lattice_nodes().size();
    displacement_.resize(values);
    direction_.resize(values);
    result_.resize(values);
    if (block.lattice()) {
        plan_ = std::make_unique<ForcePlan<double>>(*block.lattice(), material, options);
    }
    set_masses();
}

/// rho h^3 / 8 at each corner of a cell.
void BlockForces::set_masses() {
    check(VecSet(masses_, 0));
    if (!block_.lattice()) {
        return;
    }
    const Lattice& lattice = *block_.lattice();
    const NodeBox &mine = block_.owned(), &all = block_.ghosted();
    const double share = material_.density * std::pow(lattice.cell_size(), 3) / 8;
    const auto [nx, ny, nz] = lattice.cells();
    PetscScalar* masses = nullptr;
    check(VecGetArray(masses_, &masses));
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                for (int corner = 0; lattice.cell_scale(i, j, k) > 0 && corner < 8; ++corner) {
                    const PetscInt x = all.low[0] + i + (corner & 1), y = all.low[1] + j + (corner >> 1 & 1),
                                   z = all.low[2] + k + (corner >> 2);
                    for (std::size_t c = 0; mine.holds(x, y, z) && c < 3; ++c) {
                        masses[3 * mine.index(x, y, z) + c] += share;
                    }
                }
            }
        }
    }
    check(VecRestoreArray(masses_, &masses));
}

void BlockForces::fetch(Vec owned, Field& field) {
    check(DMGlobalToLocal(block_.nodes(), owned, INSERT_VALUES, ghosted_));
    const PetscScalar* values = nullptr;
    check(VecGetArrayRead(ghosted_, &values));
    const auto& nodes = block_.lattice_nodes();
    if (block_.full()) {
        std::copy_n(values, field.size(), field.begin());
    } else {
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            std::copy_n(values + 3 * static_cast<std::ptrdiff_t>(nodes[n]), 3, &field[3 * n]);
        }
    }
    check(VecRestoreArrayRead(ghosted_, &values));
}

void BlockForces::store(const Field& field, Vec owned) const {
    PetscScalar* values = nullptr;
    check(VecSet(owned, 0));
    check(VecGetArray(owned, &values));
    const NodeBox &mine = block_.owned(), &all = block_.ghosted();
    const auto& nodes = block_.lattice_nodes();
    if (block_.full()) {
        for (PetscInt k = 0; k < mine.size[2]; ++k) {
            for (PetscInt j = 0; j < mine.size[1]; ++j) {
                const PetscInt x = mine.low[0], y = mine.low[1] + j, z = mine.low[2] + k;
                std::copy_n(&field[3 * all.index(x, y, z)], 3 * mine.size[0], values + 3 * mine.index(x, y, z));
            }
        }
    } else {
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            const auto [x, y, z] = all.place(nodes[n]);
            if (mine.holds(x, y, z)) {
                std::copy_n(&field[3 * n], 3, values + 3 * mine.index(x, y, z));
            }
        }
    }
    check(VecRestoreArray(owned, &values));
}

void BlockForces::set_displacement(Vec displacement) {
    fetch(displacement, displacement_);
}

void BlockForces::get_forces(Vec force) {
    std::fill(result_.begin(), result_.end(), 0.0);
    if (plan_) {
        plan_->add_forces(aos(std::as_const(displacement_)), aos(result_));
    }
    store(result_, force);
}

void BlockForces::get_hessian_product(Vec direction, Vec product) {
    fetch(direction, direction_);
    std::fill(result_.begin(), result_.end(), 0.0);
    if (plan_) {
        plan_->add_hessian_product(aos(std::as_const(displacement_)), aos(std::as_const(direction_)), aos(result_));
    }
    store(result_, product);
}

std::vector<double> BlockForces::hessian_diagonal() {
    std::vector<double> owned(6 * block_.owned().count());
    if (!plan_) {
        return owned;
    }
    std::vector<double> blocks(6 * block_.lattice_nodes().size());
    plan_->hessian_diagonal(aos(std::as_const(displacement_)), blocks);
    for (std::size_t n = 0; n < block_.lattice_nodes().size(); ++n) {
        const auto [x, y, z] = block_.ghosted().place(block_.lattice_nodes()[n]);
        if (block_.owned().holds(x, y, z)) {
            std::copy_n(&blocks[6 * n], 6, &owned[6 * block_.owned().index(x, y, z)]);
        }
    }
    return owned;
}

double BlockForces::energy() const {
    double energy = 0, total = 0;
    if (const std::optional<Lattice> counted = block_.counted_cells()) {
        const auto& all = block_.lattice_nodes();
        Field field;
        for (const std::uint32_t node : counted->nodes()) {
            const auto n = std::lower_bound(all.begin(), all.end(), node) - all.begin();
            field.insert(field.end(), displacement_.begin() + 3 * n, displacement_.begin() + 3 * n + 3);
        }
        energy = ForcePlan<double>(*counted, material_, options_).energy(aos(std::as_const(field))).total();
    }
    MPI_Allreduce(&energy, &total, 1, MPI_DOUBLE, MPI_SUM, block_.communicator());
    return total;
}

double BlockForces::critical_time_step() const {
    double own = plan_ ? plan_->critical_time_step() : std::numeric_limits<double>::infinity(), least = 0;
    MPI_Allreduce(&own, &least, 1, MPI_DOUBLE, MPI_MIN, block_.communicator());
    return least;
}

} // namespace hybmss::distributed
