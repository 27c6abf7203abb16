#include "integrations/petsc/communication.hpp"

#include <petsclog.h>

#include <algorithm>

namespace hybmss::distributed {
namespace {

double sent() {
    return petsc_isend_len + petsc_send_len;
}
double received() {
    return petsc_irecv_len + petsc_recv_len;
}

} // namespace

Traffic modelled_traffic(const Block& block, std::size_t value_bytes) {
    Traffic traffic;
    for (int rank = 0; rank < block.ranks(); ++rank) {
        const std::size_t ghosts = block.ghosted_of(rank).count() - block.owned_by(rank).count();
        const double bytes = static_cast<double>(3 * value_bytes * ghosts);
        traffic.total += bytes;
        traffic.most = std::max(traffic.most, bytes);
    }
    return traffic;
}

TrafficCounter::TrafficCounter() : sent_(sent()), received_(received()) {}

Traffic TrafficCounter::count(MPI_Comm communicator) const {
    const double own_sent = sent() - sent_, own_received = received() - received_;
    Traffic traffic;
    MPI_Allreduce(&own_sent, &traffic.total, 1, MPI_DOUBLE, MPI_SUM, communicator);
    MPI_Allreduce(&own_received, &traffic.most, 1, MPI_DOUBLE, MPI_MAX, communicator);
    return traffic;
}

} // namespace hybmss::distributed
