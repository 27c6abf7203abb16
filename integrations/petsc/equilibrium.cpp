#include "integrations/petsc/equilibrium.hpp"

#include "plan/tuning/planned_body.hpp"
#include "solvers/multigrid/float_multigrid.hpp"
#include "solvers/newton/coarser_mesh.hpp"
#include "solvers/newton/load_stepping.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>

namespace hybmss::distributed {
namespace {

/// Unknowns of the coarsest level, which every rank solves, at most.
constexpr double kMostDirect = 4500;

/// MPI between the ranks of a block.
class BlockRanks final : public Ranks {
public:
    BlockRanks(const Block& block, const RankBox& box) : Ranks(box), communicator_(block.communicator()) {
        for (std::size_t a = 0; a < 3; ++a) {
            neighbours_[a] = {block.neighbour(a, false), block.neighbour(a, true)};
        }
    }

    double sum(double own) const override {
        double all = own;
        sum(std::span<double>(&all, 1));
        return all;
    }
    void sum(std::span<double> values) const override {
        MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_SUM, communicator_);
    }
    double largest(double own) const override {
        double given = std::isnan(own) ? std::numeric_limits<double>::infinity() : own, all = 0;
        MPI_Allreduce(&given, &all, 1, MPI_DOUBLE, MPI_MAX, communicator_);
        return all;
    }
    // Axis after axis: nodes on edges and corners of boxes go on with what came before. Two sides add the same two
    // numbers, so that both have the same bits.
    void add_up(const Faces& faces, std::size_t width, std::span<double> values) const override {
        for (std::size_t a = 0; a < 3; ++a) {
            std::array<std::vector<double>, 2> sent, received;
            std::array<MPI_Request, 4> requests;
            int count = 0;
            for (std::size_t side = 0; side < 2; ++side) {
                if (faces[a][side].empty()) {
                    continue;
                }
                for (const std::uint32_t node : faces[a][side]) {
                    const double* of_node = values.data() + width * node;
                    sent[side].insert(sent[side].end(), of_node, of_node + width);
                }
                received[side].resize(sent[side].size());
                const int size = static_cast<int>(sent[side].size());
                MPI_Irecv(received[side].data(), size, MPI_DOUBLE, neighbours_[a][side], static_cast<int>(a),
                          communicator_, &requests[static_cast<std::size_t>(count++)]);
                MPI_Isend(sent[side].data(), size, MPI_DOUBLE, neighbours_[a][side], static_cast<int>(a), communicator_,
                          &requests[static_cast<std::size_t>(count++)]);
            }
            MPI_Waitall(count, requests.data(), MPI_STATUSES_IGNORE);
            for (std::size_t side = 0; side < 2; ++side) {
                const double* from = received[side].data();
                for (const std::uint32_t node : faces[a][side]) {
                    for (std::size_t e = 0; e < width; ++e) {
                        values[width * node + e] += *from++;
                    }
                }
            }
        }
    }

private:
    MPI_Comm communicator_;
    std::array<std::array<int, 2>, 3> neighbours_{};
};

/// What a rank solves: its cells of one mesh.
class Part {
public:
    Part(const Block& block, const RankBox& box, const Lattice& lattice, const Material& material,
         const PlanOptions& options)
        : block_(&block), ranks_(block, box), lattice_(lattice), material_(material), wishes_(options),
          planned_(plan_body<double>(lattice, material, options, Operation::forces)),
          state_(planned_.body->make_state(false)),
          potential_(*planned_.body, scales(), SolidCells::of(lattice), Sections::of(lattice)),
          stepping_(potential_.space()), cells_(ranks_.sum(static_cast<double>(lattice.cell_count()))) {
        potential_.share(lattice_, ranks_);
    }

    /// `u`: x y z of the nodes of its lattice, m; the start, then the equilibrium. Loads are this rank's share.
    EquilibriumResult solve(const Loading& loading, std::vector<double>& u, const EquilibriumOptions& options) {
        EquilibriumOptions own = options;
        own.leave_saddles = false; // by random vectors, which ranks would have to share
        if (can_be_merged() && own.nested) {
            if (const auto result = from_coarser(loading, u, own)) {
                return *result;
            }
        }
        return here(loading, u, u, own, false);
    }

private:
    const Body<double>& body() const { return *planned_.body; }
    BodyScales scales() const {
        BodyScales scales = BodyScales::of(lattice_, material_); // of this part
        double square = 0;
        for (const int n : ranks_.box().whole) {
            square += static_cast<double>(n) * n;
        }
        scales.extent = std::sqrt(square) * lattice_.cell_size();
        scales.spring_force = ranks_.largest(scales.spring_force);
        return scales;
    }
    /// As CoarserMesh::pays().
    bool can_be_merged() const {
        const RankBox& box = ranks_.box();
        return box.halvings > 0 && cells_ >= 4000 &&
               std::all_of(box.whole.begin(), box.whole.end(), [](int n) { return n % 2 == 0 && n >= 8; });
    }

    /// From `start`; supports move from `from`.
    EquilibriumResult here(const Loading& loading, const std::vector<double>& from, std::vector<double>& u,
                           const EquilibriumOptions& options, bool near_end) {
        const std::vector<double> begin = from;
        write(u);
        Loading part = loading;
        const auto prescribe = [&](double fraction) {
            for (std::size_t n = 0; n < loading.supports.size(); ++n) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const double start = begin[3 * loading.supports[n].node + c];
                    const double end = loading.supports[n].displacement[c];
                    part.supports[n].displacement[c] = fraction == 1 ? end : start + fraction * (end - start);
                }
            }
            for (std::size_t n = 0; n < loading.forces.size(); ++n) {
                for (std::size_t c = 0; c < 3; ++c) {
                    part.forces[n][c] = fraction * loading.forces[n][c];
                }
            }
            for (std::size_t c = 0; c < 3; ++c) {
                part.acceleration[c] = fraction * loading.acceleration[c];
            }
            potential_.prescribe(part.supports);
            potential_.load(part.forces, part.acceleration);
        };
        prescribe(1);
        const EquilibriumResult result =
            stepping_.follow(potential_, preconditioner(options.preconditioner), state_, prescribe, options, near_end);
        body().read(state_.displacement, body().length_unit(), field(u));
        return result;
    }

    /// As EquilibriumSolver does: nothing where the coarser mesh has no equilibrium, or it leads nowhere.
    std::optional<EquilibriumResult> from_coarser(const Loading& loading, std::vector<double>& u,
                                                  const EquilibriumOptions& options) {
        constexpr double kCoarseTolerance = 1e-4;
        const CoarserMesh coarser(lattice_);
        const std::vector<double> before = coarser.injected(u);
        std::vector<double> moved = before;
        EquilibriumOptions rough = options;
        rough.tolerance = std::max(options.tolerance, kCoarseTolerance);
        const EquilibriumResult coarse = Part(*block_, ranks_.box().merged(), coarser.lattice(), material_, wishes_)
                                             .solve(coarser.restricted(loading, body().masses()), moved, rough);
        if (coarse.status != EquilibriumStatus::converged || coarse.min_cell_volume_ratio <= 0) {
            return std::nullopt;
        }
        for (std::size_t i = 0; i < moved.size(); ++i) {
            moved[i] -= before[i];
        }
        const std::vector<double> change = coarser.interpolated(moved);
        std::vector<double> guess = u;
        for (std::size_t i = 0; i < guess.size(); ++i) {
            guess[i] += change[i];
        }
        write(guess);
        if (potential_.volume_ratios(state_).min <= 0) {
            return std::nullopt;
        }
        EquilibriumOptions whole = options;
        whole.first_load_step = whole.smallest_load_step = whole.largest_load_step = 1;
        EquilibriumResult result = here(loading, u, guess, whole, true);
        if (result.status != EquilibriumStatus::converged) {
            return std::nullopt;
        }
        result.coarser_meshes = coarse.coarser_meshes + 1;
        u = guess;
        return result;
    }

    Preconditioner<double>& preconditioner(PreconditionerKind kind) {
        RankBox coarsest = ranks_.box();
        const auto unknowns = [&] {
            double product = 3;
            for (const int n : coarsest.whole) {
                product *= n + 1;
            }
            return product;
        };
        while (coarsest.halvings > 0 && unknowns() > kMostDirect) {
            coarsest = coarsest.merged();
        }
        const bool can = ranks_.box().halvings > 0 && unknowns() <= kMostDirect;
        if (kind == PreconditionerKind::multigrid && !can) {
            throw std::invalid_argument("preconditioner \"multigrid\" needs cells that can be merged within each "
                                        "rank's box: a grid cut evenly, and fewer ranks");
        }
        if (!can || kind == PreconditionerKind::block_jacobi ||
            (kind == PreconditionerKind::automatic && !multigrid_pays(ranks_.box().whole, cells_, material_))) {
            return block_jacobi_;
        }
        if (!multigrid_) {
            multigrid_ = std::make_unique<FloatMultigrid>(body(), lattice_, material_, planned_.choice, &ranks_);
        }
        return *multigrid_;
    }

    VectorField<double> field(std::vector<double>& u) const {
        return VectorField<double>::aos(u.data(), body().node_count());
    }
    void write(std::vector<double>& u) {
        body().write(VectorField<const double>(field(u)), 1 / body().length_unit(), state_.displacement);
    }

    const Block* block_;
    BlockRanks ranks_;
    Lattice lattice_;
    Material material_;
    PlanOptions wishes_; ///< of coarser meshes too
    PlannedBody<double> planned_;
    State<double> state_;
    Potential<double> potential_;
    LoadStepping<double> stepping_;
    double cells_; ///< of all ranks
    BlockJacobi<double> block_jacobi_;
    std::unique_ptr<FloatMultigrid> multigrid_;
};

RankBox rank_box(const Block& block) {
    RankBox box;
    for (std::size_t a = 0; a < 3; ++a) {
        box.first[a] = static_cast<int>(block.owned().low[a]);
        box.whole[a] = static_cast<int>(block.grid().cells[a]);
        for (const bool high : {false, true}) {
            box.meets[a][high ? 1 : 0] = block.neighbour(a, high) != MPI_PROC_NULL;
        }
    }
    box.halvings = block.halvings();
    return box;
}

/// The cells whose low corner the rank owns: over all ranks every cell once.
Lattice own_cells(const Block& block) {
    const Grid& grid = block.grid();
    const NodeBox& mine = block.owned();
    std::array<PetscInt, 3> end;
    for (std::size_t a = 0; a < 3; ++a) {
        end[a] = std::min(mine.end(a), grid.cells[a]);
    }
    std::vector<float> scales;
    for (PetscInt k = mine.low[2]; k < end[2]; ++k) {
        for (PetscInt j = mine.low[1]; j < end[1]; ++j) {
            for (PetscInt i = mine.low[0]; i < end[0]; ++i) {
                scales.push_back(grid.scale ? grid.scale(i, j, k) : 1.0f);
            }
        }
    }
    int some = std::any_of(scales.begin(), scales.end(), [](float scale) { return scale > 0; }) ? 1 : 0, all = 0;
    MPI_Allreduce(&some, &all, 1, MPI_INT, MPI_MIN, block.communicator());
    if (all == 0) {
        throw std::invalid_argument("ranks = " + std::to_string(block.ranks()) +
                                    " is not allowed for an equilibrium of this body: each must have a cell");
    }
    return Lattice::from_cells(static_cast<int>(end[0] - mine.low[0]), static_cast<int>(end[1] - mine.low[1]),
                               static_cast<int>(end[2] - mine.low[2]), grid.cell_size, std::move(scales));
}

/// The nodes of a rank's cells; each node of the body is counted by one rank.
struct PartNodes {
    std::vector<std::array<PetscInt, 3>> places; ///< in the grid
    std::vector<bool> counted;                   ///< here
};

PartNodes part_nodes(const Block& block, const Lattice& lattice) {
    PartNodes nodes;
    const auto [nx, ny, nz] = lattice.cells();
    const NodeBox box{block.owned().low, {nx + 1, ny + 1, nz + 1}};
    const std::vector<std::uint32_t> numbers = lattice.nodes();
    for (const std::uint32_t n : numbers) {
        nodes.places.push_back(box.place(n));
    }
    nodes.counted.assign(numbers.size(), true);
    const BlockRanks ranks(block, rank_box(block));
    const RankBorder border(ranks, lattice.cells());
    std::vector<std::ptrdiff_t> number;
    for (const auto& [i, j, k] : border.nodes()) {
        const auto at = static_cast<std::uint32_t>(lattice.grid_node_index(i, j, k));
        const auto found = std::lower_bound(numbers.begin(), numbers.end(), at);
        number.push_back(found != numbers.end() && *found == at ? found - numbers.begin() : -1);
    }
    for (const std::uint32_t n : border.counted_elsewhere([&](std::size_t b) { return number[b] >= 0; })) {
        nodes.counted[static_cast<std::size_t>(number[n])] = false;
    }
    return nodes;
}

} // namespace

EquilibriumResult solve_equilibrium(BlockForces& forces, const Supports& supports, const std::array<double, 3>& gravity,
                                    Vec displacement, const EquilibriumOptions& options) {
    const Block& block = forces.block();
    const Lattice lattice = own_cells(block);
    const PartNodes nodes = part_nodes(block, lattice);
    Part part(block, rank_box(block), lattice, forces.material(), forces.options());

    Loading loading;
    loading.acceleration = gravity;
    for (std::size_t n = 0; n < nodes.places.size(); ++n) {
        const auto [i, j, k] = nodes.places[n];
        if (const auto held = supports(i, j, k)) {
            loading.supports.push_back({.node = static_cast<std::uint32_t>(n), .displacement = *held});
        }
    }
    OwnedVec ghosted;
    check(DMCreateLocalVector(block.nodes(), ghosted.make()));
    check(DMGlobalToLocal(block.nodes(), displacement, INSERT_VALUES, ghosted));
    std::vector<double> u(3 * nodes.places.size());
    const auto at = [&](std::size_t n) {
        const auto [i, j, k] = nodes.places[n];
        return 3 * block.ghosted().index(i, j, k);
    };
    const PetscScalar* given = nullptr;
    check(VecGetArrayRead(ghosted, &given));
    for (std::size_t n = 0; n < nodes.places.size(); ++n) {
        std::copy_n(given + at(n), 3, &u[3 * n]);
    }
    check(VecRestoreArrayRead(ghosted, &given));

    const EquilibriumResult result = part.solve(loading, u, options);

    check(VecSet(ghosted, 0));
    PetscScalar* found = nullptr;
    check(VecGetArray(ghosted, &found));
    for (std::size_t n = 0; n < nodes.places.size(); ++n) {
        if (nodes.counted[n]) {
            std::copy_n(&u[3 * n], 3, found + at(n));
        }
    }
    check(VecRestoreArray(ghosted, &found));
    check(VecSet(displacement, 0));
    check(DMLocalToGlobal(block.nodes(), ghosted, ADD_VALUES, displacement));
    forces.set_displacement(displacement);
    return result;
}

std::array<double, 3> support_force(BlockForces& forces, PetscInt layer) {
    OwnedVec force;
    check(VecDuplicate(forces.masses(), force.make()));
    forces.get_forces(force);
    const PetscScalar* f = nullptr;
    check(VecGetArrayRead(force, &f));
    const NodeBox& mine = forces.block().owned();
    std::array<double, 3> own = {0, 0, 0}, total = {0, 0, 0};
    if (layer >= mine.low[1] && layer < mine.low[1] + mine.size[1]) {
        for (PetscInt k = 0; k < mine.size[2]; ++k) {
            for (PetscInt i = 0; i < mine.size[0]; ++i) {
                const std::size_t n = mine.index(mine.low[0] + i, layer, mine.low[2] + k);
                for (std::size_t c = 0; c < 3; ++c) {
                    own[c] -= f[3 * n + c];
                }
            }
        }
    }
    check(VecRestoreArrayRead(force, &f));
    MPI_Allreduce(own.data(), total.data(), 3, MPI_DOUBLE, MPI_SUM, forces.block().communicator());
    return total;
}

} // namespace hybmss::distributed
