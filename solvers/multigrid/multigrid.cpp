#include "solvers/multigrid/multigrid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace hybmss {
namespace {

/// Ratios of the volume's modulus to the shear modulus above which the smoother does more (nu = 0.4), and smooths the
/// cells' rotations too (nu = 0.495), which doubles what a term costs.
constexpr double kStiffVolume = 3, kStiffRotations = 100;
/// Levels of at most so many nodes are solved directly.
constexpr std::size_t kDirectNodes = 40;

/// Three terms; two more with each digit of the volume's stiffness, which slows the smoother down.
int smoother_degree(double ratio) {
    return std::max(3, 2 + static_cast<int>(std::ceil(2 * std::log10(std::max(ratio, kStiffVolume) / kStiffVolume))));
}

} // namespace

/// The finest level as chebyshev() sees it.
struct Multigrid::FineLevel {
    FineLevel(Multigrid& owner, const VectorSpace<float>& vectors)
        : multigrid(&owner), space(&vectors), residual(vectors.make()),
          guess(vectors.make()), chebyshev{vectors.make(), vectors.make(), vectors.make()} {}

    void multiply(const NodeVector<float>& p, NodeVector<float>& out) {
        if (multigrid->rotations_) {
            multiply_free(p, out);
        } else {
            potential->multiply_body(p, out, Curvature::convex);
        }
    }
    /// With the pull, and zero on held components.
    void multiply_free(const NodeVector<float>& p, NodeVector<float>& out) {
        potential->multiply(p, out, Curvature::convex);
    }
    void precondition(const NodeVector<float>& r, NodeVector<float>& z) {
        multigrid->blocks_.apply(r, z);
        if (multigrid->rotations_) {
            multigrid->gather(r.field, multigrid->grid_in_);
            multigrid->grid_out_.clear();
            multigrid->rotations_->add_correction(multigrid->grid_in_, multigrid->grid_out_, *multigrid->workers_);
            if (multigrid->shared_) {
                multigrid->shared_->add_up(multigrid->grid_out_.c);
            }
            multigrid->scatter_add(multigrid->grid_out_, potential->free(), z);
        }
    }
    void correct(const NodeVector<float>& from, const NodeVector<float>* product, double keep, double add,
                 ChebyshevVectors<NodeVector<float>>& vectors, NodeVector<float>& x) {
        auto& [r, d, z] = vectors;
        if (!multigrid->rotations_) {
            multigrid->blocks_.correct(from, product, keep, add, r, d, x); // which adds the pull, and masks
            return;
        }
        if (product) {
            space->for_each([](const float& b, const float& p, float& rest) { rest = b - p; }, from, *product, r);
        } else {
            space->copy(from, r);
        }
        precondition(r, z);
        const auto k = static_cast<float>(keep), a = static_cast<float>(add);
        space->for_each(
            [k, a, first = product == nullptr](const float& by, float& step, float& to) {
                step = k == 0 ? a * by : k * step + a * by;
                to = first ? step : to + step;
            },
            z, d, x);
    }

    /// The largest eigenvalue of B K by power iteration; starts from where the last call ended.
    void estimate_spectrum() {
        int iterations = 3;
        if (highest == 0) {
            iterations = 10;
            unsigned state = 1;
            for (std::size_t c = 0; c < 3; ++c) {
                for (float& x : multigrid->grid_out_.c[c]) {
                    state = state * 1664525u + 1013904223u;
                    x = static_cast<float>(state >> 8) / 8388608.0f - 1.0f;
                }
            }
            multigrid->scatter_add(multigrid->grid_out_, potential->free(), guess);
            potential->add_up(guess);
        }
        space->for_each([](const float& free, float& x) { x *= free; }, potential->free(), guess);
        double before = std::sqrt(space->dot(guess, guess)), size = 1;
        for (int i = 0; i < iterations && before > 0; ++i) {
            multiply_free(guess, residual);
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
    double highest = 0;
};

Multigrid::Multigrid(const Body<float>& body, const Lattice& lattice, const Material& material, const Ranks* ranks)
    : body_(&body), workers_(&body.workers()), stiffness_(lattice, material), grid_{lattice.cells()},
      unit_(body.length_unit() / lattice.cell_size()),
      scales_(lattice.cell_scales().begin(), lattice.cell_scales().end()), tissues_(scales_.size()),
      fills_(lattice.fills().begin(), lattice.fills().end()), node_at_(grid_.size(), kNoNode),
      touching_(body.node_count(), 0.0f), patterns_(stiffness_.on_means()), gradients_(grid_), grid_in_(grid_),
      grid_out_(grid_), most_terms_(smoother_degree(volume_to_shear(lattice, material))),
      stiff_volume_(volume_to_shear(lattice, material) > kStiffVolume) {
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
    for (std::size_t cell = 0; cell < tissues_.size(); ++cell) {
        tissues_[cell] = static_cast<std::uint8_t>(lattice.cell_tissue(cell));
    }
    std::size_t cell = 0;
    for_each_place({0, 0, 0}, {nx - 1, ny - 1, nz - 1}, [&](int i, int j, int k) {
        const float cells = mass_of(cell);
        if (scales_[cell++] > 0) {
            gradients_.present()[grid_.index(i, j, k)] = 1;
            for (std::size_t corner = 0; corner < 8; ++corner) {
                touching_[node_at_[grid_.index(i, j, k) + grid_.corner_offset(corner)]] += cells;
            }
        }
    });
    const Ranks* const others = ranks && !ranks->box().alone() ? ranks : nullptr;
    if (others) {
        shared_.emplace(grid_, *others, [&](std::size_t index) { return node_at_[index] != kNoNode; });
    }
    const bool stiff = volume_to_shear(lattice, material) > kStiffRotations;
    if (stiff) {
        rotations_.emplace(gradients_, body.kernel_table(), shared_ ? &*shared_ : nullptr);
        find_rest_rotations();
    }
    find_runs();
    cells_.emplace_back(gradients_);
    RankBox box{{0, 0, 0}, grid_.cells, {}, std::numeric_limits<int>::max()};
    box = (others ? others->box() : box).merged();
    PaddedGrid coarse = coarsened(grid_);
    for (; PaddedGrid{box.whole}.node_count() > kDirectNodes && box.halvings > 0; box = box.merged()) {
        levels_.push_back(std::make_unique<CoarseLevel>(coarse, stiff, body, others));
        cells_.emplace_back(levels_.back()->gradients());
        coarse = coarsened(coarse);
    }
    direct_ = std::make_unique<DirectLevel>(coarse, box, others);
    cells_.emplace_back(direct_->gradients());
}
Multigrid::~Multigrid() = default;

void Multigrid::update(const Potential<float>& potential) {
    if (!fine_) {
        fine_ = std::make_unique<FineLevel>(*this, potential.space());
    }
    fine_->potential = &potential;
    // In a step of time masses hold the nodes besides: a term less takes less time.
    degree_ = potential.pull_weight() ? most_terms_ - 1 : most_terms_;
    low_part_ = (stiff_volume_ ? 0.5 : 1.0) / (degree_ * degree_);
    blocks_.update(potential);
    const auto& held = potential.held();
    if (!std::equal(held_.begin(), held_.end(), held.begin(), held.end())) {
        find_patterns(held);
    }
    find_gradients(potential);
    find_touches(potential);
    assemble(potential);
    for (const auto& level : levels_) {
        level->estimate_spectrum();
    }
    if (rotations_) {
        gather(potential.free().field, grid_in_);
        find_rotations();
    }
    fine_->estimate_spectrum();
}

void Multigrid::find_runs() {
    for (std::size_t n = 0; n < node_at_.size(); ++n) {
        if (node_at_[n] == kNoNode) {
            continue;
        }
        const std::size_t place = places_[node_at_[n]];
        if (!runs_.empty() && runs_.back().grid + runs_.back().length == n &&
            runs_.back().place + runs_.back().length == place) {
            ++runs_.back().length;
        } else {
            runs_.push_back({n, place, 1});
        }
    }
}

template <class Visit>
void Multigrid::for_each_run(const Visit& visit) const {
    constexpr std::size_t kPiece = 64;
    workers_->run((runs_.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
        for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, runs_.size()); ++n) {
            visit(runs_[n]);
        }
    });
}

void Multigrid::gather(const NodeField<float>& from, GridVector& to) const {
    for_each_run([&](const Run& run) {
        for (std::size_t c = 0; c < 3; ++c) {
            const Component<const float> all = component(from, c);
            const float* x = all.first + static_cast<std::ptrdiff_t>(run.place) * all.stride;
            if (all.stride == 1) {
                std::copy_n(x, run.length, to.c[c].data() + run.grid);
                continue;
            }
            for (std::size_t n = 0; n < run.length; ++n) {
                to.c[c][run.grid + n] = x[static_cast<std::ptrdiff_t>(n) * all.stride];
            }
        }
    });
}

void Multigrid::scatter_add(const GridVector& from, const NodeVector<float>& free, NodeVector<float>& to) const {
    for_each_run([&](const Run& run) {
        for (std::size_t c = 0; c < 3; ++c) {
            const Component<float> all = component(to.field, c);
            const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(run.place) * all.stride;
            const float *is_free = component(free.field, c).first + first, *x = from.c[c].data() + run.grid;
            float* sum = all.first + first;
            if (all.stride == 1) {
                for (std::size_t n = 0; n < run.length; ++n) {
                    sum[n] += is_free[n] * x[n];
                }
                continue;
            }
            for (std::size_t n = 0; n < run.length; ++n) {
                const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(n) * all.stride;
                sum[at] += is_free[at] * x[n];
            }
        }
    });
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

void Multigrid::restrict_to_level(const PaddedGrid& fine, const SharedGrid* shared, GridVector& rest, std::size_t l) {
    const bool last = l == levels_.size();
    if (shared) {
        shared->clear_counted_elsewhere(rest);
    }
    restrict_to(fine, rest, last ? direct_->grid() : levels_[l]->grid(),
                last ? direct_->right_side : levels_[l]->right_side, *workers_);
    if (shared && !last) {
        levels_[l]->shared()->add_up(levels_[l]->right_side.c);
    }
}

void Multigrid::cycle(std::size_t l) {
    if (l == levels_.size()) {
        direct_->solve(direct_->right_side, direct_->solution);
        return;
    }
    CoarseLevel& level = *levels_[l];
    level.smooth(true, level.right_side, level.solution, degree_, low_part_);
    level.residual(level.right_side, level.solution, level.rest);
    restrict_to_level(level.grid(), level.shared(), level.rest, l + 1);
    cycle(l + 1);
    const bool last = l + 1 == levels_.size();
    const PaddedGrid& coarse = last ? direct_->grid() : levels_[l + 1]->grid();
    add_prolonged(coarse, last ? direct_->solution : levels_[l + 1]->solution, level.grid(), level.solution, *workers_);
    level.smooth(false, level.right_side, level.solution, degree_, low_part_);
}

void Multigrid::apply(const NodeVector<float>& r, NodeVector<float>& z) {
    const ChebyshevInterval interval = {degree_, low_part_ * fine_->highest, fine_->highest};
    chebyshev(*fine_, interval, true, r, z, fine_->chebyshev);
    fine_->multiply_free(z, fine_->residual);
    fine_->space->for_each([](const float& from, float& to) { to = from - to; }, r, fine_->residual);
    gather(fine_->residual.field, grid_in_);
    restrict_to_level(grid_, shared_ ? &*shared_ : nullptr, grid_in_, 0);
    cycle(0);
    const PaddedGrid& coarse = levels_.empty() ? direct_->grid() : levels_[0]->grid();
    grid_out_.clear();
    add_prolonged(coarse, levels_.empty() ? direct_->solution : levels_[0]->solution, grid_, grid_out_, *workers_);
    scatter_add(grid_out_, fine_->potential->free(), z);
    chebyshev(*fine_, interval, false, r, z, fine_->chebyshev);
}

} // namespace hybmss
