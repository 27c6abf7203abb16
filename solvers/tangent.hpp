#pragma once

#include "hybmss/network.hpp"
#include "solvers/vector_space.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace hybmss {

/// A symmetric 3x3 matrix: xx, xy, xz, yy, yz, zz.
template <class T>
using Symmetric3 = std::array<T, 6>;

/// The second derivatives of a body's energy at one state, spring by spring and cell by cell.
///
///     spring:  k [t I + (1 - t) n n^T],  t = 1 - l/|d|,  n = d/|d|
///     cell:    kappa [phi''/V0 g g^T + phi' hess V'],  g = dV'/dx
///
/// Lengths are in the body's unit L and forces in N: derivatives are by u / L.
template <class T>
class Tangent {
public:
    /// `body` was made from `network` or from the lattice that `network` was made from.
    Tangent(const Body<T>& body, Network network);

    /// Takes the derivatives at the displacements of `state`.
    void linearise(const State<T>& state);
    /// out = K p. Padding of `out` becomes zero.
    void multiply(const NodeVector<T>& p, NodeVector<T>& out) const;
    /// The diagonal block of each node of the body, in N; springs under compression without their negative part, cells
    /// without what is not convex in the volume.
    void convex_diagonal(std::vector<Symmetric3<double>>& blocks) const;

private:
    struct Spring {
        std::uint32_t a, b;
        Symmetric3<T> block;
        Symmetric3<T> convex;
    };
    struct Cell {
        std::array<std::uint32_t, 8> nodes;
        std::array<T, 9> edges;    ///< a, b, c at present
        std::array<T, 9> gradient; ///< dV'/da, dV'/db, dV'/dc: b x c, c x a, a x b
        T curvature, slope;        ///< kappa phi''/V0 and kappa phi'
    };

    const Body<T>* body_;
    Network network_;
    std::vector<std::array<double, 9>> rest_edges_;
    std::vector<double> rest_volume_;
    std::vector<std::uint32_t> place_; ///< of each node in the layout
    std::vector<Spring> springs_;
    std::vector<Cell> cells_;
};

extern template class Tangent<float>;
extern template class Tangent<double>;

} // namespace hybmss
