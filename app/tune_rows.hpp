#pragma once

/// \file
/// The bodies that `hybmss tune` measures, and whether the tuner chose well: all candidates timed at length.

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "hybmss/simulation/simulation.hpp"

#include <memory>
#include <string>
#include <vector>

namespace hybmss {

/// One class of bodies.
struct TuneRow {
    std::string name;
    Lattice lattice;
    Material material;
    std::shared_ptr<const Network> network; ///< the body, where it is one, in place of the lattice
    Precision precision = Precision::float32;
    bool forces = false; ///< for ForcePlan; else for ExplicitDynamics
    int threads = 0;     ///< the most; 0: those of the options
};

/// A scene's body.
TuneRow tune_row(const std::string& scene_name, const Lattice& lattice, const Material& material, Precision precision,
                 bool forces);

/// Cubes in each half step of log2(nodes) from 2^9 to 2^18, in each precision, with each variant of the kernels: as
/// lattices, and up to 2^16 nodes as networks with and without cells.
std::vector<TuneRow> tune_matrix(const std::vector<Precision>& precisions, bool forces);

/// The bodies that the tuner's choices are checked on, 10^2 to 10^6 cells, with one thread and, where `threads` is not
/// one, with that many: boxes, plates, rods, hollow ones, cells scattered at random, tissues, and networks.
std::vector<TuneRow> check_rows(const std::vector<Precision>& precisions, bool forces, int threads);

struct ExhaustiveFigure {
    std::string name;
    double ns_per_cell_step;
};

/// Every candidate on the whole body, briefly and each by itself; then the fastest of them, and those `kept` by name,
/// built anew, at length and in interleaved rounds: these, fastest first. `seconds` is for each of them.
std::vector<ExhaustiveFigure> time_exhaustively(const TuneRow& row, const PlanOptions& options, double seconds,
                                                const std::vector<std::string>& kept);

/// The plan that the options make of a row's body.
PlanDescription describe_plan(const TuneRow& row, const PlanOptions& options);

} // namespace hybmss
