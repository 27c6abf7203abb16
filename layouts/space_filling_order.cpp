#include "layouts/space_filling_order.hpp"

#include <algorithm>
#include <numeric>

namespace hybmss {
namespace {

/// The low 21 bits, two zeros between each and the next.
std::uint64_t spread(std::uint64_t bits) {
    bits = (bits | bits << 32) & 0x001f00000000ffffu;
    bits = (bits | bits << 16) & 0x001f0000ff0000ffu;
    bits = (bits | bits << 8) & 0x100f00f00f00f00fu;
    bits = (bits | bits << 4) & 0x10c30c30c30c30c3u;
    bits = (bits | bits << 2) & 0x1249249249249249u;
    return bits;
}

} // namespace

std::vector<std::uint32_t> space_filling_order(std::span<const std::array<double, 3>> points) {
    std::vector<std::uint32_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    if (points.empty()) {
        return order;
    }
    std::array<double, 3> low = points[0], high = points[0];
    for (const auto& x : points) {
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], x[c]);
            high[c] = std::max(high[c], x[c]);
        }
    }
    const double side = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    const double scale = side > 0 ? (0x1p21 - 1) / side : 0;
    std::vector<std::uint64_t> code(points.size());
    for (std::size_t n = 0; n < points.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            // Half a count more: a grid's coordinates then never fall on either side of a whole number by rounding.
            code[n] |= spread(static_cast<std::uint64_t>((points[n][c] - low[c]) * scale + 0.5)) << c;
        }
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return code[a] < code[b]; });
    return order;
}

} // namespace hybmss
