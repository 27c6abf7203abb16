#pragma once

/// \file
/// The paper's tables and figures, and those that carry them further, as tables and as one document.

#include "hybmss/material.hpp"
#include "studies/paper/figures.hpp"
#include "studies/paper/table.hpp"

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

namespace hybmss::paper {

struct TableContext {
    FiniteElements& finite_elements;
    bool quick = false;                               ///< small meshes only, where there is a choice
    std::function<void(const std::string&)> progress; ///< called with what comes next
};

/// Tables 2 to 5: compression, tension, shear or torsion for every model at nu = 0, 0.25, 0.499.
Table plate_table(Kind kind, TableContext& context);
/// Their experiments as motions of 10,000 steps.
Table motion_table(TableContext& context);
/// Fig. 5: the beam's free end.
Table beam_table(TableContext& context);
/// And its axis.
Table beam_curve_table(TableContext& context);
/// Fig. 8 and Fig. 10: how far the middle layer lies from that of finite elements.
Table layer_table(TableContext& context);
/// Section 6.3: seconds for the eight meshes of Table 6.
Table timing_table(TableContext& context);
/// At nu = 1/4 and A = 1 beside CalculiX on the same mesh, from 1 % and 1 degree to where the material laws part.
Table strain_table(TableContext& context);
/// The stress inside the compressed cube beside CalculiX's.
Table stress_table(TableContext& context);
/// The tip of a stiff beam on meshes of 2 to 32 cells across.
Table beam_mesh_table(TableContext& context);
/// A smooth problem with a known solution: the order in which the error falls.
Table order_table(TableContext& context);

/// Plane waves and bending waves on few cells: errors of speed and frequency.
Table wave_table(TableContext& context);
/// Curved bodies: how near cells cut by their surface come, and how fast.
Table surface_table(TableContext& context);

/// What the command line knows: a name and what makes the table.
struct TableEntry {
    std::string name;
    std::function<Table(TableContext&)> make;
};
const std::vector<TableEntry>& tables();

/// A page of Markdown: docs/report/paper.md. `calculix` says where CalculiX's figures come from.
void write_page(const std::vector<Table>& tables, const std::string& calculix, std::ostream& out);
void write_json(const std::vector<Table>& tables, const std::string& calculix, std::ostream& out);

// ---- a smooth problem whose solution is known: how fast the lattice's error falls with the cell size

/// The lattice's error on a unit cube of cells^3, relative to the solution's own norm.
struct ConvergenceStep {
    int cells = 0;
    double displacement = 0; ///< L2: over the nodes
    double gradient = 0;     ///< H1 seminorm: cell gradients against those in the cells' centres
};

/// Small plane waves u = sum of A sin(k.x + phi), prescribed on the whole boundary, held inside by the body force
///   b = -(lambda + G) grad div u - G lap u,   each wave: ((lambda + G) k (A.k) + G |k|^2 A) sin(k.x + phi).
/// Every node gets b h^3. Throws std::runtime_error where a solve fails.
std::vector<ConvergenceStep> manufactured_convergence(const Material& material, const std::vector<int>& cells);

/// log(e1 / e2) / log(n2 / n1) of two errors.
double observed_order(double coarse_error, int coarse, double fine_error, int fine);

} // namespace hybmss::paper
