#include "integrations/petsc/block.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>
#include <string>

namespace hybmss::distributed {

double most_ghosts(const std::array<long, 3>& nodes, const ProcessGrid& processes) {
    double owned = 1, ghosted = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        const long own = (nodes[a] + processes[a] - 1) / processes[a];
        owned *= static_cast<double>(own);
        ghosted *= static_cast<double>(own + std::min(processes[a] - 1, 2L));
    }
    return ghosted - owned;
}

ProcessGrid choose_process_grid(const std::array<long, 3>& nodes, long ranks) {
    ProcessGrid best = {0, 0, 0};
    double fewest = std::numeric_limits<double>::infinity();
    for (long px = 1; px <= std::min(ranks, nodes[0]); ++px) {
        for (long py = 1; ranks % px == 0 && py <= std::min(ranks / px, nodes[1]); ++py) {
            const long pz = ranks / px / py;
            if (px * py * pz != ranks || pz > nodes[2]) {
                continue;
            }
            if (const double ghosts = most_ghosts(nodes, {px, py, pz}); ghosts < fewest) {
                fewest = ghosts;
                best = {px, py, pz};
            }
        }
    }
    if (best[0] == 0) {
        const auto text = [&](std::size_t a) { return std::to_string(nodes[a]); };
        throw std::invalid_argument("ranks = " + std::to_string(ranks) + " is not allowed for " + text(0) + " x " +
                                    text(1) + " x " + text(2) + " nodes: it must be a product of three counts, none " +
                                    "above the nodes along its axis");
    }
    return best;
}

std::vector<long> even_cuts(long cells, long parts) {
    if (cells < parts) {
        throw std::invalid_argument("ranks = " + std::to_string(parts) + " along an axis of " + std::to_string(cells) +
                                    " cells is not allowed: each must have a cell");
    }
    long unit = 1;
    while (unit * parts * 2 <= cells) {
        unit *= 2;
    }
    for (;; unit /= 2) {
        std::vector<long> first;
        for (long p = 0; p < parts; ++p) {
            first.push_back((2 * p * cells + parts * unit) / (2 * parts * unit) * unit); // to the nearest
        }
        long most = 0, least = cells;
        for (std::size_t p = 0; p < first.size(); ++p) {
            const long own = (p + 1 < first.size() ? first[p + 1] : cells) - first[p];
            most = std::max(most, own);
            least = std::min(least, own);
        }
        if (least > 0 && (unit == 1 || 4 * most * parts <= 5 * cells)) {
            return first;
        }
    }
}

std::size_t NodeBox::count() const {
    return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
}

bool NodeBox::holds(PetscInt i, PetscInt j, PetscInt k) const {
    return i >= low[0] && i < end(0) && j >= low[1] && j < end(1) && k >= low[2] && k < end(2);
}

std::array<PetscInt, 3> NodeBox::place(std::size_t index) const {
    const auto nx = static_cast<std::size_t>(size[0]), ny = static_cast<std::size_t>(size[1]);
    return {low[0] + static_cast<PetscInt>(index % nx), low[1] + static_cast<PetscInt>(index / nx % ny),
            low[2] + static_cast<PetscInt>(index / nx / ny)};
}

std::size_t NodeBox::index(PetscInt i, PetscInt j, PetscInt k) const {
    const auto x = static_cast<std::size_t>(i - low[0]), y = static_cast<std::size_t>(j - low[1]),
               z = static_cast<std::size_t>(k - low[2]);
    return x + static_cast<std::size_t>(size[0]) * (y + static_cast<std::size_t>(size[1]) * z);
}

Block::Block(MPI_Comm communicator, const Grid& grid, bool cut_evenly) : communicator_(communicator), grid_(grid) {
    MPI_Comm_rank(communicator, &rank_);
    MPI_Comm_size(communicator, &ranks_);
    std::array<long, 3> nodes;
    for (std::size_t a = 0; a < 3; ++a) {
        if (grid.cells[a] < 1) {
            throw std::invalid_argument("cells = " + std::to_string(grid.cells[a]) + " along " + "xyz"[a] +
                                        " is not allowed: it must be >= 1");
        }
        nodes[a] = static_cast<long>(grid.cells[a]) + 1;
    }
    const double unknowns =
        3 * static_cast<double>(nodes[0]) * static_cast<double>(nodes[1]) * static_cast<double>(nodes[2]);
    if (unknowns > static_cast<double>(PETSC_MAX_INT)) {
        throw std::invalid_argument("the grid has " + std::to_string(static_cast<long long>(unknowns)) +
                                    " unknowns: this PETSc counts up to " + std::to_string(PETSC_MAX_INT) +
                                    ", one with 64-bit indices is needed");
    }
    const ProcessGrid processes = choose_process_grid(nodes, ranks_);
    for (std::size_t a = 0; a < 3; ++a) {
        processes_[a] = static_cast<PetscInt>(processes[a]);
    }
    std::array<std::vector<PetscInt>, 3> sizes;
    for (std::size_t a = 0; cut_evenly && a < 3; ++a) {
        std::vector<long> first = even_cuts(grid.cells[a], processes[a]);
        first.push_back(nodes[a]);
        for (std::size_t p = 0; p + 1 < first.size(); ++p) {
            sizes[a].push_back(static_cast<PetscInt>(first[p + 1] - first[p]));
        }
    }
    const auto given = [&](std::size_t a) { return cut_evenly ? sizes[a].data() : nullptr; };
    check(DMDACreate3d(communicator, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DMDA_STENCIL_BOX,
                       grid.cells[0] + 1, grid.cells[1] + 1, grid.cells[2] + 1, processes_[0], processes_[1],
                       processes_[2], 3, 1, given(0), given(1), given(2), dm_.make()));
    check(DMSetUp(dm_));
    const PetscInt* counts[3];
    check(DMDAGetOwnershipRanges(dm_, &counts[0], &counts[1], &counts[2]));
    for (std::size_t a = 0; a < 3; ++a) {
        first_[a] = {0};
        for (PetscInt p = 0; p < processes_[a]; ++p) {
            first_[a].push_back(first_[a].back() + counts[a][p]);
        }
    }
    owned_ = owned_by(rank_);
    ghosted_ = ghosted_of(rank_);
    lattice_ = cells_between(false);
    if (lattice_) {
        lattice_nodes_ = lattice_->nodes();
    }
}

NodeBox Block::owned_by(int rank) const {
    const std::array<PetscInt, 3> place = {rank % processes_[0], rank / processes_[0] % processes_[1],
                                           rank / processes_[0] / processes_[1]};
    NodeBox box;
    for (std::size_t a = 0; a < 3; ++a) {
        const auto p = static_cast<std::size_t>(place[a]);
        box.low[a] = first_[a][p];
        box.size[a] = first_[a][p + 1] - box.low[a];
    }
    return box;
}

int Block::owner(PetscInt i, PetscInt j, PetscInt k) const {
    const std::array<PetscInt, 3> at = {i, j, k};
    int rank = 0;
    for (std::size_t a = 3; a-- > 0;) {
        const auto next = std::upper_bound(first_[a].begin(), first_[a].end(), at[a]);
        rank = rank * processes_[a] + static_cast<int>(next - first_[a].begin()) - 1;
    }
    return rank;
}

int Block::halvings() const {
    int halvings = std::numeric_limits<int>::max();
    for (const std::vector<PetscInt>& first : first_) {
        for (std::size_t p = 1; p + 1 < first.size(); ++p) {
            halvings = std::min(halvings, std::countr_zero(static_cast<unsigned>(first[p])));
        }
    }
    return halvings;
}

int Block::neighbour(std::size_t axis, bool high) const {
    std::array<PetscInt, 3> at = owned_.low;
    at[axis] += high ? owned_.size[axis] : -1;
    return at[axis] < 0 || at[axis] > grid_.cells[axis] ? MPI_PROC_NULL : owner(at[0], at[1], at[2]);
}

NodeBox Block::ghosted_of(int rank) const {
    const NodeBox owned = owned_by(rank);
    NodeBox box;
    for (std::size_t a = 0; a < 3; ++a) {
        box.low[a] = std::max<PetscInt>(owned.low[a] - 1, 0);
        box.size[a] = std::min(owned.low[a] + owned.size[a] + 1, grid_.cells[a] + 1) - box.low[a];
    }
    return box;
}

std::optional<Lattice> Block::cells_between(bool counted_once) const {
    std::vector<float> scales;
    for (PetscInt k = 0; k + 1 < ghosted_.size[2]; ++k) {
        for (PetscInt j = 0; j + 1 < ghosted_.size[1]; ++j) {
            for (PetscInt i = 0; i + 1 < ghosted_.size[0]; ++i) {
                const PetscInt x = ghosted_.low[0] + i, y = ghosted_.low[1] + j, z = ghosted_.low[2] + k;
                const bool left_out = counted_once && !owned_.holds(x, y, z);
                scales.push_back(left_out ? 0.0f : grid_.scale ? grid_.scale(x, y, z) : 1.0f);
            }
        }
    }
    if (std::all_of(scales.begin(), scales.end(), [](float scale) { return scale == 0; })) {
        return std::nullopt;
    }
    return Lattice::from_cells(static_cast<int>(ghosted_.size[0]) - 1, static_cast<int>(ghosted_.size[1]) - 1,
                               static_cast<int>(ghosted_.size[2]) - 1, grid_.cell_size, std::move(scales));
}

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
