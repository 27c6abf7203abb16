#pragma once

/// \file
/// What a viewer is shown: a scene's bodies as they move, or the frames of a finished run.

#include "app/view/messages.hpp"
#include "hybmss/simulation/world_simulation.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace hybmss {

/// Bodies of a scene. One body that takes explicit steps is a world of one, which goes the same way, to the bit, and
/// can be pulled.
class LiveBodies {
public:
    /// Throws what Simulation and load_any_scene() throw.
    LiveBodies(const std::string& path, const SimulationOptions& options);

    std::size_t body_count() const { return world_ ? world_->body_count() : 1; }
    const Simulation& body(std::size_t b) const { return world_ ? world_->body(b) : *alone_; }
    long steps() const { return world_ ? world_->steps() : alone_->steps(); }
    double time() const { return world_ ? world_->time() : alone_->time(); }
    double time_step() const { return world_ ? world_->time_step() : alone_->time_step(); }
    bool is_static() const { return time_step() == 0; }
    bool can_be_pulled() const { return world_.has_value(); }

    /// As Simulation::step(). A static scene goes to its equilibrium: `waiting` is called on the way, and may throw.
    void step(long count, const std::function<void()>& waiting);
    /// From the start again.
    void restart();

    /// True where cells have been removed, or all is new, since the last call; then surfaces() are others.
    bool update_surfaces();
    const std::vector<Surface>& surfaces() const { return surfaces_; }
    ViewFrame frame() const;

    /// Pulls a point of the surfaces, and what is around it, towards a place. Nothing where there is no such point.
    void pull(std::size_t point, const Vector3& place);
    void release();

private:
    void make();
    void aim();

    std::variant<Scene, WorldScene> scene_;
    SimulationOptions options_;
    std::optional<WorldSimulation> world_;
    std::optional<Simulation> alone_;
    std::vector<Surface> surfaces_;
    std::vector<std::size_t> removed_; ///< cells of each body, at surfaces_; none where all is new
    /// What is pulled: a point, which is a node of a body, to a place (m), by ties, and where their nodes were beside
    /// it.
    struct Pull {
        std::size_t point, body, node;
        Vector3 place;
        std::vector<std::pair<std::size_t, Vector3>> ties;
    };
    std::optional<Pull> pull_;
};

/// The frames of `hybmss run --out DIR`.
class RecordedRun {
public:
    /// Throws std::invalid_argument where there are none.
    explicit RecordedRun(std::filesystem::path directory);

    std::size_t frame_count() const { return times_.size(); }
    std::size_t shown() const { return shown_; }
    /// Reads a frame. Throws std::invalid_argument that names the file where it cannot be read.
    void show(std::size_t frame);
    bool update_surfaces() { return std::exchange(new_surfaces_, false); }
    const std::vector<Surface>& surfaces() const { return surfaces_; }
    const ViewFrame& frame() const { return frame_; }

private:
    std::filesystem::path directory_;
    std::vector<PvdFrame> files_;                            ///< by time, those of one time in their parts' order
    std::vector<std::pair<std::size_t, std::size_t>> times_; ///< first and end among files_
    std::size_t shown_ = 0;
    bool new_surfaces_ = true;
    std::vector<std::vector<std::array<std::uint32_t, 8>>> cells_; ///< at surfaces_
    std::vector<Surface> surfaces_;
    ViewFrame frame_;
};

} // namespace hybmss
