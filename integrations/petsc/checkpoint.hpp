#pragma once

#include "integrations/petsc/block.hpp"

#include <string>
#include <vector>

namespace hybmss::distributed {

/// What a run's later steps depend on besides the state, by name: a checkpoint of another run is refused.
struct RunFact {
    std::string name;
    double value;
};
using RunIdentity = std::vector<RunFact>;

/// Writes displacement and velocity in the grid's own order, whatever the ranks: under a temporary name, and renamed
/// when every rank's part is there, so that a run that dies leaves the last whole checkpoint. Collective. Throws
/// std::runtime_error where that fails, and before anything is written where a number is not finite.
void write_checkpoint(const std::string& path, const Block& block, const RunIdentity& run, long step, Vec displacement,
                      Vec velocity);

/// Returns the step at which it was written, on any number of ranks. Collective. Throws std::invalid_argument for a
/// file that is missing, damaged, or of another run.
long read_checkpoint(const std::string& path, const Block& block, const RunIdentity& run, Vec displacement,
                     Vec velocity);

} // namespace hybmss::distributed
