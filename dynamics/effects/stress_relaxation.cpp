#include "dynamics/effects/stress_relaxation.hpp"

#include "dynamics/explicit_dynamics_implementation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

void check_branches(std::span<const Relaxation> branches) {
    if (branches.size() > 4) {
        throw std::invalid_argument(std::to_string(branches.size()) +
                                    " branches of relaxation given: four at most are allowed");
    }
    for (const Relaxation& branch : branches) {
        if (!(branch.part > 0 && branch.part <= 1e6 && branch.time > 0 && std::isfinite(branch.time))) {
            throw std::invalid_argument("relaxation of the part " + std::to_string(branch.part) + " and the time " +
                                        std::to_string(branch.time) +
                                        " s is not allowed: part must be above 0 and at most 1e6, time above 0 and "
                                        "finite");
        }
    }
}

/// The integral of (1 - e^-s)^2 from 0 to x, over x^2.
double of_new_strain(double x) {
    if (x < 0.02) { // where the closed form would cancel
        return x * (1.0 / 3 + x * (-1.0 / 4 + x * (7.0 / 60 + x * (-1.0 / 24 + x * 31.0 / 2520))));
    }
    return (x + 2 * std::expm1(-x) - std::expm1(-2 * x) / 2) / (x * x);
}

} // namespace

template <class T>
StressRelaxation<T>::StressRelaxation(const Body<T>& body, State<T>& state, const Lattice& lattice,
                                      const Material& material, std::span<const Relaxation> branches)
    : by_edge_(body.length_unit() / lattice.cell_size()), per_length_(1 / (4 * lattice.cell_size())),
      branches_(branches.begin(), branches.end()), places_(body.node_count()), first_use_(body.node_count() + 1, 0) {
    check_branches(branches);
    validate(material);
    const NodeNumbers numbers(lattice, body.node_count());
    for (std::size_t n = 0; n < places_.size(); ++n) {
        places_[n] = body.index_of(n);
    }
    const double volume = std::pow(lattice.cell_size(), 3);
    std::vector<std::array<double, 2>> moduli;
    for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
        const Material own = material_of(lattice, tissue, material);
        const double shear = shear_modulus(own);
        // Without a volume energy springs make nu = 1/4.
        const bool springs_alone = resolved_volume_energy(own) == VolumeEnergy::none;
        moduli.push_back({shear * volume, (shear + (springs_alone ? 0 : volume_modulus(own))) * volume});
    }
    const std::vector<std::array<std::uint32_t, 8>> corners = cell_corners(lattice, numbers);
    for (std::uint32_t grid = 0; grid < lattice.cell_scales().size(); ++grid) {
        if (const auto scale = static_cast<double>(lattice.cell_scales()[grid]); scale > 0) {
            Cell& cell = cells_.emplace_back();
            const auto& nodes = corners[cells_.size() - 1];
            cell.grid = grid;
            cell.shear = scale * moduli[lattice.cell_tissue(grid)][0];
            cell.lame = scale * moduli[lattice.cell_tissue(grid)][1];
            for (std::size_t c = 0; c < 8; ++c) {
                cell.corners[c] = static_cast<std::uint32_t>(places_[nodes[c]]);
                ++first_use_[nodes[c] + 1];
            }
        }
    }
    std::partial_sum(first_use_.begin(), first_use_.end(), first_use_.begin());
    std::vector<std::uint32_t> next = first_use_;
    uses_.resize(8 * cells_.size());
    for (std::uint32_t c = 0; c < cells_.size(); ++c) {
        for (std::uint32_t corner = 0; corner < 8; ++corner) {
            uses_[next[corners[c][corner]]++] = 8 * c + corner;
        }
    }
    stresses_.resize(cells_.size());
    dissipated_.assign(pieces(cells_.size()), 0.0);
    strains_.assign(cells_.size() * (1 + branches_.size()), Strain{});
    const Components u = components(state.displacement);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        strains(c)[0] = strain(gradient(cells_[c], u));
    }
}

template <class T>
auto StressRelaxation<T>::components(const NodeField<T>& field) -> Components {
    return {component(field, 0), component(field, 1), component(field, 2)};
}

template <class T>
auto StressRelaxation<T>::courses() const -> std::vector<Course> {
    std::vector<Course> all;
    for (const Relaxation& branch : branches_) {
        const double x = elapsed_ / branch.time, gained = x > 0 ? -std::expm1(-x) / x : 1;
        all.push_back({std::exp(-x),
                       gained,
                       {branch.part * -std::expm1(-2 * x) / 2, branch.part * x * gained * gained,
                        branch.part * of_new_strain(x)}});
    }
    return all;
}

template <class T>
auto StressRelaxation<T>::gradient(const Cell& cell, const Components& displacement) const -> Gradient {
    Gradient h{};
    for (std::size_t a = 0; a < 3; ++a) {
        const auto& [first, stride] = displacement[a];
        double u[8];
        for (std::size_t c = 0; c < 8; ++c) {
            u[c] = static_cast<double>(first[static_cast<std::ptrdiff_t>(cell.corners[c]) * stride]);
        }
        const double factor = by_edge_ / 4;
        h[3 * a] = factor * ((u[1] - u[0]) + (u[3] - u[2]) + (u[5] - u[4]) + (u[7] - u[6]));
        h[3 * a + 1] = factor * ((u[2] - u[0]) + (u[3] - u[1]) + (u[6] - u[4]) + (u[7] - u[5]));
        h[3 * a + 2] = factor * ((u[4] - u[0]) + (u[5] - u[1]) + (u[6] - u[2]) + (u[7] - u[3]));
    }
    return h;
}

template <class T>
auto StressRelaxation<T>::strain(const Gradient& h) -> Strain {
    const auto entry = [&h](std::size_t i, std::size_t j) {
        return 0.5 * (h[3 * i + j] + h[3 * j + i] + h[i] * h[j] + h[3 + i] * h[3 + j] + h[6 + i] * h[6 + j]);
    };
    return {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(0, 2)};
}

template <class T>
double StressRelaxation<T>::product(const Cell& cell, const Strain& a, const Strain& b) {
    return cell.lame * (a[0] + a[1] + a[2]) * (b[0] + b[1] + b[2]) +
           2 * cell.shear * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]));
}

template <class T>
double StressRelaxation<T>::advance(const Cell& cell, std::span<const Course> courses, const Strain& now,
                                    std::span<Strain> strains) const {
    Strain change;
    for (std::size_t s = 0; s < 6; ++s) {
        change[s] = now[s] - strains[0][s];
    }
    double taken = 0;
    for (std::size_t b = 0; b < courses.size(); ++b) {
        Strain& own = strains[b + 1];
        const Course& course = courses[b];
        taken += course.dissipated[0] * product(cell, own, own) + course.dissipated[1] * product(cell, own, change) +
                 course.dissipated[2] * product(cell, change, change);
        for (std::size_t s = 0; s < 6; ++s) {
            own[s] = course.left * own[s] + course.gained * change[s];
        }
    }
    strains[0] = now;
    return taken;
}

template <class T>
auto StressRelaxation<T>::stress(const Cell& cell, const Gradient& h, std::span<const Strain> strains) const
    -> Gradient {
    Strain sum{};
    for (std::size_t b = 0; b < branches_.size(); ++b) {
        for (std::size_t s = 0; s < 6; ++s) {
            sum[s] += branches_[b].part * strains[b + 1][s];
        }
    }
    const double mean = cell.lame * (sum[0] + sum[1] + sum[2]), twice = 2 * cell.shear;
    const double xx = mean + twice * sum[0], yy = mean + twice * sum[1], zz = mean + twice * sum[2],
                 xy = twice * sum[3], yz = twice * sum[4], xz = twice * sum[5];
    Gradient p;
    for (std::size_t i = 0; i < 3; ++i) {
        const double x = h[3 * i] + (i == 0 ? 1 : 0), y = h[3 * i + 1] + (i == 1 ? 1 : 0),
                     z = h[3 * i + 2] + (i == 2 ? 1 : 0);
        p[3 * i] = x * xx + y * xy + z * xz;
        p[3 * i + 1] = x * xy + y * yy + z * yz;
        p[3 * i + 2] = x * xz + y * yz + z * zz;
    }
    return p;
}

template <class T>
std::array<double, 3> StressRelaxation<T>::gathered(std::size_t node, std::span<const Gradient> stresses) const {
    std::array<double, 3> force = {0, 0, 0};
    for (std::uint32_t use = first_use_[node]; use < first_use_[node + 1]; ++use) {
        const Gradient& p = stresses[uses_[use] / 8];
        const std::uint32_t corner = uses_[use] % 8;
        const double x = (corner & 1) != 0 ? -1 : 1, y = (corner & 2) != 0 ? -1 : 1, z = (corner & 4) != 0 ? -1 : 1;
        for (std::size_t a = 0; a < 3; ++a) {
            force[a] += per_length_ * (x * p[3 * a] + y * p[3 * a + 1] + z * p[3 * a + 2]);
        }
    }
    return force;
}

template <class T>
template <class Visit>
void StressRelaxation<T>::for_each_cell(const State<T>& state, const Visit& visit) const {
    const Components u = components(state.displacement);
    const std::vector<Course> course = courses();
    std::vector<Strain> now(1 + branches_.size());
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        const Gradient h = gradient(cells_[c], u);
        std::copy(strains(c).begin(), strains(c).end(), now.begin());
        const double taken = advance(cells_[c], course, strain(h), now);
        visit(cells_[c], c, std::span<const Strain>(now), taken, h);
    }
}

template <class T>
std::size_t StressRelaxation<T>::bytes() const {
    return cells_.size() * (sizeof(Cell) + sizeof(Gradient)) + strains_.size() * sizeof(Strain) +
           (first_use_.size() + uses_.size()) * sizeof(std::uint32_t) + places_.size() * sizeof(std::size_t) +
           dissipated_.size() * sizeof(double);
}

// A cell's own stiffness is at least that of its mean deformation, which the branches have as many times more.
template <class T>
void StressRelaxation<T>::narrow(StepBounds& bounds) const {
    double sum = 1;
    for (const Relaxation& branch : branches_) {
        sum += branch.part;
    }
    bounds.frequencies.body *= sum;
}

template <class T>
double StressRelaxation<T>::energy(const Body<T>&, State<T>& state) const {
    double stored = 0;
    for_each_cell(state, [&](const Cell& cell, std::size_t, std::span<const Strain> now, double, const Gradient&) {
        for (std::size_t b = 0; b < branches_.size(); ++b) {
            stored += 0.5 * branches_[b].part * product(cell, now[b + 1], now[b + 1]);
        }
    });
    return stored;
}

template <class T>
double StressRelaxation<T>::dissipated(const Body<T>&, State<T>& state) const {
    double sum = std::accumulate(dissipated_.begin(), dissipated_.end(), 0.0);
    for_each_cell(
        state, [&](const Cell&, std::size_t, std::span<const Strain>, double taken, const Gradient&) { sum += taken; });
    return sum;
}

template <class T>
void StressRelaxation<T>::add_forces(const Body<T>&, State<T>& state, NodeField<T>& force) const {
    std::vector<Gradient> stresses(cells_.size());
    for_each_cell(state, [&](const Cell& cell, std::size_t c, std::span<const Strain> now, double, const Gradient& h) {
        stresses[c] = stress(cell, h, now);
    });
    for (std::size_t n = 0; n < places_.size(); ++n) {
        const std::array<double, 3> f = gathered(n, stresses);
        for (std::size_t a = 0; a < 3; ++a) {
            const Component<T> c = component(force, a);
            c.first[static_cast<std::ptrdiff_t>(places_[n]) * c.stride] += static_cast<T>(f[a]);
        }
    }
}

template <class T>
void StressRelaxation<T>::add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                                     std::vector<Stage>& stages) {
    stages.push_back(
        {pieces(cells_.size()), [this, u = components(state.displacement)](std::size_t piece, std::size_t) {
             const std::vector<Course> course = courses();
             const std::size_t begin = piece * kPiece, end = std::min(begin + kPiece, cells_.size());
             double taken = 0;
             for (std::size_t c = begin; c < end; ++c) {
                 const Gradient h = gradient(cells_[c], u);
                 taken += advance(cells_[c], course, strain(h), strains(c));
                 stresses_[c] = stress(cells_[c], h, strains(c));
             }
             dissipated_[piece] += taken;
         }});
    const std::array<Component<T>, 3> v = {component(state.velocity, 0), component(state.velocity, 1),
                                           component(state.velocity, 2)};
    stages.push_back(
        {pieces(places_.size()),
         [this, v, kick = factors.kick, inverse_mass = body.inverse_masses().data()](std::size_t piece, std::size_t) {
             if (piece == 0) { // no piece of this stage reads it
                 elapsed_ = 0;
             }
             const std::size_t begin = piece * kPiece, end = std::min(begin + kPiece, places_.size());
             for (std::size_t n = begin; n < end; ++n) {
                 const std::array<double, 3> f = gathered(n, stresses_);
                 for (std::size_t a = 0; a < 3; ++a) {
                     const auto at = static_cast<std::ptrdiff_t>(places_[n]) * v[a].stride;
                     v[a].first[at] += static_cast<T>(kick * f[a] * static_cast<double>(inverse_mass[at]));
                 }
             }
         }});
}

template <class T>
void StressRelaxation<T>::add_last_stages(const Body<T>&, State<T>&, const StepFactors& factors,
                                          std::vector<Stage>& stages) {
    stages.push_back({1, [this, drift = factors.time_step](std::size_t, std::size_t) { elapsed_ += drift; }});
}

template <class T>
void StressRelaxation<T>::body_was_cut(const Body<T>&, const Lattice& lattice, const NodeNumbers&,
                                       std::span<const CutNode> nodes) {
    for (const CutNode& node : nodes) {
        for (std::uint32_t use = first_use_[node.node]; use < first_use_[node.node + 1]; ++use) {
            Cell& cell = cells_[uses_[use] / 8];
            if (!(lattice.cell_scales()[cell.grid] > 0)) {
                cell.shear = cell.lame = 0;
            }
        }
    }
}

template <class T>
std::vector<double> StressRelaxation<T>::memory() const {
    std::vector<double> memory = {elapsed_};
    for (const Strain& strain : strains_) {
        memory.insert(memory.end(), strain.begin(), strain.end());
    }
    memory.insert(memory.end(), dissipated_.begin(), dissipated_.end());
    return memory;
}

template <class T>
void StressRelaxation<T>::set_memory(std::span<const double> memory) {
    elapsed_ = memory[0];
    auto next = memory.begin() + 1;
    for (Strain& strain : strains_) {
        std::copy_n(next, 6, strain.begin());
        next += 6;
    }
    std::copy(next, memory.end(), dissipated_.begin());
}

template <class T>
void ExplicitDynamics<T>::relax(const Lattice& lattice, const Material& material,
                                std::span<const Relaxation> branches) {
    Implementation& i = *implementation_;
    i.template replace<StressRelaxation<T>>(
        branches.empty() ? nullptr
                         : std::make_unique<StressRelaxation<T>>(*i.body, i.state, lattice, material, branches));
}

template class StressRelaxation<float>;
template class StressRelaxation<double>;
template void ExplicitDynamics<float>::relax(const Lattice&, const Material&, std::span<const Relaxation>);
template void ExplicitDynamics<double>::relax(const Lattice&, const Material&, std::span<const Relaxation>);

} // namespace hybmss
