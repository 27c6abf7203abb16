#pragma once

/// \file
/// The infinite lattice under one homogeneous deformation x = F X: its energy and stress, and the stiffness of plane
/// (Bloch) waves on top of it. From numbers alone, like everything in reference/.

#include "hybmss/material.hpp"
#include "reference/body.hpp"

#include <array>

namespace hybmss::reference {

/// What every node of the infinite lattice sees at x = F X. The cell edge is 1 m: stiffnesses in N/m and moduli in Pa
/// are then the same numbers, and a wave's phase is its wave vector times the cell edge.
class HomogeneousLattice {
public:
    /// The material must be valid. Where its springs act matters to waves alone, and to long ones not.
    HomogeneousLattice(const Material& material, const Matrix3d& deformation);

    /// W, J per m^3 of the undeformed body.
    double energy_density() const;
    /// P = dW/dF, Pa: the first Piola-Kirchhoff stress.
    Matrix3d stress() const;

    /// D(q), N/m: the forces -D U on a node when node X moves by U cos(q.X), q h = `phase` in radians. Real and
    /// symmetric, since every node is a centre of symmetry. D U = rho h^3 omega^2 U gives the frequencies.
    Matrix3d wave_stiffness(const Vector3d& phase) const;
    /// Q(n) = lim D(q) / (|q|^2 h^3) for q = |q| n, Pa: the acoustic tensor of the continuum of long waves; n is a unit
    /// vector. Positive definite for all n exactly where that continuum is strongly elliptic.
    Matrix3d acoustic_tensor(const Vector3d& direction) const;

private:
    struct SpringVector {
        Vector3d rest;     ///< r, in cell edges
        Matrix3d hessian;  ///< k [t I + (1 - t) n n^T]
        Vector3d tension;  ///< k t d, the force on its low end
        double energy = 0; ///< 1/2 k (|d| - l)^2
    };
    Matrix3d hourglass_stiffness(const Vector3d& sine, const Vector3d& cosine) const;

    Matrix3d deformation_;
    SpringForm form_;
    HourglassStiffness hourglass_;
    std::array<SpringVector, 13> springs_;
    VolumeEnergy volume_energy_;
    Cell cell_;         ///< of the edge 1
    Matrix3d cofactor_; ///< columns b x c, c x a, a x b: the derivatives of V'
};

} // namespace hybmss::reference
