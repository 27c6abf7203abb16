#include "solvers/multigrid/multigrid.hpp"

#include "solvers/multigrid/grid_transfer.hpp"
#include "solvers/multigrid/multigrid_fine_level.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hybmss {
namespace {

/// Above this ratio of the volume's modulus to the shear modulus (nu = 0.4) the rotations are smoothed too.
constexpr double kStiffVolume = 3;
/// Levels of at most so many nodes are solved directly.
constexpr std::size_t kDirectNodes = 40;

double volume_to_shear(const Material& material) {
    return resolved_volume_energy(material) == VolumeEnergy::none ? 0
                                                                  : volume_modulus(material) / shear_modulus(material);
}

/// Three terms; more where the volume is stiff, as each digit of stiffness slows the smoother down.
int smoother_degree(double ratio) {
    return ratio <= kStiffVolume ? 3 : 3 + static_cast<int>(std::ceil(2 * std::log10(ratio)));
}

/// A coarse cell's deformation gradient is the mean of its cells'.
void merge_gradients(const CellRotations& fine, const PaddedGrid& fine_grid, CellRotations& coarse,
                     const PaddedGrid& coarse_grid) {
    int merged[3];
    for (std::size_t c = 0; c < 3; ++c) {
        merged[c] = coarse_grid.cells[c] != fine_grid.cells[c];
    }
    for_each_place({0, 0, 0}, {coarse_grid.cells[0] - 1, coarse_grid.cells[1] - 1, coarse_grid.cells[2] - 1},
                   [&](int ci, int cj, int ck) {
                       float sum[9] = {}, count = 0;
                       for_each_place({0, 0, 0}, {merged[0], merged[1], merged[2]}, [&](int x, int y, int z) {
                           const std::size_t n = fine_grid.index((1 + merged[0]) * ci + x, (1 + merged[1]) * cj + y,
                                                                 (1 + merged[2]) * ck + z);
                           if (fine.present()[n]) {
                               count += 1;
                               for (std::size_t e = 0; e < 9; ++e) {
                                   sum[e] += fine.gradient()[e][n];
                               }
                           }
                       });
                       const std::size_t cell = coarse_grid.index(ci, cj, ck);
                       coarse.present()[cell] = count > 0;
                       for (std::size_t e = 0; e < 9 && count > 0; ++e) {
                           coarse.gradient()[e][cell] = sum[e] / count;
                       }
                   });
}

} // namespace

template <class T>
Multigrid<T>::Multigrid(const Body<T>& body, const Lattice& lattice, const Material& material)
    : body_(&body), workers_(&body.workers()), stiffness_(material, lattice.cell_size()), grid_{lattice.cells()},
      unit_(body.length_unit() / lattice.cell_size()),
      scales_(lattice.cell_scales().begin(), lattice.cell_scales().end()), node_at_(grid_.size(), kNoNode),
      touching_(body.node_count(), 0.0f), grid_in_(grid_), grid_out_(grid_),
      degree_(smoother_degree(volume_to_shear(material))), low_part_(1.0 / (degree_ * degree_)) {
    for (float& scale : scales_) {
        scale *= static_cast<float>(unit_);
    }
    for (std::size_t n = 0; n < body.node_count(); ++n) {
        places_.push_back(static_cast<std::uint32_t>(body.index_of(n)));
    }
    const auto [nx, ny, nz] = lattice.cells();
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    const auto row = static_cast<std::uint32_t>(nx + 1), rows = static_cast<std::uint32_t>(ny + 1);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        node_at_[grid_.index(static_cast<int>(nodes[n] % row), static_cast<int>(nodes[n] / row % rows),
                             static_cast<int>(nodes[n] / row / rows))] = static_cast<std::uint32_t>(n);
    }
    std::size_t cell = 0;
    for_each_place({0, 0, 0}, {nx - 1, ny - 1, nz - 1}, [&](int i, int j, int k) {
        if (scales_[cell++] > 0) {
            for (std::size_t corner = 0; corner < 8; ++corner) {
                touching_[node_at_[grid_.index(i, j, k) + grid_.corner_offset(corner)]] += 1;
            }
        }
    });
    const bool stiff = volume_to_shear(material) > kStiffVolume;
    if (stiff) {
        rotations_.emplace(grid_);
        shapes_.resize(scales_.size());
        find_rest_rotations();
    }
    PaddedGrid coarse = coarsened(grid_);
    for (; coarse.node_count() > kDirectNodes; coarse = coarsened(coarse)) {
        levels_.push_back(std::make_unique<CoarseLevel>(coarse, stiff, *workers_));
    }
    direct_ = std::make_unique<DirectLevel>(coarse);
}
template <class T>
Multigrid<T>::~Multigrid() = default;

template <class T>
void Multigrid<T>::update(const Potential<T>& potential) {
    if (!fine_) {
        fine_ = std::make_unique<FineLevel>(*this, potential.space());
    }
    fine_->potential = &potential;
    blocks_.update(potential);
    merge_finest(potential);
    const CellRotations* above = rotations_ ? &*rotations_ : nullptr;
    const PaddedGrid* grid = &grid_;
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        CoarseLevel& level = *levels_[l];
        if (above) {
            merge_gradients(*above, *grid, *level.rotations(), level.grid());
        }
        level.assemble(merged_);
        level.estimate_spectrum();
        merge(merged_, level.grid(), l + 1 < levels_.size() ? levels_[l + 1]->grid() : direct_->grid());
        merged_.swap(merged_next_);
        above = level.rotations();
        grid = &level.grid();
    }
    direct_->assemble(merged_);
    if (rotations_) {
        find_rotations(potential);
    }
    fine_->estimate_spectrum();
}

template <class T>
std::vector<T> Multigrid<T>::memory() const {
    std::vector<T> values;
    if (fine_) {
        values.resize(3 * body_->node_count());
        body_->read(fine_->guess.field, 1, VectorField<T>::aos(values.data(), body_->node_count()));
    }
    return values;
}

template <class T>
void Multigrid<T>::set_memory(const VectorSpace<T>& space, std::span<const T> values) {
    fine_ = std::make_unique<FineLevel>(*this, space);
    body_->write(VectorField<const T>::aos(values.data(), body_->node_count()), 1, fine_->guess.field);
    fine_->highest = 1; // there was an estimate
}

template <class T>
void Multigrid<T>::cycle(std::size_t l) {
    if (l == levels_.size()) {
        direct_->solve(direct_->right_side, direct_->solution);
        return;
    }
    CoarseLevel& level = *levels_[l];
    level.smooth(true, level.right_side, level.solution, degree_, low_part_);
    level.residual(level.right_side, level.solution, level.rest);
    const bool last = l + 1 == levels_.size();
    const PaddedGrid& coarse = last ? direct_->grid() : levels_[l + 1]->grid();
    restrict_to(level.grid(), level.rest, coarse, last ? direct_->right_side : levels_[l + 1]->right_side, *workers_);
    cycle(l + 1);
    add_prolonged(coarse, last ? direct_->solution : levels_[l + 1]->solution, level.grid(), level.solution, *workers_);
    level.smooth(false, level.right_side, level.solution, degree_, low_part_);
}

template <class T>
void Multigrid<T>::apply(const NodeVector<T>& r, NodeVector<T>& z) {
    const ChebyshevInterval interval = {degree_, low_part_ * fine_->highest, fine_->highest};
    chebyshev(*fine_, interval, true, r, z, fine_->chebyshev);
    fine_->multiply(z, fine_->residual);
    fine_->for_each([](const T& from, T& to) { to = from - to; }, r, fine_->residual);
    fine_->gather(fine_->residual, grid_in_);
    const PaddedGrid& coarse = levels_.empty() ? direct_->grid() : levels_[0]->grid();
    restrict_to(grid_, grid_in_, coarse, levels_.empty() ? direct_->right_side : levels_[0]->right_side, *workers_);
    cycle(0);
    grid_out_.clear();
    add_prolonged(coarse, levels_.empty() ? direct_->solution : levels_[0]->solution, grid_, grid_out_, *workers_);
    fine_->scatter_add(grid_out_, z);
    chebyshev(*fine_, interval, false, r, z, fine_->chebyshev);
}

template class Multigrid<float>;
template class Multigrid<double>;

} // namespace hybmss
