#include "integrations/petsc/motion.hpp"

#include "dynamics/step.hpp"
#include "plan/tuning/planned_body.hpp"

namespace hybmss::distributed {
namespace {

/// Each rank steps its block, ghosts and all, by the fused kernels; then the ghosts become what their owners made of
/// them. What travels is the displacements, in the body's own unit and precision, of the nodes at borders alone,
/// through a PetscSF: its roots are a rank's owned nodes in Block's order (only those asked for are ever filled in),
/// its leaves the ghosts.
template <class T>
class FusedMotion final : public Motion {
public:
    FusedMotion(const Block& block, const Material& material, const Supports& supports, const PlanOptions& options)
        : block_(block), roots_(3 * block.owned().count()) {
        if (block.lattice()) {
            planned_ = plan_body<T>(*block.lattice(), material, options, Operation::step);
            state_ = planned_.body->make_state(true);
        }
        find_nodes(supports);
        connect();
        set_held();
        exchange();
    }
    ~FusedMotion() override { MPI_Type_free(&node_type_); }

    void step(const StepParameters& parameters, long count) override {
        for (long s = 0; s < count; ++s) {
            if (planned_.body) {
                take_steps<T>(*planned_.body, state_, step_factors(parameters), {{}, held_, {}}, 1);
            }
            exchange();
        }
    }

    void get_state(Vec displacement, Vec velocity) override {
        check(VecSet(displacement, 0));
        check(VecSet(velocity, 0));
        for_each_owned(state_.displacement, displacement, [](T& ours, double& out) { out = ours; });
        for_each_owned(state_.velocity, velocity, [](T& ours, double& out) { out = ours; });
    }
    void set_state(Vec displacement, Vec velocity) override {
        for_each_owned(state_.displacement, displacement, [](T& ours, double& in) { ours = static_cast<T>(in); });
        for_each_owned(state_.velocity, velocity, [](T& ours, double& in) { ours = static_cast<T>(in); });
        exchange();
    }
    void get_displacement(Vec displacement) override {
        const double unit = planned_.body ? planned_.body->length_unit() : 1;
        check(VecSet(displacement, 0));
        for_each_owned(state_.displacement, displacement, [&](T& ours, double& out) { out = unit * ours; });
    }

private:
    /// A node by its index in the body's arrays, and among the owned nodes or the ghosts.
    struct Node {
        std::size_t body, place;
    };

    void find_nodes(const Supports& supports) {
        const NodeBox &mine = block_.owned(), &all = block_.ghosted();
        for (std::size_t n = 0; n < block_.lattice_nodes().size(); ++n) {
            const auto [i, j, k] = all.place(block_.lattice_nodes()[n]);
            const std::size_t index = planned_.body->index_of(n);
            if (!mine.holds(i, j, k)) {
                ghosts_.push_back({index, remote_.size()});
                remote_.push_back(owner_of(i, j, k));
                continue;
            }
            const Node node{index, mine.index(i, j, k)};
            owned_.push_back(node);
            if (is_shared({i, j, k})) {
                shared_.push_back(node);
            }
            if (const auto displacement = supports(i, j, k)) {
                for (std::size_t c = 0; c < 3; ++c) {
                    held_.push_back({index, static_cast<std::uint32_t>(n), static_cast<std::uint8_t>(c),
                                     static_cast<T>((*displacement)[c] / planned_.body->length_unit()), T(0)});
                }
            }
        }
        leaves_.resize(3 * ghosts_.size());
    }

    /// Whether others have this owned node as a ghost: it lies at a side that has a neighbour.
    bool is_shared(const std::array<PetscInt, 3>& at) const {
        const NodeBox &mine = block_.owned(), &all = block_.ghosted();
        for (std::size_t a = 0; a < 3; ++a) {
            if ((at[a] == mine.low[a] && all.low[a] < mine.low[a]) ||
                (at[a] == mine.end(a) - 1 && all.end(a) > mine.end(a))) {
                return true;
            }
        }
        return false;
    }

    PetscSFNode owner_of(PetscInt i, PetscInt j, PetscInt k) const {
        const int rank = block_.owner(i, j, k);
        return {rank, static_cast<PetscInt>(block_.owned_by(rank).index(i, j, k))};
    }

    void connect() {
        check(PetscSFCreate(block_.communicator(), sf_.make()));
        check(PetscSFSetGraph(sf_, static_cast<PetscInt>(block_.owned().count()), static_cast<PetscInt>(remote_.size()),
                              nullptr, PETSC_COPY_VALUES, remote_.data(), PETSC_COPY_VALUES));
        check(PetscSFSetUp(sf_));
        MPI_Type_contiguous(3, sizeof(T) == 4 ? MPI_FLOAT : MPI_DOUBLE, &node_type_);
        MPI_Type_commit(&node_type_);
    }

    void set_held() {
        if (planned_.body) {
            set_prescribed<T>(state_, held_);
        }
    }

    /// A ghost's velocity is kept at zero, or that of an incomplete node would grow without bound.
    void exchange() {
        std::array<Component<T>, 3> u, v;
        for (std::size_t c = 0; c < 3; ++c) {
            u[c] = component(state_.displacement, c);
            v[c] = component(state_.velocity, c);
        }
        for (const Node& node : shared_) {
            for (std::size_t c = 0; c < 3; ++c) {
                roots_[3 * node.place + c] = u[c].first[static_cast<std::ptrdiff_t>(node.body) * u[c].stride];
            }
        }
        check(PetscSFBcastBegin(sf_, node_type_, roots_.data(), leaves_.data(), MPI_REPLACE));
        check(PetscSFBcastEnd(sf_, node_type_, roots_.data(), leaves_.data(), MPI_REPLACE));
        for (const Node& node : ghosts_) {
            for (std::size_t c = 0; c < 3; ++c) {
                u[c].first[static_cast<std::ptrdiff_t>(node.body) * u[c].stride] = leaves_[3 * node.place + c];
                v[c].first[static_cast<std::ptrdiff_t>(node.body) * v[c].stride] = 0;
            }
        }
    }

    template <class Visit>
    void for_each_owned(NodeField<T>& field, Vec vector, const Visit& visit) {
        PetscScalar* values = nullptr;
        check(VecGetArray(vector, &values));
        for (const Node& node : owned_) {
            for (std::size_t c = 0; c < 3; ++c) {
                const Component<T> ours = component(field, c);
                visit(ours.first[static_cast<std::ptrdiff_t>(node.body) * ours.stride], values[3 * node.place + c]);
            }
        }
        check(VecRestoreArray(vector, &values));
    }

    const Block& block_;
    PlannedBody<T> planned_; ///< no body where the rank has no cell
    State<T> state_;
    std::vector<Node> owned_, shared_, ghosts_;
    std::vector<PetscSFNode> remote_; ///< of the ghosts
    std::vector<PrescribedComponent<T>> held_;
    std::vector<T> roots_, leaves_;
    OwnedSf sf_;
    MPI_Datatype node_type_ = MPI_DATATYPE_NULL;
};

} // namespace

std::unique_ptr<Motion> make_fused_motion(bool single_precision, const Block& block, const Material& material,
                                          const Supports& supports, const PlanOptions& options) {
    if (single_precision) {
        return std::make_unique<FusedMotion<float>>(block, material, supports, options);
    }
    return std::make_unique<FusedMotion<double>>(block, material, supports, options);
}

} // namespace hybmss::distributed
