#pragma once

#include "dynamics/effects/surface_pressure.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "solvers/newton/vector_space.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hybmss {

/// Where pressed faces end: the edges at which the pressures of the faces around do not cancel.
class PressureRim {
public:
    explicit PressureRim(std::span<const SurfaceFace> faces);

    /// The potential of a pressure is p times the volume of the cones from the faces to one point, where on free
    /// components the cones over the rim give no force: each triangle of an edge of the rim and that point must have a
    /// normal along axes that both its nodes are held along. Finds such a point, m. Returns "", or why there is none.
    std::string find_apex(std::span<const double> pressures, std::span<const PrescribedNode> held,
                          std::array<double, 3>& apex) const;

private:
    struct Edge {
        std::uint32_t nodes[2];
        std::array<double, 3> rest[2];
        std::vector<std::pair<std::uint32_t, double>> faces; ///< and by which sense they go round it
    };
    std::vector<Edge> edges_;
};

/// The potential of pressures on faces: sum p (V - V at rest), with the volume of the cone from a bilinear face a, b,
/// c, d to the apex, about which these are:
///
///     V = ([a b c] + [a c d] + [a b d] + [b c d]) / 12,   [a b c] = a . (b x c)
///
/// Where the rim is held its gradient is minus the force of SurfacePressure, up to rounding. Second derivatives are
/// those of V; none of one node alone.
template <class T>
class PressurePotential {
public:
    /// Throws as check_faces() does.
    PressurePotential(const Body<T>& body, std::span<const SurfaceFace> faces);

    /// Pressures without supports, for add_forces() alone.
    void set(std::span<const double> pressures);
    /// Pa, one a face; or none. Throws std::invalid_argument for another count, a pressure that is not finite, and
    /// where there is no potential with these supports.
    void set(std::span<const double> pressures, std::span<const PrescribedNode> held);
    bool acts() const { return acts_; }
    /// J. What its rounding errors are measured by is added to `*size`: volumes, of which those at rest are taken off.
    double value(const State<T>& state, double* size = nullptr) const;
    /// N: of the largest component of the forces at rest.
    double largest_force() const { return largest_force_; }
    /// gradient += p dV/du in N: on what is free minus the force.
    void add_gradient(const State<T>& state, NodeField<T>& gradient) const;
    /// The forces themselves, N, on held nodes too.
    void add_forces(const State<T>& state, NodeField<T>& force) const;
    /// product += second derivatives times `direction`, which is in the body's unit, in N.
    void add_product(const State<T>& state, const NodeField<T>& direction, NodeField<T>& product) const;

private:
    using Point = std::array<double, 3>;
    struct Face {
        std::array<std::size_t, 4> places; ///< of its nodes in the body's fields
        std::array<std::size_t, 4> nodes;  ///< likewise in places_
        FaceCorners rest;
        double pressure = 0;
    };
    /// As seen from a point.
    FaceCorners corners(const Face& face, const Point& from, const State<T>& state) const;
    /// field += the sum over faces of `of_corners(face)`, which adds to the four corners.
    template <class OfCorners>
    void add_sums(const OfCorners& of_corners, NodeField<T>& field) const;

    double length_unit_;
    PressureRim rim_;
    std::vector<Face> faces_;
    std::vector<std::size_t> places_; ///< of all nodes of faces, each once
    Point apex_ = {0, 0, 0};
    double largest_force_ = 0;
    bool acts_ = false;
};

extern template class PressurePotential<float>;
extern template class PressurePotential<double>;

} // namespace hybmss
