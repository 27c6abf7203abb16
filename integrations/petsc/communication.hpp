#pragma once

#include "integrations/petsc/block.hpp"

namespace hybmss::distributed {

/// Bytes of messages.
struct Traffic {
    double total = 0; ///< sent by all ranks together
    double most = 0;  ///< received by one rank, of all the one with the most
};

/// A step's exchange by the model: every ghost's three components once. `value_bytes` is the size of one, 4 or 8.
Traffic modelled_traffic(const Block& block, std::size_t value_bytes);

/// Counts what PETSc's message calls send and receive from its construction on.
class TrafficCounter {
public:
    TrafficCounter();
    /// Collective.
    Traffic count(MPI_Comm communicator) const;

private:
    double sent_, received_;
};

} // namespace hybmss::distributed
