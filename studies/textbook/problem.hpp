#pragma once

/// \file
/// Problems whose answer a textbook gives, what the lattice makes of them, and where it is not isotropic.

#include "hybmss/material.hpp"
#include "reference/body.hpp"
#include "studies/paper/table.hpp"

#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace hybmss::textbook {

inline constexpr double kPi = std::numbers::pi;

struct Answer {
    double ours = 0, exact = 0;
    double scale = exact; ///< what the error is relative to
    double error() const { return (ours - exact) / scale; }
};

enum class Agreement {
    rounding, ///< on any mesh
    order,    ///< the error falls with a power of the mesh
    theory    ///< the answer is that of a theory which leaves something out
};

struct Problem {
    std::string name;
    Agreement agreement = Agreement::order;
    double bound = 0;        ///< of the relative error: on any mesh where it is rounding, else on the second
    double least_order = 0;  ///< between the first two meshes, with springs between nodes; 0 where none is promised
    std::string mesh;        ///< what the meshes' numbers count
    std::vector<int> meshes; ///< from coarse to fine; the first two are quick
    std::function<Answer(const Material&, int mesh)> solve;
    double poisson_ratio = 0.3;
};

std::vector<Problem> static_problems();
std::vector<Problem> motion_problems();
std::vector<Problem> vibration_problems();
/// All of these.
std::vector<Problem> all_problems();
/// Frequencies beside those of finite elements, for which CalculiX must be installed.
std::vector<Problem> calculix_problems();

/// E = 1 Pa and 1 kg/m^3: lengths of 1 m make speeds and times near one.
Material unit_material(const Problem& problem, SpringForm springs);

/// All problems with springs between nodes (A = 1) and on means (A = 0); without the finer meshes where `quick`.
paper::Table problem_table(bool quick, const std::function<void(const std::string&)>& progress);

/// A clamped cantilever on 1 to 8 cells across beside the converged one, and beside finite elements where CalculiX is
/// installed and there is time.
paper::Table clamped_cantilever_table(bool quick);

/// What other weights of the twist patterns would make of bars and plates.
paper::Table twist_table();

/// Nominal stress, Pa, of the infinite lattice stretched along a direction and free across. Throws std::runtime_error
/// where it finds no such state.
double uniaxial_stress(const Material& material, const reference::Vector3d& direction, double stretch);
/// That along edges and diagonals, pressed and stretched.
paper::Table anisotropy_table();
/// The law at large strain, waves by direction, and where the energy stops holding.
std::vector<paper::Table> law_tables();
/// How evenly the paper's pressed cube is compressed, cell by cell.
paper::Table cell_volumes_table();
/// A round bar by cubes, prisms and tetrahedra.
paper::Table cylinder_table();
/// Angular springs (bending bonds) in place of the volume force: accuracy and time.
std::vector<paper::Table> angular_tables();
/// By how much, relative, the energy of such a lattice under a small homogeneous strain is above an isotropic body's.
double angular_stiffness_error(double poisson_ratio, const reference::Matrix3d& strain);
/// The same of the work of its forces along a motion beside its energy's change.
double angular_force_error();

} // namespace hybmss::textbook
