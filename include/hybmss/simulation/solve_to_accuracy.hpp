#pragma once

/// \file
/// Static scenes that ask for an accuracy instead of a mesh.

#include "hybmss/simulation/simulation.hpp"

#include <functional>

namespace hybmss {

struct AccuracyOptions {
    SimulationOptions simulation;
    /// float where it is enough, double else; false: simulation.precision whatever the wish.
    bool choose_precision = true;
    /// Called before each solve with its mesh; may be empty.
    std::function<void(const AccuracyMesh&)> before_solve;
    /// Called during each solve, as RunCallbacks::progress; may be empty.
    std::function<void(const AccuracyMesh&, const Progress&)> progress;
};

struct AccurateSolution {
    Simulation simulation; ///< at the equilibrium that the summary tells of
    Summary summary;       ///< `accuracy` is set; where the wish was not reached, `failure` or a warning says so
};

/// Solves a scene with solver.accuracy. Where the scene leaves the mesh free (body.size), on meshes that grow finer
/// until the estimated error is at most the accuracy; else on the scene's own mesh, with one coarser or finer mesh to
/// tell the error by. Throws SceneError for a scene that asks for no accuracy or names single nodes, which another mesh
/// has not, and where a free mesh fine enough does not fit into memory.
AccurateSolution solve_to_accuracy(const Scene& scene, const AccuracyOptions& options = {});

/// The offers alone, from the meshes that solve_to_accuracy() begins with: up to some 30,000 cells they are the same,
/// and so is what is refused. `chosen`: where not null, the scene with the mesh that should do. Throws as that does,
/// and std::runtime_error where a mesh has no equilibrium.
AccuracyReport accuracy_offers(const Scene& scene, const AccuracyOptions& options = {}, Scene* chosen = nullptr);

} // namespace hybmss
