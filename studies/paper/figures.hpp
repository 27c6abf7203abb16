#pragma once

/// \file
/// What an experiment gives: by the lattice at equilibrium, or by finite elements.

#include "studies/calculix/problem.hpp"
#include "studies/paper/experiment.hpp"

#include <array>
#include <string>
#include <vector>

namespace hybmss::paper {

/// Which elements, strain and law.
struct ElementChoice {
    calculix::ElementType type = calculix::ElementType::c3d8i;
    calculix::Geometry geometry = calculix::Geometry::nonlinear;
    calculix::Law law = calculix::Law::linear;
};
/// "C3D8I NLGEOM", "C3D20 linear", "C3D8I neo-Hooke".
std::string name(const ElementChoice& choice);

struct Figures {
    std::string failure;      ///< why there is no equilibrium; "" where all is well
    double volume_change = 0; ///< e = |sum V' - sum V| / sum V
    /// N, N m or m: force or torque that the plate exerts, or the mean deflection of a beam's free end; along
    /// response_axis().
    double response = 0;
    std::vector<std::array<double, 3>> pictured; ///< displacements of pictured_nodes(), m
    double seconds = 0;                          ///< of the whole solve
    bool good() const { return failure.empty(); }
};

/// The static equilibrium of the lattice, in double. The material's A and volume energy count.
Figures solve_lattice(const Experiment& experiment, const Material& material);
/// The same for one of the paper's variants.
Figures solve_lattice(const Experiment& experiment, Model model);

/// By CalculiX; volumes are those of the cells spanned by the corners, as for the lattice. Where the program fails,
/// `failure` says how. Throws std::runtime_error where it is not installed.
Figures solve_finite_elements(const Experiment& experiment, const ElementChoice& choice);

/// The mean distance between two sets of pictured nodes, m. Same size.
double mean_distance(const Figures& a, const Figures& b);

} // namespace hybmss::paper
