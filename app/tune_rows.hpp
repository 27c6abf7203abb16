#pragma once

/// \file
/// The bodies that `hybmss tune` measures, and whether the tuner chose well: all candidates timed at length.

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/simulation/simulation.hpp"

#include <string>
#include <vector>

namespace hybmss {

/// One class of bodies.
struct TuneRow {
    std::string name;
    Lattice lattice;
    Material material;
    bool as_network = false; ///< the body is the network made from the lattice
    Precision precision = Precision::float32;
    bool forces = false; ///< for ForcePlan; else for ExplicitDynamics
};

/// A scene's body.
TuneRow tune_row(const std::string& scene_name, const Lattice& lattice, const Material& material, Precision precision,
                 bool forces);

/// Cubes in each half step of log2(nodes) from 2^9 to 2^18, in each precision, with each variant of the kernels: as
/// lattices, and up to 2^16 nodes as networks with and without cells.
std::vector<TuneRow> tune_matrix(const std::vector<Precision>& precisions, bool forces);

/// The bodies that the tuner's choices are checked on: the meshes of Table 6 and a hollow ball of voxels, full HybMSS.
std::vector<TuneRow> check_rows(const std::vector<Precision>& precisions, bool forces);

struct ExhaustiveFigure {
    std::string name;
    double ns_per_cell_step;
};

/// Every candidate on the whole body, none dropped, in interleaved rounds; fastest first. `seconds` is for each of
/// them. All of them are held at the same time, so the body should not be huge.
std::vector<ExhaustiveFigure> time_exhaustively(const TuneRow& row, const PlanOptions& options, double seconds);

/// The plan that the options make of a row's body.
PlanDescription describe_plan(const TuneRow& row, const PlanOptions& options);

} // namespace hybmss
