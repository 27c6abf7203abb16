#pragma once

/// \file
/// Runs a scene of several bodies: each as a Simulation runs it, all together as a World steps them.

#include "hybmss/simulation/simulation.hpp"
#include "hybmss/simulation/world_scene.hpp"
#include "hybmss/world.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace hybmss {

/// Of two bodies that touch, or of one that touches itself.
struct NamedContactReading {
    std::string first, second;
    BodyContactReading reading;
};

/// Of the ties of an [[attach]].
struct AttachmentReading {
    std::string from, to;                    ///< bodies; "" for space
    std::size_t ties = 0;                    ///< those that are left
    std::array<double, 3> force = {0, 0, 0}; ///< N, on `from`, in the last step
};

struct WorldSummary {
    std::vector<Summary> bodies; ///< in the scene's order; failure and interruption are the world's
    std::vector<NamedContactReading> contacts;
    std::vector<AttachmentReading> attachments;
    bool converged = false;
    std::string failure;      ///< as Summary has it
    bool interrupted = false; ///< likewise
    Settlement settlement;    ///< of the body that is furthest from rest
    long steps = 0;
    double time = 0, time_step = 0, critical_time_step = 0; ///< s
    double wall_seconds = 0;
};

/// Several bodies in the course of time. Not for concurrent use.
///
/// All take the same steps: as the scene says, or by the shortest that one of them would take. A body has settled where
/// its motion is small and every free node's force, of all that acts on it in a step, is small against the largest
/// force of the body's own on a node.
class WorldSimulation {
public:
    /// Throws as Simulation does, and SceneError where an attachment's region is empty or its nodes lie in no cell of
    /// the other body.
    explicit WorldSimulation(WorldScene scene, const SimulationOptions& options = {});
    WorldSimulation(WorldSimulation&&) noexcept;
    WorldSimulation& operator=(WorldSimulation&&) noexcept;
    ~WorldSimulation();

    const WorldScene& scene() const;
    std::size_t body_count() const;
    const std::string& name(std::size_t body) const;
    /// To read from.
    const Simulation& body(std::size_t body) const;
    long steps() const;
    double time() const, time_step() const, critical_time_step() const; ///< s

    /// Takes `count` steps, whatever the duration says. Throws std::runtime_error where the state has diverged.
    void step(long count = 1);
    /// As Simulation::run(); after a failure the world takes no more steps. Checkpoints are not written.
    WorldSummary run(const RunCallbacks& callbacks = {});

    /// Ties and pulls bodies besides what the scene says, as World::attach(), move_anchor() and detach() do, and throw.
    std::size_t attach(const Attachment& attachment);
    void move_anchor(std::size_t attachment, const std::array<double, 3>& point);
    void detach(std::size_t attachment);

    std::vector<NamedContactReading> contacts() const;
    std::vector<AttachmentReading> attachments() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

} // namespace hybmss
