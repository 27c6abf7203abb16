#pragma once

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/force_plan.hpp"
#include "kernels/kernel_table.hpp"
#include "layouts/aligned_array.hpp"
#include "layouts/node_numbers.hpp"
#include "plan/bodies/critical_time_step.hpp"
#include "plan/bodies/step_factors.hpp"
#include "plan/threads/workers.hpp"

#include <array>
#include <initializer_list>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace hybmss {

/// The three components of all nodes: an array each; or packed, x y z 0 a node, in [0] and nothing in [1] and [2].
template <class T>
using NodeField = AlignedArray<T>[3];

/// One component of a node field: that of the node at index i is first[i * stride].
template <class T>
struct Component {
    T* first;
    std::ptrdiff_t stride;
};
/// `Field`: NodeField<T> or const NodeField<T>. Null where a body has no nodes.
template <class Field>
auto component(Field& field, std::size_t c) {
    using T = std::remove_pointer_t<decltype(field[0].data())>;
    if (field[0].size() == 0) {
        return Component<T>{nullptr, 1};
    }
    return field[1].size() > 0 ? Component<T>{field[c].data(), 1} : Component<T>{field[0].data() + c, 4};
}

/// How many arrays a field is made of.
template <class T>
std::size_t array_count(const NodeField<T>& field) {
    return field[1].size() > 0 ? 3 : 1;
}

/// What changes while a body is used: one for every execution at a time.
template <class T>
struct State {
    NodeField<T> displacement;            ///< in the body's length unit
    NodeField<T> velocity;                ///< likewise, per s; empty unless the body moves
    NodeField<T> force;                   ///< N; empty until forces are asked for
    NodeField<T> direction;               ///< as displacements; empty until a Hessian product is asked for
    NodeField<T> beside;                  ///< N; empty unless there are passes beside, zero between uses
    std::vector<AlignedArray<T>> buffers; ///< the body's own
    std::size_t bodies = 1;               ///< alike, side by side: an element of a component is one of each

    std::size_t bytes() const;
};

/// Which second derivatives: those of the energy; or what no state makes indefinite of them, springs under compression
/// without their negative part and cells without the curvature of their volume.
enum class Curvature { whole, convex };

/// A pass over all springs by a law of their own, beside or instead of their elasticity, or over cells by one of their
/// volume's; or by elasticity, cells and all.
template <class T>
struct SpringPass {
    kernels::SpringLaw law;
    kernels::StiffeningConstants<T> stiffening = {}; ///< of the laws that stiffen, and those of `curvature`

    SpringPass with(Curvature curvature) const {
        SpringPass pass = *this;
        if (curvature == Curvature::convex) {
            pass.stiffening.least_tension = pass.stiffening.geometric = 0;
        }
        return pass;
    }

    /// Of a body's cells, those that the pass takes account of: with the springs' elasticity all of them.
    kernels::Volume cells(kernels::Volume all) const {
        return law == kernels::SpringLaw::elastic ? all : kernels::Volume::none;
    }
};

/// A node that has lost a cell: its number in the body, and its place x y z in the grid.
struct CutNode {
    std::uint32_t node;
    std::array<std::size_t, 3> place;
};

/// A body in one layout with the kernels chosen: what plans and dynamics run on. Immutable but for cuts.
///
/// Where its springs stiffen, its cells resist being crushed, or tissues have volume forces of their own, each pass
/// over it has others beside it, for what their energies have beyond linear springs and the volume's. In a step these
/// forces kick the velocities before the sweep, as a StepEffect does. A layout knows each pass alone.
template <class T>
class Body {
public:
    virtual ~Body() = default;

    std::size_t node_count() const { return masses().size(); }
    virtual std::span<const double> masses() const = 0;
    /// Where the nodes lie in a NodeField: runs of neighbours.
    virtual std::span<const NodeRun> runs() const = 0;
    /// For a body that renumbers its nodes: order()[i] is the node at index i, for every i < node_count(). Where it is
    /// not empty, it holds and runs() does not.
    virtual std::span<const std::uint32_t> order() const { return {}; }
    virtual std::size_t index_of(std::size_t node) const = 0;
    /// m by which displacements are divided inside.
    virtual double length_unit() const = 0;
    const FrequencyBounds& frequencies() const { return frequencies_; }
    double critical_time_step() const { return frequencies_.critical_time_step(); }
    PlanDescription describe() const;

    /// Stiffnesses and masses at the nodes become those of `cut`, which has lost `removed` cells, all at these nodes.
    /// In time proportional to the nodes named. Only for layouts that can be cut (layout_table.hpp). Nodes keep their
    /// numbers and places; one without any cell has no mass. Nothing may run on the body meanwhile.
    virtual void take_over(const Lattice& cut, std::span<const CutNode> nodes, std::size_t removed);

    State<T> make_state(bool moving) const;
    /// How many bodies like this one step_stages() takes side by side, a lane of a vector each; 1: this one alone.
    std::size_t abreast() const { return beside_.empty() ? linear_abreast() : 1; }
    /// Of as many, that move: for step_stages() and nothing else.
    virtual State<T> state_abreast() const { return make_state(true); }
    /// Whether the other takes the same steps from the same state, to the bit: what abreast() must hold for.
    virtual bool steps_like(const Body<T>&) const { return false; }
    /// What sets state.force, however often it is run. The state must outlive the stages, and its arrays stay where
    /// they are.
    std::vector<Stage> force_stages(State<T>& state) const;
    /// Sets state.force.
    void compute_forces(State<T>& state) const { workers_.run(force_stages(state), 1); }
    PotentialEnergy energy(State<T>& state) const;
    /// product = K p in N, where K = d^2 W / du^2 (N/m) at state.displacement and p is `direction`, in the body's
    /// length unit like displacements. What lies between and behind the nodes in `direction` must be zero, and is zero
    /// in `product`, so that sums over whole arrays are sums over the nodes. Makes `product`'s arrays where they are
    /// empty; it must not be `direction`.
    void hessian_product(State<T>& state, const NodeField<T>& direction, NodeField<T>& product,
                         Curvature curvature = Curvature::whole) const;
    /// The symmetric 3x3 blocks on K's diagonal, of the operator that hessian_product applies: in N per length unit of
    /// the body. Sets blocks[e][index of the node] for the entries e = xx, yy, zz, xy, xz, yz; zero between and behind
    /// the nodes. Makes the arrays where they are empty.
    void hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6], Curvature curvature = Curvature::whole) const;
    /// Adds to `product` what the law makes of `direction` (see kernels::SpringLaw; null for `stiffening`): in N by the
    /// unit of the direction per length unit of the body. `product` must have the size of the displacements and be
    /// zero. The fields must outlive the stages.
    virtual std::vector<Stage> spring_stages(State<T>& state, const SpringPass<T>& pass, const NodeField<T>* direction,
                                             NodeField<T>& product) const = 0;
    /// Sets the blocks on the diagonal of a law's operator, as hessian_diagonal does; not for `stiffening`.
    virtual void spring_diagonal(State<T>& state, const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const = 0;
    /// J that the springs store beyond 1/2 k (|d| - l)^2 with these constants.
    virtual double stiffening_energy(State<T>& state, const kernels::StiffeningConstants<T>& constants) const = 0;
    /// J that cells store by a law of their volume, where they can.
    virtual double cell_energy(State<T>& state, kernels::SpringLaw law) const;
    /// 1 / (m length unit), by places as in a component of a node field, or packed with a zero as the fourth.
    virtual const AlignedArray<T>& inverse_masses() const = 0;
    const kernels::KernelTable<T>& kernel_table() const { return *table_; }
    /// velocity -= time_step * product / m, product = 0. Where `taken` is not null, *taken += the kinetic
    /// energy (J) that this takes out. The fields must outlive the stages.
    void add_kick_stages(NodeField<T>& velocity, NodeField<T>& product, double time_step, double* taken,
                         std::vector<Stage>& stages) const;
    /// One step by the body's own forces, gravity and damping. The state must outlive the stages.
    std::vector<Stage> step_stages(State<T>& state, const StepFactors& factors) const;

    /// Throw std::invalid_argument unless it is a field of the body's nodes: with addresses, a stride other than 0, and
    /// where it is written to, three components that share no memory.
    void check(const VectorField<const T>& in) const;
    void check(const VectorField<T>& out) const;
    /// Throws too where a component of `out` is one of `in`.
    void check(const VectorField<T>& out, std::initializer_list<VectorField<const T>> in) const;
    /// field = factor * in, at the body's nodes.
    void write(VectorField<const T> in, double factor, NodeField<T>& field) const;
    /// out = factor * field.
    void read(const NodeField<T>& field, double factor, VectorField<T> out) const;
    /// The same as write(), and out += field. What is read and written is what the views say when the stages run: one
    /// list of stages serves calls with ever other memory. The views have been checked by then.
    Stage write_stage(const VectorField<const T>& in, double factor, NodeField<T>& field) const;
    Stage add_stage(const NodeField<T>& field, const VectorField<T>& out) const;
    /// out[6 n + e] = factor * blocks[e] of node n.
    void read_blocks(const AlignedArray<T> (&blocks)[6], double factor, std::span<T> out) const;
    double kinetic_energy(const State<T>& state) const;
    /// Whether all of a field is, what lies between the nodes too.
    bool finite(const NodeField<T>& field) const;
    const Workers& workers() const { return workers_; }
    /// Makes the arrays of `field` as long as those of `like`, and zero, where they are not.
    static void allocate_like(const NodeField<T>& like, NodeField<T>& field);
    /// Makes every array zero, as long as those of `like`, or of `size` entries.
    static void clear_like(const NodeField<T>& like, NodeField<T>& field);
    static void clear(std::size_t size, AlignedArray<T>& array);
    /// field = 0.
    static Stage clear_stage(NodeField<T>& field);
    /// sum += sign * more, more = 0, array by array; `arrays` of them, all of one size.
    Stage move_into_stage(AlignedArray<T>* sum, AlignedArray<T>* more, std::size_t arrays, T sign) const;

protected:
    /// `nodes`: by which useful_threads() counts. `stiffening`: valid. `crush`: whether cells resist being crushed;
    /// `own_volumes`: whether volume forces, beside `volume`, do not go by the springs' stiffness.
    Body(const PlanOptions& options, std::size_t nodes, kernels::Volume volume, const FrequencyBounds& frequencies,
         const SpringStiffening& stiffening, bool crush = false, bool own_volumes = false);

    kernels::Volume volume() const { return volume_; }
    Accuracy accuracy() const { return accuracy_; }

    /// Displacements, and velocities where it moves, in so many arrays of `size` entries.
    static State<T> state_of(std::size_t arrays, std::size_t size, bool moving);
    /// The blocks for spring_diagonal(), zero and of `size` entries, as kernels take them.
    static kernels::DiagonalBlocks<T> cleared_blocks(std::size_t size, const SpringPass<T>& pass,
                                                     AlignedArray<T> (&blocks)[6]);
    /// The sum of piece(i) for i < count: side by side, and added in this order.
    template <class Piece>
    double sum_of(std::size_t count, const Piece& piece) const {
        std::vector<double> parts(count);
        workers_.run(count, [&](std::size_t i, std::size_t) { parts[i] = piece(i); });
        return std::accumulate(parts.begin(), parts.end(), 0.0);
    }

private:
    virtual State<T> linear_state(bool moving) const = 0;
    virtual std::size_t linear_abreast() const { return 1; }
    virtual std::vector<Stage> linear_force_stages(State<T>& state) const = 0;
    virtual PotentialEnergy linear_energy(State<T>& state) const = 0;
    /// `pass`: elasticity.
    virtual void linear_product(State<T>& state, const SpringPass<T>& pass, const NodeField<T>& direction,
                                NodeField<T>& product) const;
    virtual std::vector<Stage> linear_step_stages(State<T>& state, const StepFactors& factors) const = 0;
    /// Sets the kernel, the counts of springs, cells and tiles, and the layout's bytes.
    virtual void describe_layout(PlanDescription& description) const = 0;

    /// move(caller's component, body's component) for all nodes and components. `outer`: a view that is looked at when
    /// the stage runs.
    template <class Outer, class Field, class Move>
    Stage move_stage(const VectorField<Outer>& outer, Field& field, const Move& move) const;
    template <class Outer, class Inner, class Move>
    void move_nodes(std::size_t begin, std::size_t end, const VectorField<Outer>& outer,
                    const Component<Inner> (&inner)[3], const Move& move) const;

    Workers workers_;
    std::string name_; ///< of the layout
    const kernels::KernelTable<T>* table_;
    kernels::Volume volume_;
    Accuracy accuracy_;
    FrequencyBounds frequencies_;
    /// A pass beside the others, by its laws of forces and of second derivatives.
    struct Beside {
        kernels::SpringLaw force, tangent;
        kernels::StiffeningConstants<T> stiffening;
    };
    std::vector<Beside> beside_;
};

extern template class Body<float>;
extern template class Body<double>;

} // namespace hybmss
