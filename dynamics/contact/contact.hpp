#pragma once

#include "dynamics/contact/free_obstacle.hpp"
#include "dynamics/contact/obstacle_geometry.hpp"
#include "dynamics/step.hpp"
#include "hybmss/contact.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace hybmss {

/// What obstacles do to a body: one of these at most.
template <class T>
class ObstacleEffect : public StepEffect<T> {
public:
    /// One pose an obstacle. Throws std::invalid_argument for another count and numbers that are not finite.
    virtual void move(std::span<const RigidPose> poses) = 0;
    virtual std::vector<ObstacleReading> readings(const Body<T>& body, State<T>& state) const = 0;
    /// Where they are now. `half`: the kick that velocities lack still, or null; see StepEffect::complete().
    virtual std::vector<RigidPose> poses(const State<T>& state, const StepFactors* half) const = 0;

    std::string_view name() const override { return "contact"; }

protected:
    /// One that touches: what its spring stores (J), how deep it is (m), where it is from the obstacle's position, the
    /// force on it, and what the step's second half has yet to take (J).
    static void add_touch(ObstacleReading& reading, double stored, double depth, const Point& arm, const Point& force,
                          double taken) {
        reading.energy += stored;
        reading.dissipated -= taken;
        reading.force = plus(reading.force, 1, force);
        reading.torque = plus(reading.torque, 1, cross(arm, force));
        reading.nodes += 1;
        reading.depth = std::max(reading.depth, depth);
        reading.greatest_depth = std::max(reading.greatest_depth, depth);
    }
};

/// Contact of surface nodes with rigid obstacles, and Coulomb friction, by impulses at the end of a step. A node of
/// mass m that would end it at the depth p with the velocity v, as seen from the obstacle, n being the way out, gets
///
///     m a n,       a = w^2 (p - dt^2 a)      the spring of W = 1/2 m w^2 depth^2, where it leaves the node
///     friction     what brings v to rest along the surface, at most mu m b,   b' = (a - b) / tau
///
/// which is backward Euler for contact and semi-implicit Euler for all else: stable wherever that is, whatever w, never
/// pulling, and damping what beats against the obstacle. A node that sticks stays where it is, to rounding.
///
/// Friction follows the push with a delay (Prakash and Clifton's law). Coulomb's own, that has none, makes an elastic
/// body that slides on a rigid one unstable at every wave length: nodes flutter, and let go. b is the mean of a over
/// the steps in which the node touches, so that both come to the same impulse.
///
/// Obstacles are where their velocities bring them by the end of the step; what is prescribed is where it was.
///
/// Free obstacles come after those that are led, one after the other, each in a stage of one piece: see FreeObstacle.
///
/// Nodes are kept in blocks of neighbours. A block far away is not looked at before it can have come near: see
/// step_block().
template <class T>
class Contact final : public ObstacleEffect<T> {
public:
    /// `wave_speed`: m/s, of the body. Throws std::invalid_argument for what the structs do not allow.
    Contact(const Body<T>& body, double wave_speed, std::span<const SurfaceNode> surface,
            std::span<const Obstacle> obstacles);

    void move(std::span<const RigidPose> poses) override;
    std::vector<ObstacleReading> readings(const Body<T>& body, State<T>& state) const override;
    std::vector<RigidPose> poses(const State<T>& state, const StepFactors* half) const override;

    // A step of a free obstacle in parts, for one that several bodies touch: find_touches() of each of them after its
    // own step, FreeObstacle::solve(), take_touches(). Meanwhile it is shared, and the body's own steps leave it alone.
    const std::vector<Obstacle>& obstacles() const { return obstacles_; }
    void share(std::size_t obstacle, bool shared) { shared_[obstacle] = shared; }
    const FreeMotion& motion(std::size_t obstacle) const { return motions_[obstacle]; }
    /// Of one that others may have moved.
    void set_motion(std::size_t obstacle, const FreeMotion& motion) { motions_[obstacle] = motion; }
    /// Appends.
    void find_touches(std::size_t obstacle, const FreeObstacle& free, const State<T>& state, const StepFactors& factors,
                      std::vector<FreeTouch>& touches);
    void take_touches(std::size_t obstacle, const FreeObstacle& free, std::span<const FreeTouch> touches,
                      State<T>& state, const StepFactors& factors);

    /// All nodes around the removed cells belong to the surface now, if they have mass. In time proportional to them;
    /// the first call takes a pass over the surface.
    void body_was_cut(const Body<T>& body, const Lattice& lattice, const NodeNumbers& numbers,
                      std::span<const CutNode> nodes) override;

    std::size_t bytes() const override;
    double energy(const Body<T>& body, State<T>& state) const override;
    double dissipated(const Body<T>& body, State<T>& state) const override;
    void add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const override;
    void set_prescribed(std::span<const PrescribedComponent<T>> prescribed) override;
    void set_loaded(std::span<const LoadedComponent<T>> loaded) override;
    void set_pushed(double acceleration) override;
    void add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                    std::vector<Stage>& stages) override;
    void add_last_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                         std::vector<Stage>& stages) override;
    void state_was_set() override;
    void complete(const State<T>& state, const StepFactors& half) override;
    std::vector<double> memory() const override;
    std::size_t memory_size() const override;
    void set_memory(std::span<const double> memory) override;

private:
    struct Node {
        Point rest;            ///< m
        std::size_t index;     ///< in the body's fields
        double mass;           ///< kg; 0 where all its cells have been cut away: it touches nothing
        std::uint8_t held = 0; ///< axes that are prescribed, as bits: no impulse moves them
    };
    /// Of a node on an obstacle with friction, m/s^2.
    struct Grip {
        Point friction = {0, 0, 0}; ///< in the last step
        double push = 0;            ///< b; 0 where it is out of reach
    };
    /// A block of nodes and one obstacle.
    struct Watch {
        double near = 0;                                        ///< m that they may still come nearer unseen
        double speed = 0;                                       ///< m/s, at most, at which they do now
        double dissipated = 0;                                  ///< J
        double greatest_depth = 0;                              ///< m
        Point impulse = {0, 0, 0}, angular_impulse = {0, 0, 0}; ///< N s and N m s

        /// Whether they may touch in a step.
        bool looks(double time_step, double gain_of_speed) const {
            return !(near - (speed + gain_of_speed) * time_step > 0);
        }
        /// That, and the step is taken off what they may still come nearer.
        bool passes(double time_step, double gain_of_speed) {
            const bool looked = looks(time_step, gain_of_speed);
            speed += gain_of_speed;
            near -= speed * time_step;
            return looked;
        }
    };
    /// How a step ends for the nodes of a block.
    struct Step {
        double time_step;
        double gain;   ///< of velocity by acceleration: the time that it acts, less what mass damping takes
        double acting; ///< s: that time
        double gain_of_speed;
    };

    static constexpr std::size_t kBlock = 128; ///< nodes
    static constexpr std::size_t kBlocksAPiece = 8;
    static constexpr int kAsleep = 16; ///< steps at most in which a block is not looked at

    std::size_t block_count() const { return (nodes_.size() + kBlock - 1) / kBlock; }
    std::size_t piece_count() const { return (block_count() + kBlocksAPiece - 1) / kBlocksAPiece; }
    double elapsed() const { return elapsed_.empty() ? 0 : elapsed_[0]; }
    /// m/s that a node may gain in a step besides what its springs give it.
    double gain_of_speed(const StepFactors& factors) const {
        return factors.acting * (length(factors.acceleration) + load_acceleration_ + push_acceleration_);
    }
    Step ends_by(const StepFactors& factors) const {
        return {factors.time_step, factors.late_force, factors.acting, gain_of_speed(factors)};
    }
    bool has_friction(std::size_t obstacle) const { return obstacles_[obstacle].friction > 0; }
    bool is_free(std::size_t obstacle) const { return obstacles_[obstacle].mass > 0; }
    /// By half a kick of gravity and of what touches it now.
    FreeMotion whole_motion(std::size_t obstacle, const State<T>& state, const StepFactors& half) const;
    template <class Shape>
    void find_touches_of(const Shape& shape, std::size_t obstacle, const FreeObstacle& free, const State<T>& state,
                         const Step& step, std::vector<FreeTouch>& touches);
    void number_nodes();
    void node_was_cut(const Body<T>& body, std::uint32_t number, const Point& rest);
    RigidPose pose_after(std::size_t obstacle, double time) const {
        return is_free(obstacle) ? motions_[obstacle].pose : hybmss::pose_after(obstacles_[obstacle].pose, time);
    }
    /// In the obstacle's axes.
    Point place(const RigidPose& pose, const Node& node, const State<T>& state) const;
    /// m/s, in space.
    Point velocity(const Node& node, const State<T>& state) const;
    template <class Shape>
    void step_block(const Shape& shape, std::size_t obstacle, const RigidPose& pose, std::size_t block, State<T>& state,
                    const Step& step);
    /// Ends a step for a node that touched at its beginning or would at its end. Returns whether it does now.
    template <class Shape>
    bool step_node(const Shape& shape, std::size_t obstacle, const RigidPose& pose, std::size_t n, const Point& place,
                   State<T>& state, const Step& step, Watch& watch);
    /// The acceleration without what goes along axes that are held.
    static Point freely(const Node& node, Point acceleration) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            acceleration[axis] *= node.held >> axis & 1 ? 0 : 1;
        }
        return acceleration;
    }
    void accelerate(const Node& node, const Point& gained, const Step& step, State<T>& state) const;
    /// Friction of the step before is over; where the node is out of reach, b too.
    void loosen(std::size_t obstacle, std::size_t n, double distance, double reach) {
        if (has_friction(obstacle)) {
            Grip& grip = grips_[obstacle][n];
            grip.friction = {0, 0, 0};
            grip.push = distance < reach ? grip.push : 0;
        }
    }
    /// All nodes may have come nearer by `way`, m.
    void come_nearer(double way);
    /// visit(obstacle, its pose, node's number, place in its axes, depth, force on the node in N) for every touch.
    template <class Visit>
    void for_each_touch(const State<T>& state, const Visit& visit) const;

    double length_unit_;
    double wave_speed_;
    double load_acceleration_ = 0;                   ///< m/s^2, by which a load accelerates a node at most
    double push_acceleration_ = 0;                   ///< likewise other effects
    std::vector<PrescribedComponent<T>> prescribed_; ///< as they were set last
    std::vector<Obstacle> obstacles_;
    std::vector<FreeMotion> motions_; ///< one an obstacle; of free ones
    std::vector<bool> shared_;        ///< likewise: others step it, for now
    std::vector<FreeTouch> touches_;  ///< scratch
    std::vector<Node> nodes_;
    std::vector<std::vector<Grip>> grips_;    ///< one a node, for every obstacle with friction
    std::vector<Point> before_;               ///< m/s: velocities before the step, in blocks that may touch
    std::vector<std::vector<Watch>> watches_; ///< one a block, for every obstacle
    double time_step_ = 0;                    ///< s: the last one
    std::vector<double> elapsed_;             ///< s since the obstacles were moved; one a piece, all the same
    std::optional<SurfaceNode> known_;        ///< one of those that were given, if there were any
    std::unordered_map<std::size_t, std::size_t> numbers_; ///< of nodes_, by their index; made when called for
};

extern template class Contact<float>;
extern template class Contact<double>;

} // namespace hybmss
