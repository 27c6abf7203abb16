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
    if (branches.size() > kernels::kMaxRelaxations) {
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
    : table_(&body.kernel_table()), branches_(branches.begin(), branches.end()), nodes_(body.node_count()) {
    check_branches(branches);
    validate(material);
    const NodeNumbers numbers(lattice, body.node_count());
    for (std::size_t n = 0; n < nodes_; ++n) {
        const std::size_t place = body.index_of(n);
        if (n % kPiece == 0) {
            first_run_.push_back(runs_.size());
        } else if (place == runs_.back().index + runs_.back().length) {
            ++runs_.back().length;
            continue;
        }
        runs_.push_back({n, place, 1});
    }
    first_run_.push_back(runs_.size());
    const double edge = lattice.cell_size(), shear = shear_modulus(material);
    quarter_by_edge_ = static_cast<T>(body.length_unit() / (4 * edge));
    unit_ = shear * std::pow(edge, 3);
    newton_ = unit_ / (4 * edge);
    blocks_ = (nodes_ + kWidth - 1) / kWidth;
    length_ = blocks_ * kWidth + 2 * kMargin;
    slots_.assign(kArrays * length_, T(0));
    std::vector<std::array<T, 2>> moduli;
    for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
        const Material own = material_of(lattice, tissue, material);
        const double of_tissue = shear_modulus(own);
        // Without a volume energy springs make nu = 1/4.
        const double volume = resolved_volume_energy(own) == VolumeEnergy::none ? 0 : volume_modulus(own);
        moduli.push_back({static_cast<T>(of_tissue / shear), static_cast<T>((of_tissue + volume) / shear)});
    }
    const std::vector<std::array<std::uint32_t, 8>> corners = cell_corners(lattice, numbers);
    std::size_t cell = 0;
    for (std::size_t grid = 0; grid < lattice.cell_scales().size(); ++grid) {
        if (const float scale = lattice.cell_scales()[grid]; scale > 0) {
            const std::uint32_t slot = corners[cell++][0];
            const std::array<T, 2>& own = moduli[lattice.cell_tissue(grid)];
            slots(kShear)[slot] = static_cast<T>(scale) * own[0];
            slots(kLame)[slot] = static_cast<T>(scale) * own[1];
        }
    }
    find_rows(corners);
    strains_.assign(blocks_ * kWidth * lines(), T(0));
    dissipated_.assign(pieces(), 0.0);
    Courses none{}; // of the strain that there is now the branches have nothing
    read_all(state);
    table_->relaxing_cells()(cells(none, strains_.data()), 0, static_cast<kernels::Range>(blocks_));
}

template <class T>
void StressRelaxation<T>::find_rows(std::span<const std::array<std::uint32_t, 8>> corners) {
    const std::size_t count = blocks_ * kWidth;
    std::vector<std::int32_t> further[3], before[3];
    for (std::size_t r = 0; r < 3; ++r) {
        further[r].assign(count, kNowhere);
        before[r].assign(count, kNowhere);
        for (const auto& cell : corners) {
            const std::size_t low = 2 * (r + 1);
            further[r][cell[0]] = static_cast<std::int32_t>(cell[low]);
            // A node has the cell at its own place in the row before, and the one before that: either may be missing.
            before[r][cell[low]] = static_cast<std::int32_t>(cell[0]);
            before[r][cell[low + 1]] = static_cast<std::int32_t>(cell[1]);
        }
    }
    std::vector<bool> is_cell(count, false);
    for (const auto& cell : corners) {
        is_cell[cell[0]] = true;
    }
    const auto empty = [&](std::int32_t slot) {
        return slot < 0 || static_cast<std::size_t>(slot) >= count || !is_cell[static_cast<std::size_t>(slot)];
    };
    for (std::size_t block = 0; block < blocks_; ++block) {
        for (std::size_t r = 0; r < 3; ++r) {
            further_.add(std::span(further[r]).subspan(block * kWidth, kWidth), 0, [](std::int32_t) { return true; });
            before_.add(std::span(before[r]).subspan(block * kWidth, kWidth), static_cast<std::int32_t>(count),
                        [&](std::int32_t place) { return empty(place) && empty(place - 1); });
        }
    }
}

template <class T>
template <class Serves>
void StressRelaxation<T>::Rows::add(std::span<const std::int32_t> places, std::int32_t elsewhere,
                                    const Serves& serves) {
    const auto place_of = [&](std::size_t i) { return places[i] != kNowhere ? places[i] : elsewhere; };
    const auto known = std::find_if(places.begin(), places.end(), [](std::int32_t p) { return p != kNowhere; });
    const std::int32_t start =
        known == places.end() ? elsewhere : *known - static_cast<std::int32_t>(known - places.begin());
    bool in_a_row = true;
    for (std::size_t i = 0; i < places.size(); ++i) {
        const std::int32_t place = start + static_cast<std::int32_t>(i);
        in_a_row = in_a_row && (places[i] != kNowhere ? places[i] == place : serves(place));
    }
    rows.push_back({start, in_a_row ? -1 : static_cast<std::int32_t>(lanes.size())});
    for (std::size_t i = 0; i < places.size() && !in_a_row; ++i) {
        lanes.push_back(place_of(i));
    }
}

template <class T>
auto StressRelaxation<T>::courses() const -> Courses {
    Courses all{};
    for (std::size_t b = 0; b < branches_.size(); ++b) {
        const double part = branches_[b].part, x = elapsed_ / branches_[b].time;
        const double lost = -std::expm1(-x), gained = x > 0 ? lost / x : 1;
        // The integral of (old e^-s + fresh (1 - e^-s) / x)^2 over s, which is that of a square and a rest: the part of
        // `old` in it is (1 - e^-2x) / 2, and is all of the square's.
        const double of_sums = part * lost / (2 * (2 - lost));
        const auto number = [](double value) { return static_cast<T>(value); };
        all[b] = {number(gained), number(lost), number(part), number(of_sums),
                  number(std::max(0.0, part * of_new_strain(x) - of_sums * gained * gained))};
    }
    return all;
}

template <class T>
void StressRelaxation<T>::read(const State<T>& state, std::size_t piece) const {
    for (std::size_t a = 0; a < 3; ++a) {
        const auto [first, stride] = component(state.displacement, a);
        T* const own = slots(kDisplacement + a);
        for_runs(piece, [&, first = first, stride = stride](const NodeRun& run) {
            const T* const from = first + static_cast<std::ptrdiff_t>(run.index) * stride;
            T* const to = own + run.node;
            for (std::size_t i = 0; stride == 1 && i < run.length; ++i) {
                to[i] = from[i];
            }
            for (std::size_t i = 0; stride != 1 && i < run.length; ++i) {
                to[i] = from[static_cast<std::ptrdiff_t>(i) * stride];
            }
        });
    }
}

template <class T>
void StressRelaxation<T>::add(const std::array<Component<T>, 3>& field, double factor, const T* weight,
                              std::size_t piece) const {
    const T by = static_cast<T>(factor);
    for (std::size_t a = 0; a < 3; ++a) {
        const T* const own = slots(kForce + a);
        const auto [first, stride] = field[a];
        for_runs(piece, [&, first = first, stride = stride](const NodeRun& run) {
            const auto start = static_cast<std::ptrdiff_t>(run.index) * stride;
            T* const to = first + start;
            const T* const from = own + run.node;
            for (std::size_t i = 0; i < run.length; ++i) {
                const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) * stride;
                to[at] += by * from[i] * (weight ? weight[start + at] : T(1));
            }
        });
    }
}

template <class T>
kernels::RelaxingCells<T> StressRelaxation<T>::cells(const Courses& courses, T* strains) const {
    kernels::RelaxingCells<T> cells{};
    for (std::size_t a = 0; a < 3; ++a) {
        cells.displacement[a] = slots(kDisplacement + a);
    }
    cells.rows = further_.rows.data();
    cells.lanes = further_.lanes.data();
    cells.quarter_by_edge = quarter_by_edge_;
    cells.shear = slots(kShear);
    cells.lame = slots(kLame);
    cells.branches = static_cast<int>(branches_.size());
    std::copy(courses.begin(), courses.end(), cells.course);
    cells.strains = strains;
    for (std::size_t p = 0; p < 12; ++p) {
        cells.pull[p] = slots(kPull + p);
    }
    return cells;
}

template <class T>
kernels::RelaxingNodes<T> StressRelaxation<T>::nodes() const {
    kernels::RelaxingNodes<T> nodes{};
    for (std::size_t p = 0; p < 12; ++p) {
        nodes.pull[p] = slots(kPull + p);
    }
    nodes.rows = before_.rows.data();
    nodes.lanes = before_.lanes.data();
    for (std::size_t a = 0; a < 3; ++a) {
        nodes.force[a] = slots(kForce + a);
    }
    return nodes;
}

template <class T>
std::vector<T> StressRelaxation<T>::strains_at(const State<T>& state, double& taken) const {
    std::vector<T> strains = strains_;
    read_all(state);
    taken +=
        unit_ * table_->relaxing_cells()(cells(courses(), strains.data()), 0, static_cast<kernels::Range>(blocks_));
    return strains;
}

template <class T>
std::size_t StressRelaxation<T>::bytes() const {
    return (slots_.size() + strains_.size()) * sizeof(T) + runs_.size() * sizeof(NodeRun) +
           (further_.rows.size() + before_.rows.size()) * sizeof(kernels::SlotRow) +
           (further_.lanes.size() + before_.lanes.size()) * sizeof(std::int32_t) + dissipated_.size() * sizeof(double);
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
    double taken = 0, stored = 0;
    const std::vector<T> strains = strains_at(state, taken);
    for (std::size_t slot = 0; slot < blocks_ * kWidth; ++slot) {
        const T* line = strains.data() + slot / kWidth * lines() * kWidth + slot % kWidth;
        line += 6 * kWidth;
        for (const Relaxation& branch : branches_) {
            double trace = 0, squares = 0;
            for (std::size_t s = 0; s < 6; ++s) {
                const auto h = static_cast<double>(line[s * kWidth]);
                trace += s < 3 ? h : 0;
                squares += (s < 3 ? 1 : 2) * h * h;
            }
            stored += 0.5 * branch.part * unit_ *
                      (static_cast<double>(slots(kLame)[slot]) * trace * trace +
                       2 * static_cast<double>(slots(kShear)[slot]) * squares);
            line += kernels::kRelaxationLines<T> * kWidth;
        }
    }
    return stored;
}

template <class T>
double StressRelaxation<T>::dissipated(const Body<T>&, State<T>& state) const {
    double sum = std::accumulate(dissipated_.begin(), dissipated_.end(), 0.0);
    strains_at(state, sum);
    return sum;
}

template <class T>
void StressRelaxation<T>::add_forces(const Body<T>&, State<T>& state, NodeField<T>& force) const {
    double taken = 0;
    strains_at(state, taken);
    table_->relaxing_nodes()(nodes(), 0, static_cast<kernels::Range>(blocks_));
    for (std::size_t piece = 0; piece < pieces(); ++piece) {
        add({component(force, 0), component(force, 1), component(force, 2)}, newton_, nullptr, piece);
    }
}

template <class T>
void StressRelaxation<T>::add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                                     std::vector<Stage>& stages) {
    stages.push_back({pieces(), [this, &state](std::size_t piece, std::size_t) {
                          if (piece == 0) {
                              course_ = courses();
                          }
                          read(state, piece);
                      }});
    const auto take_on = [this](std::size_t piece) {
        const auto [begin, end] = blocks(piece);
        dissipated_[piece] += unit_ * table_->relaxing_cells()(cells(course_, strains_.data()), begin, end);
    };
    const std::array<Component<T>, 3> v = {component(state.velocity, 0), component(state.velocity, 1),
                                           component(state.velocity, 2)};
    const auto kick = [this, v, factor = factors.kick * newton_,
                       inverse_mass = body.inverse_masses().data()](std::size_t piece) {
        if (piece == 0) { // from here on nothing reads it
            elapsed_ = 0;
        }
        const auto [begin, end] = blocks(piece);
        table_->relaxing_nodes()(nodes(), begin, end);
        add(v, factor, inverse_mass, piece);
    };
    if (body.workers().threads() == 1) { // no node has cells in slots behind its own: what they have set is near
        stages.push_back({pieces(), [take_on, kick](std::size_t piece, std::size_t) {
                              take_on(piece);
                              kick(piece);
                          }});
        return;
    }
    stages.push_back({pieces(), [take_on](std::size_t piece, std::size_t) { take_on(piece); }});
    stages.push_back({pieces(), [kick](std::size_t piece, std::size_t) { kick(piece); }});
}

template <class T>
void StressRelaxation<T>::add_last_stages(const Body<T>&, State<T>&, const StepFactors& factors,
                                          std::vector<Stage>& stages) {
    stages.push_back({1, [this, drift = factors.time_step](std::size_t, std::size_t) { elapsed_ += drift; }});
}

template <class T>
void StressRelaxation<T>::body_was_cut(const Body<T>&, const Lattice& lattice, const NodeNumbers&,
                                       std::span<const CutNode> nodes) {
    const auto [nx, ny, nz] = lattice.cells();
    for (const CutNode& node : nodes) { // all corners of what has gone are among them
        const auto [x, y, z] = node.place;
        const std::size_t counts[] = {static_cast<std::size_t>(nx), static_cast<std::size_t>(ny),
                                      static_cast<std::size_t>(nz)};
        if (x >= counts[0] || y >= counts[1] || z >= counts[2] ||
            !(lattice.cell_scales()[x + counts[0] * (y + counts[1] * z)] > 0)) {
            slots(kShear)[node.node] = slots(kLame)[node.node] = 0;
        }
    }
}

template <class T>
std::vector<double> StressRelaxation<T>::memory() const {
    std::vector<double> memory = {elapsed_};
    memory.insert(memory.end(), strains_.begin(), strains_.end());
    memory.insert(memory.end(), dissipated_.begin(), dissipated_.end());
    return memory;
}

template <class T>
void StressRelaxation<T>::set_memory(std::span<const double> memory) {
    elapsed_ = memory[0];
    const auto strains = memory.subspan(1, strains_.size());
    std::transform(strains.begin(), strains.end(), strains_.begin(), [](double e) { return static_cast<T>(e); });
    const auto dissipated = memory.subspan(1 + strains_.size());
    std::copy(dissipated.begin(), dissipated.end(), dissipated_.begin());
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
