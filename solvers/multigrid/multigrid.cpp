#include "solvers/multigrid/multigrid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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

/// The finest level as chebyshev() sees it.
struct Multigrid::FineLevel {
    FineLevel(Multigrid& owner, const VectorSpace<float>& vectors)
        : multigrid(&owner), space(&vectors), residual(vectors.make()),
          guess(vectors.make()), chebyshev{vectors.make(), vectors.make(), vectors.make()} {
        for (std::size_t n = 0; n < owner.node_at_.size(); ++n) {
            if (const std::uint32_t node = owner.node_at_[n]; node != Multigrid::kNoNode) {
                Node entry{n, {}};
                const std::size_t place = owner.places_[node];
                for (std::size_t c = 0; c < 3; ++c) {
                    const Component<const float> all = component(std::as_const(residual.field), c);
                    entry.places[c] = place * static_cast<std::size_t>(all.stride);
                }
                nodes.push_back(entry);
            }
        }
    }

    void multiply(const NodeVector<float>& p, NodeVector<float>& out) { potential->multiply(p, out); }
    void precondition(const NodeVector<float>& r, NodeVector<float>& z) {
        multigrid->blocks_.apply(r, z);
        if (multigrid->rotations_) {
            gather(r, multigrid->grid_in_);
            multigrid->grid_out_.clear();
            multigrid->rotations_->add_correction(multigrid->grid_in_, multigrid->grid_out_, *multigrid->workers_);
            scatter_add(multigrid->grid_out_, z);
        }
    }
    template <class Map, class... Vectors>
    void for_each(const Map& map, Vectors&... vectors) const {
        space->for_each(map, vectors...);
    }

    static constexpr std::size_t kPiece = 4096;
    template <class Visit>
    void for_each_node(const Visit& visit) const {
        multigrid->workers_->run((nodes.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
            for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, nodes.size()); ++n) {
                visit(nodes[n]);
            }
        });
    }
    void gather(const NodeVector<float>& from, GridVector& to) const {
        const float* x[3];
        for (std::size_t c = 0; c < 3; ++c) {
            x[c] = component(from.field, c).first;
        }
        for_each_node([&](const Node& node) {
            for (std::size_t c = 0; c < 3; ++c) {
                to.c[c][node.grid] = static_cast<float>(x[c][node.places[c]]);
            }
        });
    }
    /// to += from on free components.
    void scatter_add(const GridVector& from, NodeVector<float>& to) const {
        float* x[3];
        const float* free[3];
        for (std::size_t c = 0; c < 3; ++c) {
            x[c] = component(to.field, c).first;
            free[c] = component(potential->free().field, c).first;
        }
        for_each_node([&](const Node& node) {
            for (std::size_t c = 0; c < 3; ++c) {
                x[c][node.places[c]] += free[c][node.places[c]] * static_cast<float>(from.c[c][node.grid]);
            }
        });
    }

    /// The largest eigenvalue of B K by power iteration; starts from where the last call ended.
    void estimate_spectrum() {
        int iterations = 5;
        if (highest == 0) {
            iterations = 15;
            unsigned state = 1;
            for (const Node& node : nodes) {
                for (std::size_t c = 0; c < 3; ++c) {
                    state = state * 1664525u + 1013904223u;
                    component(guess.field, c).first[node.places[c]] =
                        static_cast<float>(static_cast<float>(state >> 8) / 8388608.0f - 1.0f);
                }
            }
        }
        space->for_each([](const float& free, float& x) { x *= free; }, potential->free(), guess);
        double before = std::sqrt(space->dot(guess, guess)), size = 1;
        for (int i = 0; i < iterations && before > 0; ++i) {
            multiply(guess, residual);
            precondition(residual, guess);
            const double after = std::sqrt(space->dot(guess, guess));
            size = after / before;
            const float scale = static_cast<float>(after > 0 ? 1 / after : 0);
            space->for_each([scale](float& x) { x *= scale; }, guess);
            before = after > 0 ? 1 : 0;
        }
        highest = 1.2 * size;
    }

    Multigrid* multigrid;
    const VectorSpace<float>* space;
    const Potential<float>* potential = nullptr;
    NodeVector<float> residual, guess;
    ChebyshevVectors<NodeVector<float>> chebyshev;
    std::vector<Node> nodes;
    double highest = 0;
};

Multigrid::Multigrid(const Body<float>& body, const Lattice& lattice, const Material& material)
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
Multigrid::~Multigrid() = default;

void Multigrid::update(const Potential<float>& potential) {
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

std::vector<float> Multigrid::memory() const {
    std::vector<float> values;
    if (fine_) {
        values.resize(3 * body_->node_count());
        body_->read(fine_->guess.field, 1, VectorField<float>::aos(values.data(), body_->node_count()));
    }
    return values;
}

void Multigrid::set_memory(const VectorSpace<float>& space, std::span<const float> values) {
    fine_ = std::make_unique<FineLevel>(*this, space);
    body_->write(VectorField<const float>::aos(values.data(), body_->node_count()), 1, fine_->guess.field);
    fine_->highest = 1; // there was an estimate
}

void Multigrid::cycle(std::size_t l) {
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

void Multigrid::apply(const NodeVector<float>& r, NodeVector<float>& z) {
    const ChebyshevInterval interval = {degree_, low_part_ * fine_->highest, fine_->highest};
    chebyshev(*fine_, interval, true, r, z, fine_->chebyshev);
    fine_->multiply(z, fine_->residual);
    fine_->for_each([](const float& from, float& to) { to = from - to; }, r, fine_->residual);
    fine_->gather(fine_->residual, grid_in_);
    const PaddedGrid& coarse = levels_.empty() ? direct_->grid() : levels_[0]->grid();
    restrict_to(grid_, grid_in_, coarse, levels_.empty() ? direct_->right_side : levels_[0]->right_side, *workers_);
    cycle(0);
    grid_out_.clear();
    add_prolonged(coarse, levels_.empty() ? direct_->solution : levels_[0]->solution, grid_, grid_out_, *workers_);
    fine_->scatter_add(grid_out_, z);
    chebyshev(*fine_, interval, false, r, z, fine_->chebyshev);
}

} // namespace hybmss
