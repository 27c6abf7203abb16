#pragma once

#include "dynamics/contact/contact.hpp"

namespace hybmss {

/// Contact of the points of a body's skin with rigid obstacles, as Contact has it for nodes. The masses of nodes are
/// shared out among the points around by their weights; a point with the part M at the depth p gets the force
///
///     M a n,    a = w^2 (p - r dt^2 a),    r = max over its nodes of sum |weight| M / mass over their points, at least
///     1
///
/// w^2 the obstacle's stiffness, and hands it to its nodes by their weights. All points act on what the step left, so
/// none comes before another, and dt^2 r a is at least how far all of them together can move it: no number of points
/// makes a step unstable, or a body stiffer to touch. (One after the other, as bodies that touch each other have it,
/// those first in line carry more, and a ball rolls off by itself.)
///
/// A point's force in a step is kept for those who read it.
template <class T>
class SkinContact final : public ObstacleEffect<T> {
public:
    /// Throws std::invalid_argument for what the structs do not allow.
    SkinContact(const Body<T>& body, double wave_speed, std::span<const SkinPoint> skin,
                std::span<const Obstacle> obstacles);

    void move(std::span<const RigidPose> poses) override;
    std::vector<ObstacleReading> readings(const Body<T>& body, State<T>& state) const override;
    std::vector<RigidPose> poses(const State<T>& state, const StepFactors* half) const override;
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
    std::vector<double> memory() const override;
    std::size_t memory_size() const override;
    void set_memory(std::span<const double> memory) override;

private:
    struct Vertex {
        Point rest;                         ///< m
        std::array<std::uint32_t, 8> nodes; ///< of the body
        std::array<std::size_t, 8> index;   ///< in its fields
        std::array<double, 8> weights;
        std::array<Point, 8> gain; ///< of a node's speed along each axis by an acceleration of the vertex
        Point share;               ///< by weights, what is free along each axis; 1 where nothing is held
        double mass;               ///< kg: its part of the nodes'; 0: it touches nothing
        double response = 1;       ///< of its acceleration, at most, to one of 1 of all points around
    };
    /// Of a vertex and an obstacle.
    struct Touch {
        Point acceleration = {0, 0, 0}; ///< m/s^2, in the last step
        double push = 0;                ///< m/s^2: what friction goes by; 0 where it is out of reach
    };
    /// A vertex that may touch an obstacle in this step.
    struct Near {
        std::size_t obstacle, vertex;
        double was; ///< m: its depth before
    };
    /// A block of vertices and an obstacle: m that they may still come nearer unseen, and the speed at which they do.
    struct Watch {
        double near = 0, speed = 0;
        bool looks(double time_step) const { return !(near - speed * time_step > 0); }
    };
    /// Of an obstacle, since it was set.
    struct Sums {
        double dissipated = 0, greatest_depth = 0;
        Point impulse = {0, 0, 0}, angular_impulse = {0, 0, 0};
    };

    static constexpr std::size_t kBlock = 128;
    static constexpr int kAsleep = 16;

    std::size_t block_count() const { return (vertices_.size() + kBlock - 1) / kBlock; }
    void weigh(const Body<T>& body);
    void come_nearer(double way);
    /// m, m/s in space.
    Point position(const Vertex& vertex, const State<T>& state) const;
    Point velocity(const Vertex& vertex, const State<T>& state) const;
    /// `start` and a field's value at the vertex.
    Point sum(const Vertex& vertex, const NodeField<T>& field, Point start) const;
    void step(State<T>& state, const StepFactors& factors);
    template <class Shape>
    void step_block(const Shape& shape, std::size_t obstacle, const RigidPose& pose, std::size_t block,
                    const State<T>& state, const StepFactors& factors);
    template <class Shape>
    void step_vertex(const Shape& shape, std::size_t obstacle, const RigidPose& pose, std::size_t n, const Point& place,
                     const State<T>& state, const StepFactors& factors);
    void push(const Vertex& vertex, const Point& acceleration, State<T>& state, const StepFactors& factors) const;
    /// visit(obstacle, its pose, vertex, place in its axes, depth, force on it in N) of those that are in it or pushed.
    template <class Visit>
    void for_each_touch(const State<T>& state, const Visit& visit) const;

    double length_unit_, wave_speed_;
    double pushed_ = 0, loaded_ = 0; ///< m/s^2, by which effects and loads accelerate a node at most
    std::vector<PrescribedComponent<T>> prescribed_;
    std::vector<Obstacle> obstacles_;
    std::vector<Vertex> vertices_;
    std::vector<std::vector<Touch>> touches_; ///< one a vertex, for every obstacle
    std::vector<std::vector<Watch>> watches_; ///< one a block, likewise
    std::vector<Sums> sums_;                  ///< one an obstacle
    std::vector<Point> before_;               ///< m/s: velocities before the step, in blocks that may touch
    std::vector<Near> near_;                  ///< of the step at hand
    double elapsed_ = 0, time_step_ = 0;
    bool held_changed_ = false; ///< what is held has, since the vertices were weighed
};

extern template class SkinContact<float>;
extern template class SkinContact<double>;

} // namespace hybmss
