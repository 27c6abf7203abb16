#pragma once

/// \file
/// The effects that a scene can call for: the one list that `hybmss explain`, the benchmark and docs/effects.md share.

#include "hybmss/simulation/simulation.hpp"

#include <span>
#include <string>
#include <string_view>

namespace hybmss {

/// One effect.
struct EffectRule {
    std::string_view name;
    std::string_view called_for; ///< what in a scene asks for it
    std::string_view pass;       ///< what it adds to an explicit step
    std::string_view kernel;     ///< that pass's kernel; "" for a part of the body's sweep
    std::string_view holds;      ///< what memory it takes
    bool in_static;              ///< whether a static solve has it
    /// Whether the scene asks for it, were it a scene in time.
    bool (*asked)(const Scene& scene);
    /// How much of it there is, or, where it is not asked for, why there is none.
    std::string (*amount)(const Simulation& simulation);
    std::string (*absence)(const Scene& scene);
    /// Adds an instance to a scene whose body is a box; takes it out of any scene. Null for what every body has.
    void (*add)(Scene& scene);
    void (*remove)(Scene& scene);

    bool in(const Scene& scene) const { return asked(scene) && (in_static || !timeless(scene.solver.method)); }
    /// Why it is in or out of the simulation's scene.
    std::string reason(const Simulation& simulation) const;
};

std::span<const EffectRule> effect_rules();

/// The scene without the effect, its time step left to choose.
Scene without(const Scene& scene, const EffectRule& effect);

/// The list as a Markdown table, as docs/effects.md holds it.
std::string effects_markdown();

} // namespace hybmss
