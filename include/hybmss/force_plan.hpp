#pragma once

/// \file
/// Forces and energies of a body over caller-owned memory.

#include "hybmss/export.h"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "hybmss/plan_options.hpp"
#include "hybmss/vector_field.hpp"

#include <memory>
#include <span>

namespace hybmss {

/// Potential energies in J.
struct PotentialEnergy {
    double springs = 0;
    double volume = 0;
    double total() const { return springs + volume; }
};

/// A body prepared for one machine: layout, kernel, tiles and threads are chosen once, here. T is float or double.
///
/// Immutable once made: any number of threads may execute one plan at the same time. Results are bit-identical for any
/// number of threads. Construction throws std::invalid_argument with the name, the value and the allowed range.
template <class T>
class HYBMSS_EXPORT ForcePlan {
public:
    ForcePlan(const Lattice& lattice, const Material& material, const PlanOptions& options = {});
    explicit ForcePlan(const Network& network, const PlanOptions& options = {});
    ForcePlan(ForcePlan&&) noexcept;
    ForcePlan& operator=(ForcePlan&&) noexcept;
    ~ForcePlan();

    std::size_t node_count() const;

    /// Adds to `force` (N) the internal force at the displacements u = x - X (m). Both fields have node_count() nodes
    /// in the body's node order; they must not overlap. Throws std::invalid_argument where a size differs, a
    /// component is null or two of them are the same memory. Values are not checked: a node that is not finite, or so
    /// far away that its square is not, leaves numbers that are not finite in the energy and in the forces on nodes
    /// that share a cell or spring with it, and nowhere else.
    void add_forces(VectorField<const T> displacement, VectorField<T> force) const;

    /// The energy (J) at the displacements, summed in double.
    PotentialEnergy energy(VectorField<const T> displacement) const;

    /// Adds to `product` (N) the second derivatives times a direction: K p, K = d^2 W / du^2 (N/m) at the displacements
    /// u, p = `direction` (m). So forces at u + p are forces at u less K p, to the first order. K is symmetric, and
    /// indefinite where springs or cells are compressed. All three fields have node_count() nodes in the body's node
    /// order; `product` must not overlap the others. Throws std::invalid_argument where a size differs.
    void add_hessian_product(VectorField<const T> displacement, VectorField<const T> direction,
                             VectorField<T> product) const;

    /// Sets `blocks` to the symmetric 3x3 blocks on the diagonal of K (N/m) at the displacements, six values a node in
    /// the body's node order: xx, yy, zz, xy, xz, yz. Throws std::invalid_argument unless it has 6 node_count() values.
    void hessian_diagonal(VectorField<const T> displacement, std::span<T> blocks) const;

    /// A guaranteed lower bound (s) of the largest stable step of the semi-implicit Euler method near rest: 2 / sqrt of
    /// an upper bound of the largest eigenvalue of M^-1 K, by the largest one of a single cell (lattice) or by row sums
    /// (network).
    double critical_time_step() const;

    /// The largest stable step (s) of the semi-implicit Euler method for small motions about the displacements,
    /// estimated by Lanczos' method: about a thousandth above the true one, where critical_time_step() may be well
    /// below it. Costs some tens of Hessian products. Infinite where nothing resists. Throws std::invalid_argument
    /// where the size differs.
    double estimate_critical_time_step(VectorField<const T> displacement) const;

    PlanDescription describe() const;

private:
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

extern template class ForcePlan<float>;
extern template class ForcePlan<double>;

} // namespace hybmss
