#pragma once

#include "dynamics/effects/actuation.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "solvers/newton/body_geometry.hpp"
#include "solvers/newton/contact_potential.hpp"
#include "solvers/newton/pressure_potential.hpp"
#include "solvers/newton/turning.hpp"
#include "solvers/newton/vector_space.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace hybmss {

/// What is left unbalanced at a state, and what that is measured by; N.
struct Balance {
    double unbalanced = 0; ///< the largest force on a free component
    double support = 0;    ///< the largest force on a held component
    double load = 0;       ///< the largest load or weight on any component
};

/// The potential that a body's equilibrium minimises over its free components:
///
///     P(u) = W(u) + A(u) + O(u) - f . u + sum p V(u) + a/2 sum m |u - v|^2 + b/2 (u - u_n) . C(u_n) (u - u_n)
///
/// with the body's energy W, what cells of another size at rest add to it A, that of contact with obstacles O, dead
/// nodal loads f (gravity among them), pressures p on the surfaces of volumes V, and a pull of the strength a (1/s^2)
/// towards given displacements v, by which backward Euler is a minimiser too: with v_n the velocity, c the mass damping
/// and dt the step,
///
///     a = 1/dt^2 + c/dt,   a v = (u_n + dt v_n)/dt^2 + c u_n/dt,   gravity and loads as dead loads.
///
/// The last term damps the springs in such a step: b = beta/dt, C the sum of k n n^T with the directions n at u_n.
///
/// Displacements are in the body's unit of length L, forces in N, and the potential itself is P / L, in N, so that
/// forces are its negative derivatives.
template <class T>
class Potential {
public:
    /// `scales`, `solid` and `sections` describe the same body; the body is kept by reference.
    Potential(const Body<T>& body, const BodyScales& scales, const SolidCells& solid, Sections sections);

    const Body<T>& body() const { return *body_; }
    const VectorSpace<T>& space() const { return space_; }

    /// The body is this rank's part of one, `lattice` its cells: values, balances and products are those of the whole
    /// from now on, and loads, those by mass too, are a rank's share of what acts on a node. Before all loads; without
    /// pressures, obstacles, cells of another size, pulls and turned steps. `ranks` is kept by reference.
    void share(const Lattice& lattice, const Ranks& ranks);
    /// Sums over the ranks that have a node; nothing where there are none.
    void add_up(NodeVector<T>& vector) const {
        if (shared_) {
            shared_->add_up(vector.field);
        }
    }
    /// Replaces the list of held components; velocities are not used. Throws std::invalid_argument for a node that does
    /// not exist or a displacement that is not finite.
    void prescribe(std::span<const PrescribedNode> nodes);
    /// Replaces the loads: one force a node in N (or none at all) and an acceleration (m/s^2) of all masses.
    void load(std::span<const std::array<double, 3>> forces, const std::array<double, 3>& acceleration);
    /// Replaces the faces that can be pressed; none for none. `pressures`: Pa, one each or none.
    void press(std::span<const SurfaceFace> faces, std::span<const double> pressures);
    /// Their pressures at supports; see PressurePotential::set().
    void set_pressures(std::span<const double> pressures, std::span<const PrescribedNode> held);
    /// Null without faces.
    const PressurePotential<T>* pressure() const { return pressure_.get(); }
    /// Replaces the cells that are of another size at rest; null for none.
    void actuate(std::unique_ptr<ActuatedBody<T>> actuation);
    void set_rest_stretches(std::span<const RestStretch> stretches);
    /// Null without such cells.
    const ActuatedBody<T>* actuation() const { return actuation_.get(); }
    /// Replaces the obstacles and what may touch them; none for none.
    void set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles);
    /// Where the obstacles are; empty: where they were.
    void move_obstacles(std::span<const RigidPose> poses);
    /// Null without obstacles.
    const ContactPotential<T>* contact() const { return contact_.get(); }
    /// Contact as another potential of the same nodes has it, in its second derivatives alone, by a factor.
    void touch(std::span<const TouchedNode> nodes, double factor);
    /// What touches at the last linearisation.
    std::span<const TouchedNode> touched() const { return touched_; }
    /// Replaces the pull: its strength a in 1/s^2, >= 0, and the displacements v in m, one a node.
    void pull(double strength, VectorField<const T> towards);
    void release() {
        pull_strength_ = 0;
        damping_.reset();
    }
    /// Replaces the damping of the springs by one of the strength b >= 0 about the displacements u_n (m).
    void damp(double strength, VectorField<const T> from);
    /// b (u - u_n) . C (u - u_n) in J: what a step to `state` dissipates.
    double dissipation(State<T>& state) const;

    /// Sets the held components of a state to their prescribed displacements.
    void impose(State<T>& state) const;
    /// Whether that would change it.
    bool prescribed_to_move(const State<T>& state) const;
    /// The axes along which something is held, by bits.
    unsigned held_axes() const;
    /// Of a body that is pulled: along the other axes, moves all nodes alike so that the gradient, which is given,
    /// comes to zero as a sum. Such a move changes nothing but the pull, and what touches obstacles.
    void balance_as_a_whole(const NodeVector<T>& gradient, State<T>& state) const;
    /// step = prescribed - present displacement on held components, zero on free ones.
    void prescribed_step(const State<T>& state, NodeVector<T>& step) const;
    /// How steps are to be carried out at these supports; null where they are straight. In time nothing is slender: a
    /// pull holds every node.
    Turning<T>* turning();
    const Sections& sections() const { return turning_.sections(); }
    /// The axis along which nothing holds the body against the resultant of the loads, or -1.
    int falling_axis() const;
    std::size_t free_components() const { return free_count_; }
    /// 1 on free components of the body's nodes, 0 elsewhere.
    const NodeVector<T>& free() const { return free_; }
    /// The masks of the held axes, one a node.
    std::span<const std::uint8_t> held() const { return held_; }
    double pull_strength() const { return pull_strength_; }
    /// The strength of the pull times the nodal masses, N by the body's unit, one a node; empty without a pull.
    std::span<const double> pull_stiffness() const {
        return pull_strength_ > 0 ? std::span<const double>(pull_stiffness_) : std::span<const double>();
    }

    /// The same by components; null without a pull.
    const NodeVector<T>* pull_weight() const { return pull_strength_ > 0 ? &pull_weight_ : nullptr; }

    struct Value {
        double total = 0;
        double size = 0; ///< the sum of the terms' magnitudes: what rounding errors are measured by
    };
    Value value(State<T>& state) const;
    /// The derivatives with respect to the free components; zero elsewhere.
    Balance gradient(State<T>& state, NodeVector<T>& gradient) const;

    /// Takes second derivatives at `state`, which must stay as it is while they are used. `contact`: of contact too.
    void linearise(State<T>& state, bool contact = true);
    /// What touches at a state; nothing without obstacles.
    std::vector<ComingTouch> touches(const State<T>& state) const {
        return contact_ ? contact_->touches(state) : std::vector<ComingTouch>();
    }
    /// Of these what does not touch at the last linearisation counts as a spring each until the next one: adds their
    /// derivatives to `gradient`, and returns what they store, N; negative where there is none.
    double expect(std::vector<ComingTouch> touches, NodeVector<T>& gradient);
    /// The displacements of the last linearisation.
    const NodeField<T>& displacement() const { return linearised_->displacement; }
    /// out = second derivatives times p at the last linearisation; zero on held components, where p need not be.
    void multiply(const NodeVector<T>& p, NodeVector<T>& out, Curvature curvature = Curvature::whole) const;
    /// The same without the pull, and with whatever it is on held components.
    void multiply_body(const NodeVector<T>& p, NodeVector<T>& out, Curvature curvature) const;
    /// The diagonal 3x3 blocks of the body's second derivatives there, without the pull, with damping and contact: xx,
    /// yy, zz, xy, xz, yz by places in the layout.
    void diagonal(AlignedArray<T> (&blocks)[6], Curvature curvature = Curvature::whole) const;

    VolumeRatios volume_ratios(const State<T>& state) const;

    /// The mean rest length of the springs and the extent of the body at rest, in the body's unit.
    double length() const { return length_; }
    double extent() const { return extent_; }
    /// A force (N) that stands for a strain of 1e-9: below it a body counts as unloaded.
    double force_floor() const { return force_floor_; }

private:
    /// C at u_n, and what it makes of a vector.
    struct Damping {
        double strength;
        State<T> from;
        NodeVector<T> away, product;
    };
    /// damping_->product = C p.
    void apply_damping(const NodeField<T>& p) const;
    /// damping_->product = C (u - u_n), damping_->away = u - u_n.
    void apply_damping(const State<T>& state) const;

    struct Held {
        std::size_t array, index;
        T displacement;
    };
    std::size_t flat_index(std::size_t node, std::size_t axis, std::size_t& array) const;

    const Body<T>* body_;
    VectorSpace<T> space_;
    std::unique_ptr<SharedNodes<T>> shared_;
    CellVolumes<T> volumes_;
    Turning<T> turning_;
    bool turning_holds_ = false; ///< the present supports
    double force_floor_ = 0, length_ = 1, extent_ = 1;
    NodeVector<T> free_, load_, pull_target_, pull_weight_;
    std::vector<std::uint32_t> places_; ///< of the nodes in the layout
    std::vector<std::uint8_t> held_;
    std::vector<Held> prescribed_;
    State<T>* linearised_ = nullptr;
    std::size_t free_count_ = 0;
    bool loaded_ = false;
    std::unique_ptr<Damping> damping_;
    std::unique_ptr<PressurePotential<T>> pressure_;
    std::unique_ptr<ActuatedBody<T>> actuation_;
    double largest_actuation_ = 0; ///< N: of the largest component of its forces at rest
    std::unique_ptr<ContactPotential<T>> contact_;
    std::vector<TouchedNode> touched_; ///< at the last linearisation
    double pull_strength_ = 0;
    std::vector<double> pull_stiffness_;
    double largest_load_ = 0;
    std::array<double, 3> resultant_ = {0, 0, 0}, load_size_ = {0, 0, 0};
};

extern template class Potential<float>;
extern template class Potential<double>;

} // namespace hybmss
