#pragma once

#include <cstdint>

namespace hybmss {

/// Where the neighbours of a vector of nodes begin, in elements of their planes (layout active-rows).
struct VectorNeighbors {
    std::int32_t low_y, high, high_y; ///< one row further in its own plane; above; above and one row further
};

} // namespace hybmss
