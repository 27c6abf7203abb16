#pragma once

/// \file
/// The output directory of a run: body_NNNN.vtu, body.pvd, probes.csv, summary.json; skin_NNNN.vtp, skin.pvd.

#include "hybmss/simulation/simulation.hpp"
#include "hybmss/simulation/world_simulation.hpp"
#include "hybmss/skin.hpp"
#include "simulation/results/atomic_file.hpp"
#include "simulation/results/vtu_file.hpp"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {

/// A result that is not finite, and so not written.
struct NotFinite : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The scene's obstacles where they are at present.
std::vector<VtuObstacle> drawn_obstacles(const Simulation& simulation);
/// Of the points the von Mises stress of the mean of the cells around them. Throws NotFinite.
VtuStress vtu_stress(std::span<const CellStress> stresses, std::span<const std::array<std::uint32_t, 8>> cells,
                     std::size_t points);

/// A directory, made where it is missing, that no other process may have as its own at the same time.
class OwnedDirectory {
public:
    /// Throws std::runtime_error where it cannot be made or is in use.
    explicit OwnedDirectory(std::filesystem::path path);
    OwnedDirectory(const OwnedDirectory&) = delete;
    OwnedDirectory& operator=(const OwnedDirectory&) = delete;
    ~OwnedDirectory();
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
    int descriptor_;
};

/// Keeps the results of one simulation in a directory, which is its own meanwhile. Files of the same names are
/// replaced; those that a run writes at its end are removed at its start, and so are the frames that it does not go on
/// from, so that a run is not taken for an earlier one, nor for a part of it. Throws std::runtime_error where something
/// cannot be written, NotFinite where it would hold a value that is not finite.
class Results {
public:
    /// `before`: what state() gave when a run was stopped that this one goes on with.
    Results(std::filesystem::path directory, const Simulation& simulation, const std::string& before = "");

    /// The present state: one .vtu file (and one .vtp file of the skin, where it is asked for), one row of probes.csv.
    void record();

    /// What was recorded, for one that goes on from here. The .vtu files are not in it: they are in the directory.
    std::string state() const;

    /// Puts body.pvd, skin.pvd, probes.csv and summary.json in place.
    void finish(const Summary& summary);

    /// Of body.pvd, so far.
    std::span<const PvdFrame> frames() const { return frames_; }

private:
    void write_modes(const Summary& summary);
    /// V'/V0 of the cells.
    std::vector<double> ratios_of(std::span<const std::array<double, 3>> displacements) const;
    /// Of a body whose cells are no cubes; else none.
    std::span<const Network::Polyhedron> polyhedra() const;
    void write_skin(std::span<const std::array<double, 3>> displacements);

    OwnedDirectory owned_;
    std::filesystem::path directory_;
    const Simulation& simulation_;
    std::vector<std::array<std::uint32_t, 8>> cells_; ///< those present at cut_cells_ and parted_faces_
    std::size_t cut_cells_, parted_faces_;
    std::vector<PvdFrame> frames_;
    AtomicFile probes_;
    std::string rows_; ///< of probes.csv
    /// Of the scene's output: its mesh, at skin_cut_cells_ without what was cut away and with what that laid bare.
    std::optional<Skin<double>> skin_;
    TriangleMesh skin_mesh_;
    std::size_t skin_cut_cells_ = 0;
};

/// Keeps the results of a world: those of each body in a directory of its name, bodies.pvd for all of them, and a
/// summary.json of contacts and ties. Replaces and throws as Results does.
class WorldResults {
public:
    WorldResults(std::filesystem::path directory, const WorldSimulation& world);

    void record();
    void finish(const WorldSummary& summary);

private:
    OwnedDirectory owned_;
    const WorldSimulation& world_;
    std::deque<Results> bodies_;
};

/// What was chosen, as summary.json and `hybmss explain --json` hold it.
nlohmann::ordered_json plan_json(const PlanDescription& plan);

/// The file of a mode's shape.
std::string mode_name(std::size_t mode);

/// The text of summary.json. Throws NotFinite for a value that is not finite.
std::string summary_json(const Summary& summary);
std::string summary_json(const WorldSummary& summary);

} // namespace hybmss
