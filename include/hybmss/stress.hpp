#pragma once

/// \file
/// Stress and strain of a lattice's cells.

#include "hybmss/export.h"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/plan_options.hpp"
#include "hybmss/vector_field.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace hybmss {

/// Of one cell, as a mean over it. F is its mean deformation gradient: the columns a/h, b/h, c/h of its mean edges.
/// Components of symmetric tensors: xx, yy, zz, xy, yz, xz.
struct CellStress {
    /// First Piola stress, Pa, row by row: P = 1/V0 sum over the corners of (dW/dx) X^T, W the energy of the cell's
    /// springs, each with its share, of its volume, and of what else resists. In a homogeneous deformation dW/dF a
    /// volume at rest. In an equilibrium the sum of V0 P over the cells is that of (support force + load) X^T over the
    /// nodes.
    std::array<double, 9> first_piola{};
    std::array<double, 6> cauchy{};       ///< Pa: the symmetric part of P F^T / J; |J| taken as 1e-9 at least
    std::array<double, 6> green_strain{}; ///< (F^T F - I) / 2
    double volume_ratio = 1;              ///< J = det F
    double energy_density = 0;            ///< J/m^3 at rest

    /// Pa: minus a third of the Cauchy stress's trace.
    HYBMSS_EXPORT double pressure() const;
    /// Pa, of the Cauchy stress.
    HYBMSS_EXPORT double von_mises() const;
};

/// Where values of cells go, a number each, in the caller's memory; null: they are not wanted, and not written.
/// Components and units are those of CellStress.
template <class T>
struct StressArrays {
    std::array<T*, 9> first_piola{};
    std::array<T*, 6> cauchy{}, green_strain{};
    T *volume_ratio = nullptr, *energy_density = nullptr, *von_mises = nullptr, *pressure = nullptr;
};

/// Reads the stresses of a body made of a lattice and a material.
class HYBMSS_EXPORT StressMeter {
public:
    /// Cells are those of a scale above zero in index order, nodes numbered as Lattice::nodes() lists them. Of the
    /// options threads, task runner, instruction set and accuracy. Throws std::invalid_argument for a material that is
    /// not allowed.
    StressMeter(const Lattice& lattice, const Material& material, const PlanOptions& options = {});
    /// The same of a body that has lost cells since its `node_count` nodes were numbered: `cells` has for each of those
    /// left the nodes at its corners (bit 0 of a corner's number: high side in x, bit 1: y, bit 2: z).
    StressMeter(const Lattice& lattice, const Material& material, std::span<const std::array<std::uint32_t, 8>> cells,
                std::size_t node_count, const PlanOptions& options = {});
    StressMeter(StressMeter&&) noexcept;
    StressMeter& operator=(StressMeter&&) noexcept;
    ~StressMeter();

    std::size_t cell_count() const;
    std::size_t node_count() const;

    /// At displacements u = x - X in m, one a node. Throws std::invalid_argument unless there are node_count() of them
    /// and cell_count() stresses. Computed in T by a kernel of the instruction set; the same bits for any number of
    /// threads, and at `exact` on every set. Takes 3 T a node of memory for the while.
    template <class T>
    void read(VectorField<const T> displacement, std::span<CellStress> stresses) const;
    /// Likewise what is wanted alone, into arrays of cell_count() numbers.
    template <class T>
    void read(VectorField<const T> displacement, const StressArrays<T>& arrays) const;

private:
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

extern template HYBMSS_EXPORT void StressMeter::read(VectorField<const float>, std::span<CellStress>) const;
extern template HYBMSS_EXPORT void StressMeter::read(VectorField<const double>, std::span<CellStress>) const;
extern template HYBMSS_EXPORT void StressMeter::read(VectorField<const float>, const StressArrays<float>&) const;
extern template HYBMSS_EXPORT void StressMeter::read(VectorField<const double>, const StressArrays<double>&) const;

} // namespace hybmss
