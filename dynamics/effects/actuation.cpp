#include "dynamics/effects/actuation.hpp"

#include "dynamics/explicit_dynamics_implementation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

void check_stretches(std::span<const RestStretch> stretches, std::size_t cells) {
    if (stretches.size() != cells) {
        throw std::invalid_argument(std::to_string(stretches.size()) + " stretches given for " + std::to_string(cells) +
                                    " actuated cells: there must be as many");
    }
    for (std::size_t c = 0; c < cells; ++c) {
        for (const double s : stretches[c]) {
            if (!(s >= kLeastRestStretch && s <= kMostRestStretch)) {
                throw std::invalid_argument("stretch of actuated cell " + std::to_string(c) + " = " +
                                            std::to_string(s) + " is not allowed: it must be in [" +
                                            std::to_string(kLeastRestStretch) + ", " +
                                            std::to_string(kMostRestStretch) + "]");
            }
        }
    }
}

template <class T>
kernels::ActuationLaw<T> law_of(const Material& material, double edge) {
    const double unit = shear_modulus(material) * edge;
    const SpringConstants k = spring_constants(material, edge);
    const PatternConstants patterns = pattern_constants(material, edge);
    const bool means = material.springs == SpringForm::means;
    const CrushResistance& crush = material.crush;
    const auto number = [](double value) { return static_cast<T>(value); };
    kernels::ActuationLaw<T> law{};
    law.edge = number(k.edge / unit / (means ? 1 : 4));
    law.face = number(k.face_diagonal / unit / (means ? 1 : 2));
    law.cube = number(k.cube_diagonal / unit);
    law.quadratic = number(material.stiffening.quadratic);
    law.cubic = number(material.stiffening.cubic);
    law.crush = number(crush.stiffness / (crush.ratio * crush.ratio));
    law.crush_ratio = number(crush.ratio);
    law.bending = number(patterns.bending / unit);
    law.coupling = number(patterns.coupling);
    law.twist = number(patterns.twist / unit);
    law.joint_twist = number(patterns.joint_twist / unit);
    law.fourth = number(patterns.fourth / unit);
    return law;
}

} // namespace

template <class T>
ActuatedBody<T>::ActuatedBody(const Body<T>& body, const Lattice& lattice, const Material& material,
                              std::span<const std::uint32_t> cells, std::span<const RestStretch> stretches)
    : table_(&body.kernel_table()), means_(material.springs == SpringForm::means), edge_(lattice.cell_size()),
      length_unit_(body.length_unit()), cells_{}, padded_(0), grid_(cells.begin(), cells.end()) {
    validate(lattice, material);
    check_stretches(stretches, cells.size());
    const NodeNumbers numbers(lattice, body.node_count());
    std::vector<std::uint32_t> sorted = grid_;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t c = 0; c < sorted.size(); ++c) {
        const std::string name = "actuated cell " + std::to_string(sorted[c]);
        if (sorted[c] >= lattice.cell_scales().size()) {
            throw std::invalid_argument(name + ": its index must be below the grid's " +
                                        std::to_string(lattice.cell_scales().size()) + " cells");
        }
        if (!(lattice.cell_scales()[sorted[c]] > 0)) {
            throw std::invalid_argument(name + ": the lattice has no cell there");
        }
        if (c > 0 && sorted[c] == sorted[c - 1]) {
            throw std::invalid_argument(name + ": it is given twice");
        }
    }

    constexpr std::size_t kWidth = kernels::kMaxWidth;
    padded_ = (grid_.size() + kWidth - 1) / kWidth * kWidth;
    corners_.assign(8 * padded_, 0);
    values_.assign(5 * padded_, T(1));
    std::fill_n(values_.begin(), padded_, T(0));
    const auto& count = lattice.cells();
    const auto nx = static_cast<std::size_t>(count[0]), ny = static_cast<std::size_t>(count[1]);
    std::vector<std::uint32_t> nodes(8 * grid_.size());
    bool both_signs[2] = {false, false};
    const double unit = shear_modulus(material) * edge_ * edge_;
    for (std::size_t c = 0; c < grid_.size(); ++c) {
        const std::size_t x = grid_[c] % nx, y = grid_[c] / nx % ny, z = grid_[c] / (nx * ny);
        for (std::size_t corner = 0; corner < 8; ++corner) {
            const std::size_t at =
                (x + (corner & 1)) + (nx + 1) * ((y + (corner >> 1 & 1)) + (ny + 1) * (z + (corner >> 2)));
            nodes[8 * c + corner] = numbers.of(at);
        }
        const Material own = material_of(lattice, lattice.cell_tissue(grid_[c]), material);
        const double kappa = resolved_volume_energy(own) == VolumeEnergy::none ? 0 : volume_modulus(own);
        both_signs[kappa < 0 ? 1 : 0] = true;
        values_[c] = static_cast<T>(unit * static_cast<double>(lattice.cell_scales()[grid_[c]]));
        values_[padded_ + c] = static_cast<T>(kappa / shear_modulus(own));
    }
    cells_.law = law_of<T>(material, edge_);
    cells_.law.by_sign = material.volume_energy == VolumeEnergy::automatic && both_signs[0];
    cells_.law.mean_stretch = material.volume_energy == VolumeEnergy::mean_stretch ||
                              (material.volume_energy == VolumeEnergy::automatic && both_signs[1]);
    cells_.count = static_cast<kernels::Range>(padded_);
    cells_.by_edge = static_cast<T>(length_unit_ / edge_);

    numbers_ = nodes;
    std::sort(numbers_.begin(), numbers_.end());
    numbers_.erase(std::unique(numbers_.begin(), numbers_.end()), numbers_.end());
    first_use_.assign(numbers_.size() + 1, 0);
    for (std::uint32_t& node : nodes) {
        node = static_cast<std::uint32_t>(std::lower_bound(numbers_.begin(), numbers_.end(), node) - numbers_.begin());
        ++first_use_[node + 1];
    }
    std::partial_sum(first_use_.begin(), first_use_.end(), first_use_.begin());
    for (const std::uint32_t number : numbers_) {
        places_.push_back(body.index_of(number));
    }
    // Of the arrays of a body's fields: packed, or one a component.
    const std::size_t stride = array_count(body.make_state(false).displacement) == 1 ? 4 : 1;
    std::vector<std::uint32_t> next = first_use_;
    uses_.resize(nodes.size());
    for (std::uint32_t use = 0; use < nodes.size(); ++use) {
        uses_[next[nodes[use]]++] = use;
        corners_[(use % 8) * padded_ + use / 8] = static_cast<std::uint32_t>(places_[nodes[use]] * stride);
    }
    for (std::size_t corner = 0; corner < 8 && !grid_.empty(); ++corner) {
        // Those at the end lie somewhere in the body.
        std::fill_n(corners_.begin() + static_cast<std::ptrdiff_t>(corner * padded_ + grid_.size()),
                    padded_ - grid_.size(), corners_[corner * padded_]);
    }
    result_.resize(8 * 3 * padded_);
    set(stretches);
}

template <class T>
void ActuatedBody<T>::set(std::span<const RestStretch> stretches) {
    check_stretches(stretches, grid_.size());
    given_.assign(stretches.begin(), stretches.end());
    for (std::size_t c = 0; c < given_.size(); ++c) {
        for (std::size_t a = 0; a < 3; ++a) {
            values_[(2 + a) * padded_ + c] = static_cast<T>(given_[c][a]);
        }
    }
}

template <class T>
std::size_t ActuatedBody<T>::bytes() const {
    return (values_.size() + result_.size()) * sizeof(T) + given_.size() * sizeof(RestStretch) +
           (grid_.size() + corners_.size() + numbers_.size() + first_use_.size() + uses_.size()) *
               sizeof(std::uint32_t) +
           places_.size() * sizeof(std::size_t);
}

template <class T>
double ActuatedBody<T>::greatest_stiffening() const {
    double greatest = 1;
    for (const RestStretch& s : given_) {
        const double least = *std::min_element(s.begin(), s.end());
        greatest = std::max(greatest, s[0] * s[1] * s[2] / (least * least));
    }
    return greatest;
}

template <class T>
void ActuatedBody<T>::cut(const Lattice& lattice, std::span<const CutNode> nodes) {
    for (const CutNode& node : nodes) {
        const auto found = std::lower_bound(numbers_.begin(), numbers_.end(), node.node);
        if (found == numbers_.end() || *found != node.node) {
            continue;
        }
        const auto n = static_cast<std::size_t>(found - numbers_.begin());
        for (std::uint32_t use = first_use_[n]; use < first_use_[n + 1]; ++use) {
            const std::size_t cell = uses_[use] / 8;
            values_[cell] = lattice.cell_scales()[grid_[cell]] > 0 ? values_[cell] : T(0);
        }
    }
}

template <class T>
kernels::ActuatedCells<T> ActuatedBody<T>::arguments(const State<T>& state, const NodeField<T>* direction) const {
    kernels::ActuatedCells<T> cells = cells_;
    for (std::size_t c = 0; c < 8; ++c) {
        cells.place[c] = corners_.data() + c * padded_;
    }
    cells.weight = values_.data();
    cells.kappa = values_.data() + padded_;
    for (std::size_t a = 0; a < 3; ++a) {
        cells.stretch[a] = values_.data() + (2 + a) * padded_;
        cells.displacement[a] = component(state.displacement, a).first;
        cells.direction[a] = direction ? component(*direction, a).first : nullptr;
    }
    return cells;
}

template <class T>
std::array<double, 3> ActuatedBody<T>::gathered(std::size_t node, std::size_t of_corner,
                                                std::array<std::size_t, 3> entries) const {
    std::array<double, 3> sum = {0, 0, 0};
    for (std::uint32_t use = first_use_[node]; use < first_use_[node + 1]; ++use) {
        const T* const of_cell = result_.data() + of_corner * (uses_[use] % 8) * padded_ + uses_[use] / 8;
        for (std::size_t e = 0; e < 3; ++e) {
            sum[e] += static_cast<double>(of_cell[entries[e] * padded_]);
        }
    }
    return sum;
}

template <class T>
double ActuatedBody<T>::energy(const State<T>& state) const {
    return edge_ * table_->actuated_energy(means_)(arguments(state, nullptr), 0, cells_.count);
}

template <class T>
Stage ActuatedBody<T>::stage(Kernel* kernel, const State<T>& state, const NodeField<T>* direction) const {
    kernels::ActuatedCells<T> cells = arguments(state, direction);
    cells.result = result_.data();
    return {pieces(padded_), [this, kernel, cells](std::size_t piece, std::size_t) {
                kernel(cells, static_cast<kernels::Range>(piece * kPiece),
                       static_cast<kernels::Range>(std::min((piece + 1) * kPiece, padded_)));
            }};
}

template <class T>
void ActuatedBody<T>::add_stages(const State<T>& state, std::vector<Stage>& stages) const {
    stages.push_back(stage(table_->actuated_cells(means_), state, nullptr));
}

template <class T>
void ActuatedBody<T>::add_gathered(const Body<T>& body, double factor, NodeField<T>& field) const {
    const std::array<Component<T>, 3> to = {component(field, 0), component(field, 1), component(field, 2)};
    body.workers().run(pieces(places_.size()), [&](std::size_t piece, std::size_t) {
        for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, places_.size()); ++n) {
            const std::array<double, 3> sum = force_at(n);
            for (std::size_t a = 0; a < 3; ++a) {
                to[a].first[static_cast<std::ptrdiff_t>(places_[n]) * to[a].stride] += static_cast<T>(factor * sum[a]);
            }
        }
    });
}

template <class T>
void ActuatedBody<T>::add_forces(const Body<T>& body, const State<T>& state, double factor, NodeField<T>& field) const {
    std::vector<Stage> stages;
    add_stages(state, stages);
    body.workers().run(stages, 1);
    add_gathered(body, factor, field);
}

template <class T>
void ActuatedBody<T>::add_product(const Body<T>& body, const State<T>& state, const NodeField<T>& direction,
                                  NodeField<T>& product) const {
    const std::vector<Stage> stages = {stage(table_->actuated_product(means_), state, &direction)};
    body.workers().run(stages, 1);
    add_gathered(body, -1, product);
}

template <class T>
void ActuatedBody<T>::add_diagonal(const Body<T>& body, const State<T>& state, AlignedArray<T> (&blocks)[6]) const {
    result_.resize(8 * 6 * padded_);
    const std::vector<Stage> stages = {stage(table_->actuated_diagonal(means_), state, nullptr)};
    body.workers().run(stages, 1);
    const double factor = -length_unit_ / edge_;
    for (std::size_t n = 0; n < places_.size(); ++n) {
        for (const std::size_t first : {0u, 3u}) {
            const std::array<double, 3> sum = gathered(n, 6, {first, first + 1, first + 2});
            for (std::size_t e = 0; e < 3; ++e) {
                blocks[first + e][places_[n]] += static_cast<T>(factor * sum[e]);
            }
        }
    }
}

template <class T>
void Actuation<T>::set(const State<T>& state, std::span<const RestStretch> stretches) {
    const double before = cells_.energy(state);
    cells_.set(stretches);
    put_in_ += cells_.energy(state) - before;
}

template <class T>
void Actuation<T>::narrow(StepBounds& bounds) const {
    const double factor = cells_.greatest_stiffening();
    bounds.frequencies.body *= factor;
    bounds.frequencies.crushed *= factor;
}

template <class T>
void Actuation<T>::add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                              std::vector<Stage>& stages) {
    cells_.add_stages(state, stages);
    const std::array<Component<T>, 3> v = {component(state.velocity, 0), component(state.velocity, 1),
                                           component(state.velocity, 2)};
    constexpr std::size_t kNodes = 128; // a piece
    const std::size_t count = cells_.places().size();
    stages.push_back(
        {(count + kNodes - 1) / kNodes, [this, v, count, kick = factors.kick,
                                         inverse_mass = body.inverse_masses().data()](std::size_t piece, std::size_t) {
             for (std::size_t n = piece * kNodes; n < std::min((piece + 1) * kNodes, count); ++n) {
                 const std::array<double, 3> force = cells_.force_at(n);
                 for (std::size_t a = 0; a < 3; ++a) {
                     const auto at = static_cast<std::ptrdiff_t>(cells_.places()[n]) * v[a].stride;
                     v[a].first[at] += static_cast<T>(kick * force[a] * static_cast<double>(inverse_mass[at]));
                 }
             }
         }});
}

template <class T>
void ExplicitDynamics<T>::actuate(const Lattice& lattice, const Material& material,
                                  std::span<const std::uint32_t> cells, std::span<const RestStretch> stretches) {
    Implementation& i = *implementation_;
    auto effect = std::make_unique<Actuation<T>>(*i.body, lattice, material, cells, stretches);
    effect->start(i.state);
    i.template replace<Actuation<T>>(cells.empty() ? nullptr : std::move(effect));
}

template <class T>
void ExplicitDynamics<T>::set_rest_stretches(std::span<const RestStretch> stretches) {
    Implementation& i = *implementation_;
    auto* const actuation = i.template find<Actuation<T>>();
    check_stretches(stretches, actuation ? actuation->stretches().size() : 0);
    if (actuation && !std::equal(stretches.begin(), stretches.end(), actuation->stretches().begin())) {
        i.complete();
        actuation->set(i.state, stretches);
    }
}

template class ActuatedBody<float>;
template class ActuatedBody<double>;
template class Actuation<float>;
template class Actuation<double>;
template void ExplicitDynamics<float>::actuate(const Lattice&, const Material&, std::span<const std::uint32_t>,
                                               std::span<const RestStretch>);
template void ExplicitDynamics<double>::actuate(const Lattice&, const Material&, std::span<const std::uint32_t>,
                                                std::span<const RestStretch>);
template void ExplicitDynamics<float>::set_rest_stretches(std::span<const RestStretch>);
template void ExplicitDynamics<double>::set_rest_stretches(std::span<const RestStretch>);

} // namespace hybmss
