#pragma once

#include <cstddef>
#include <cstring>

namespace hybmss {

/// Neighbouring cells along x side by side, one a lane: what every machine that the solvers are compiled for computes
/// at once. (The kernels' wider vectors are theirs alone.)
inline constexpr std::size_t kLanes = 4;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

inline Lanes load_lanes_at(const float* from) {
    Lanes lanes;
    std::memcpy(&lanes, from, sizeof lanes);
    return lanes;
}
inline void store_lanes_at(const Lanes& lanes, float* to) {
    std::memcpy(to, &lanes, sizeof lanes);
}
inline Lanes in_every_lane(float x) {
    return Lanes{} + x;
}

} // namespace hybmss
