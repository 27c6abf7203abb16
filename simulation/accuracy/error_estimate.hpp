#pragma once

/// \file
/// How far results still are from their limit, told by those of two or three meshes.

#include "hybmss/simulation/simulation.hpp"

#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// One figure of a result, and the size that its errors are measured by: see AccuracyReport.
struct ResultFigure {
    std::string name;
    std::vector<double> values;
    double scale = 0;
};
/// The figures of a simulation at rest. The same names for the same scene on any mesh.
std::vector<ResultFigure> result_figures(const Simulation& simulation, const Summary& summary);

/// The greatest relative difference of two results of one scene, by the second one's scales. `name`, where not null:
/// whose it is.
double greatest_difference(std::span<const ResultFigure> a, std::span<const ResultFigure> b,
                           std::string* name = nullptr);

/// One mesh's figures, and its cells along an edge.
struct MeshFigures {
    double cells = 0;
    std::vector<ResultFigure> figures;
};

struct ErrorEstimate {
    double error = 0; ///< relative, of the finest mesh
    double order = 0;
    std::string name; ///< whose it is
    double cells = 0; ///< that would bring it to the error that was asked for
};
/// Of the last of two or more meshes, coarse to fine: |q2 - q1| / (r^p - 1), r being the ratio of cells and p the order
/// that the last three meshes show, within [0.7, 2.2]; `assumed_order` where they show none, or are two. `wanted`: the
/// error for which `cells` is told.
ErrorEstimate estimate_error(std::span<const MeshFigures> meshes, double assumed_order, double wanted);

} // namespace hybmss
