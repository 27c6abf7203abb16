#pragma once

/// \file
/// A cube's springs as the sweeps of spring_forms.hpp want them, and their forces in long double.

#include "bench/limits/spring_forms.hpp"
#include "hybmss/material.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace hybmss::bench {

/// edge^3 cells, all lengths in cell edges and stiffnesses times the cell edge, so that forces are in N.
template <class T>
class BoxSprings {
public:
    BoxSprings(int edge, const Material& material, double cell_size, StateForm form);

    /// Moves every node at random by at most strain/2 along each axis; the same for both forms and every type, up to
    /// rounding to T. Deterministic.
    void displace(double strain);
    const SpringGrid<T>& grid() const { return grid_; }
    long cells() const { return static_cast<long>(edge_) * edge_ * edge_; }
    /// The largest component of the error of what grid().force holds, over that of the forces: against long double, for
    /// the displacements as rounded to T.
    double force_error() const;

private:
    std::size_t at(int i, int j, int k) const; ///< into the arrays; the box's nodes have 1 <= i, j, k <= edge + 1
    bool is_inside(int i, int j, int k) const;
    std::array<long double, 3> exact_force(int i, int j, int k) const;

    int edge_, row_;
    StateForm form_;
    std::size_t margin_;
    std::vector<T> state_[3], force_[3], stiffness_[kSpringDirections], displacement_[3];
    SpringGrid<T> grid_;
};

extern template class BoxSprings<float>;
extern template class BoxSprings<double>;

} // namespace hybmss::bench
