#pragma once

/// \file
/// The problems whose solutions are priced, the paper's experiments at a strain where every law is linear; their
/// displacements on grids, compared on finer ones; and what a solution converges to, from fine meshes.

#include "hybmss/simulation/simulation.hpp"
#include "studies/calculix/problem.hpp"
#include "studies/paper/experiment.hpp"

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss::price {

/// One vector a node of a full box, x fastest, then y, then z.
struct GridField {
    std::array<int, 3> cells = {0, 0, 0};
    double cell_size = 1; ///< m
    std::vector<std::array<double, 3>> values;

    std::size_t node(int i, int j, int k) const;
    /// Trilinear inside each cell; on a grid `factor` times as fine, >= 1.
    GridField refined(int factor) const;
    /// Its values on every `factor`-th node; `factor` divides the cells.
    GridField coarsened(int factor) const;
};

/// The field of 20-node elements, by their own shape functions, on a grid `factor` times as fine as the elements.
/// `mesh` is of a full box of `cells`, its displacements one a node.
GridField refined_quadratic(const calculix::BrickMesh& mesh, const std::vector<std::array<double, 3>>& displacements,
                            const std::array<int, 3>& cells, int factor);

/// How far a field lies from another one on the same grid, relative to the other's own norm.
struct FieldError {
    double l2 = 0; ///< of the displacement, by the trapezoidal rule
    double h1 = 0; ///< of its gradient, in the cells' centres
};
/// Throws std::invalid_argument for another grid.
FieldError field_error(const GridField& field, const GridField& reference);

/// s a + t b, node by node. The same grid.
GridField combined(double s, const GridField& a, double t, const GridField& b);

// ---- problems and their solutions

/// Compression, shear, torsion and beam.
std::vector<paper::Kind> problems();

/// What is read of a solution besides its field.
enum class Quantity { force, volume_change, torque, deflection };
std::string_view name(Quantity quantity);
std::vector<Quantity> quantities(paper::Kind kind);

/// nu = 0.3, strain 1e-5 (beam: a tip that moves by a millionth of its length or less), `across` cells along the
/// shortest edge.
paper::Experiment experiment(paper::Kind kind, int across);

/// How a lattice is brought to rest.
enum class Method {
    static_solve,     ///< Newton's method, as `solver.method = "static"`
    settling,         ///< explicit, at the default step and with the damping at which the slowest motion just swings no
                      ///< more, until residual and motion are below 1e-4
    paper_settling,   ///< explicit, 10 s with that damping in the paper's 10,000 steps (of the beam 300,000)
    implicit_settling ///< backward Euler with large steps and that damping, likewise to 1e-4
};
std::string_view name(Method method);

struct Outcome {
    std::string failure;                              ///< "" where all is well
    std::vector<double> values;                       ///< one a quantity of the problem
    GridField field;                                  ///< of the cells' corners
    calculix::BrickMesh mesh;                         ///< 20-node elements, where it is a solution by those, with
    std::vector<std::array<double, 3>> displacements; ///< one a node of it
    double seconds = 0; ///< from the scene to the result, on one thread; of CalculiX the whole program's run
    long steps = 0;     ///< in time, or conjugate gradients of a static solve
    bool good() const { return failure.empty(); }
    /// The displacements on a grid `factor` times as fine as the cells.
    GridField refined(int factor) const;
};

Outcome solve_lattice(paper::Kind kind, int across, paper::Model model, Method method, Precision precision);
/// Linear geometry. Throws std::runtime_error where ccx is not installed.
Outcome solve_calculix(paper::Kind kind, int across, calculix::ElementType type);

/// A value from four meshes, each twice as fine as the last, by Richardson's extrapolation:
///   p = log2((q1 - q2) / (q2 - q3)),   q = q3 + (q3 - q2) / (2^p - 1).
struct Extrapolation {
    double value = 0, order = 0;
    double uncertainty = 0; ///< relative: what the three coarser meshes and the three finer ones differ by
};
/// `expected_order` is taken where the values do not tell one between 1/2 and 4.
Extrapolation extrapolate(const std::vector<double>& values, double expected_order);

/// The static solutions of HybMSS in double on finest/8 ... finest cells across, and their limit.
struct Reference {
    paper::Kind kind = paper::Kind::compression;
    int finest = 0;                    ///< cells across
    std::map<int, Outcome> solutions;  ///< by cells across
    std::vector<Extrapolation> values; ///< one a quantity of the problem
    GridField field;                   ///< on the finest grid
    double field_uncertainty = 0;      ///< L2, relative: as for values
    double expected_order = 0;         ///< of values and L2
};
/// `finest` is 8 or more and a power of two. Throws std::runtime_error where a solve fails.
Reference make_reference(paper::Kind kind, int finest, const std::function<void(const std::string&)>& progress);

} // namespace hybmss::price
