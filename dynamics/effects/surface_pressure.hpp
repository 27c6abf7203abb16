#pragma once

#include "dynamics/step.hpp"
#include "hybmss/pressure.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// Where the corners of a face are, in the order of SurfaceFace; m.
using FaceCorners = std::array<std::array<double, 3>, 4>;

/// The forces of a pressure of 1 Pa on the corners of the bilinear face x(s, t) = sum N_a x_a, 0 <= s, t <= 1:
///
///     f_a = - integral of N_a (dx/ds x dx/dt) ds dt,   dx/ds x dx/dt = n + s m + t l,
///     n = (b - a) x (d - a),   m = (b - a) x q,   l = q x (d - a),   q = a - b + c - d
///
/// On a closed surface the sum over its faces is minus the derivative of the volume inside.
FaceCorners pressure_forces(const FaceCorners& x);

/// Throws std::invalid_argument for a face with a node that the body does not have, one twice, or a rest position that
/// is not finite.
void check_faces(std::span<const SurfaceFace> faces, std::size_t nodes);
/// Likewise for another count than that of the faces, and a pressure that is not finite.
void check_pressures(std::span<const double> pressures, std::size_t faces);

/// Pressure on faces that follows them. Forces are those at the beginning of a step. The force of a state does the work
///
///     dt/2 f . (v_before + v_after)
///
/// with the velocities by which the body comes to it and leaves it, as a step itself keeps energy; at the first state
/// the latter alone. What is done up to a state is the effect's energy, less what it was at first, whether the faces
/// close or not and whatever the pressure does meanwhile.
///
/// Nodes say where they are, faces give their corners forces, nodes gather them in the order of the faces: the same for
/// any number of threads.
template <class T>
class SurfacePressure final : public StepEffect<T> {
public:
    /// Throws as check_faces() and check_pressures() do.
    SurfacePressure(const Body<T>& body, std::span<const SurfaceFace> faces, std::span<const double> pressures);

    void set(std::span<const double> pressures);
    std::span<const double> pressures() const { return pressures_; }
    /// The same where a kick of so many seconds by the pressures before is still to come: the velocities take what it
    /// differs by from one by these, and it does its work on the way to this state.
    void set(std::span<const double> pressures, const Body<T>& body, State<T>& state, double pending);
    /// By how much it accelerates a node at most, m/s^2, where no face has become four times as large.
    double greatest_acceleration(const Body<T>& body) const;

    std::string_view name() const override { return "pressure"; }
    std::size_t bytes() const override;
    double energy(const Body<T>& body, State<T>& state) const override;
    double dissipated(const Body<T>&, State<T>&) const override { return 0; }
    void add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const override;
    void add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                    std::vector<Stage>& stages) override;
    void add_last_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                         std::vector<Stage>& stages) override;
    void body_was_cut(const Body<T>& body, const Lattice& lattice, const NodeNumbers& numbers,
                      std::span<const CutNode> nodes) override;
    std::vector<double> memory() const override;
    std::size_t memory_size() const override { return 1 + work_.size(); }
    void set_memory(std::span<const double> memory) override;

private:
    using Point = std::array<double, 3>;
    struct Node {
        Point rest;              ///< m
        std::size_t index;       ///< in the body's fields
        std::uint32_t number;    ///< in the body
        std::uint32_t first_use; ///< in uses_
    };
    struct Face {
        std::array<std::uint32_t, 4> nodes; ///< by their places in nodes_
        bool there = true;                  ///< its cell has not been cut away
    };
    /// A corner of a face.
    struct Use {
        std::uint32_t face;
        std::uint32_t corner;
    };
    static constexpr std::size_t kPiece = 128; ///< nodes or faces

    /// Of a field, looked up once: an access through the field each time costs as much as all else.
    using Components = std::array<Component<const T>, 3>;
    static Components components(const NodeField<T>& field) {
        return {component(field, 0), component(field, 1), component(field, 2)};
    }
    static std::size_t pieces(std::size_t count) { return (count + kPiece - 1) / kPiece; }
    /// Where a node is now, m.
    Point position(const Node& node, const Components& displacement) const;
    /// Forces on the corners of a face whose nodes are at positions_ or the like.
    void push(std::size_t face, std::span<const Point> positions, FaceCorners& forces) const;
    Point gathered(std::size_t node, std::span<const FaceCorners> forces) const;
    /// m/s.
    Point velocity(const Node& node, const Components& velocity) const;
    /// visit(node, its force in N) for all nodes.
    template <class Visit>
    void for_each_force(const State<T>& state, const Visit& visit) const;

    double length_unit_;
    std::vector<Node> nodes_;
    std::vector<Face> faces_;
    std::vector<Use> uses_; ///< those of a node together, in the order of the faces
    std::vector<double> pressures_;
    std::vector<Point> positions_;           ///< m, of the step at hand, one a node
    std::vector<FaceCorners> corner_forces_; ///< N, likewise
    std::vector<Point> forces_;              ///< N, likewise, one a node
    std::vector<double> work_;               ///< J, one a piece of nodes
    double half_ = 0;                        ///< s: of the last step, half of it
};

extern template class SurfacePressure<float>;
extern template class SurfacePressure<double>;

} // namespace hybmss
