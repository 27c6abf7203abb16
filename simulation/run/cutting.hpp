#pragma once

/// \file
/// When and where a scene's cuts bite, and what leaves with the cells.

#include "hybmss/material.hpp"
#include "hybmss/simulation/scene.hpp"
#include "simulation/scene/scene_body.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace hybmss {

/// The bites of all cuts, in steps of time. Several of one cut within a step are one.
class CutSchedule {
public:
    static constexpr long kNever = std::numeric_limits<long>::max();

    CutSchedule(const std::vector<Cut>& cuts, double time_step);

    /// The step after which the next bite is due; kNever where none is left.
    long next_step() const { return next_step_; }
    /// The cuts that bite after `step`, which is not before next_step(); they are done then.
    std::vector<std::size_t> take(long step);

    /// How many bites of each cut are done.
    const std::vector<double>& done() const { return done_; }
    /// Goes on from there.
    void set_done(std::vector<double> done);

private:
    long step_of(std::size_t cut, double bite) const;
    long next_step_of(std::size_t cut) const;
    void find_next();

    std::vector<Cut> cuts_;
    double time_step_;
    std::vector<double> done_;
    long next_step_ = kNever;
};

/// A cell of the body and its corner nodes, by the bits of their number.
struct BodyCell {
    std::uint32_t cell; ///< Lattice::cell_index
    std::array<std::uint32_t, 8> corners;
};

/// Whether a point is in the tool of a cut at `time`; surfaces count as inside, up to a millionth of a cell.
bool is_inside(const Cut& cut, const Vector3& point, double time, double cell_size);

/// The mean of the corners' positions; `displacements` may be empty for the one at rest.
Vector3 center_of(const BodyCell& cell, std::span<const Vector3> rest, std::span<const Vector3> displacements);

/// J of one cell with the stiffness scale `scale`: its shares of the springs that it belongs to, and its volume energy.
/// The sum over all cells is the energy of the body.
double cell_energy(const Material& material, double cell_size, double scale,
                   const std::array<Vector3, 8>& displacement);

} // namespace hybmss
