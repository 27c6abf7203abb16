#pragma once

#include "dynamics/contact/obstacle_geometry.hpp"
#include "dynamics/step.hpp"
#include "hybmss/contact.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace hybmss {

/// Penalty contact of surface nodes with rigid obstacles, and Coulomb friction. For a node of mass m at the depth p,
/// with the way out n and the stretch s of its tangential spring:
///
///     W = 1/2 m w^2 (p^2 + |s|^2),   f = m w^2 (p n - s),   |s| <= mu p
///
/// s grows by the node's way along the surface, as seen from the obstacle, and is cut back to mu p where it slips. The
/// obstacles' positions are those at the beginning of the step.
///
/// Nodes are kept in blocks of neighbours. A block far away is not looked at before it can have come near: see wait().
template <class T>
class Contact final : public StepEffect<T> {
public:
    /// `wave_speed`: m/s, of the body. Throws std::invalid_argument for what the structs do not allow.
    Contact(const Body<T>& body, double wave_speed, std::span<const SurfaceNode> surface,
            std::span<const Obstacle> obstacles);

    /// One pose an obstacle. Throws std::invalid_argument for another count and numbers that are not finite.
    void move(std::span<const RigidPose> poses);
    std::vector<ObstacleReading> readings(const Body<T>& body, State<T>& state) const;
    void narrow(StepBounds& bounds) const override { bounds.frequencies = bounds.frequencies.with(obstacles_); }
    /// All nodes around the removed cells belong to the surface now, if they have mass. In time proportional to them;
    /// the first call takes a pass over the surface.
    void body_was_cut(const Body<T>& body, const Lattice& lattice, const NodeNumbers& numbers,
                      std::span<const CutNode> nodes) override;

    std::string_view name() const override { return "contact"; }
    std::size_t bytes() const override;
    double energy(const Body<T>& body, State<T>& state) const override;
    double dissipated(const Body<T>& body, State<T>& state) const override;
    void add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const override;
    void set_prescribed(std::span<const PrescribedComponent<T>> prescribed) override;
    void set_loaded(std::span<const LoadedComponent<T>> loaded) override;
    void add_stages(const Body<T>& body, State<T>& state, const StepParameters& parameters,
                    std::vector<Stage>& stages) override;
    void state_was_set() override;
    std::vector<double> memory() const override;
    std::size_t memory_size() const override;
    void set_memory(std::span<const double> memory) override;

private:
    struct Node {
        Point rest;        ///< m
        std::size_t index; ///< in the body's fields
        double mass;       ///< kg; 0 where all its cells have been cut away: it touches nothing
    };
    /// How a node holds to an obstacle, in the obstacle's axes.
    struct Grip {
        Point place = {0, 0, 0};   ///< where it was at the last step
        Point stretch = {0, 0, 0}; ///< of the tangential spring
        bool holds = false;        ///< it touches
        bool known = false;        ///< its place is that of the last step
    };
    /// What a node and an obstacle have to do with each other at a state. Vectors in the obstacle's axes.
    struct Touch {
        double depth;
        Point normal;
        Grip grip;         ///< after the step
        double dissipated; ///< by the slip of this step, J per m w^2
    };
    /// A block of nodes and one obstacle.
    struct Watch {
        double near = 0;           ///< m that they may still come nearer unseen
        double speed = 0;          ///< m/s, at most, at which they do now
        double dissipated = 0;     ///< J
        double greatest_depth = 0; ///< m
    };

    static constexpr std::size_t kBlock = 128; ///< nodes
    static constexpr std::size_t kBlocksAPiece = 8;
    static constexpr int kAsleep = 16; ///< steps at most in which a block is not looked at

    std::size_t block_count() const { return (nodes_.size() + kBlock - 1) / kBlock; }
    std::size_t piece_count() const { return (block_count() + kBlocksAPiece - 1) / kBlocksAPiece; }
    double elapsed() const { return elapsed_.empty() ? 0 : elapsed_[0]; }
    bool has_grips(std::size_t obstacle) const { return obstacles_[obstacle].friction > 0; }
    void node_was_cut(const Body<T>& body, std::uint32_t number, const Point& rest);
    RigidPose pose_after(std::size_t obstacle, double time) const;
    Point place(const RigidPose& pose, const Node& node, const State<T>& state, double length_unit) const;
    Touch touch(const Obstacle& obstacle, const Point& place, const SurfaceDistance& surface, const Grip* grip) const;
    template <class Shape>
    void step_block(const Shape& shape, std::size_t obstacle, const RigidPose& pose, std::size_t block, State<T>& state,
                    double time_step, double gain_of_speed);
    /// All nodes may have come nearer by `way`, m.
    void come_nearer(double way);
    /// visit(obstacle, its pose, node's number, place, touch) for every touch at the present state; what slip takes is
    /// there, and greatest depths are not kept.
    template <class Visit>
    void for_each_touch(const State<T>& state, const Visit& visit) const;

    double length_unit_;
    double wave_speed_;
    double load_acceleration_ = 0;                   ///< m/s^2, by which a load accelerates a node at most
    std::vector<PrescribedComponent<T>> prescribed_; ///< as they were set last
    std::vector<Obstacle> obstacles_;
    std::vector<Node> nodes_;
    std::vector<std::vector<Grip>> grips_;    ///< one a node, for every obstacle with friction
    std::vector<std::vector<Watch>> watches_; ///< one a block, for every obstacle
    std::vector<double> elapsed_;             ///< s since the obstacles were moved; one a piece, all the same
    std::optional<SurfaceNode> known_;        ///< one of those that were given, if there were any
    std::unordered_map<std::size_t, std::size_t> numbers_; ///< of nodes_, by their index; from the first cut on
};

extern template class Contact<float>;
extern template class Contact<double>;

} // namespace hybmss
