#include "bench/step/shuffled.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace hybmss::bench {

Network shuffled(const Network& network, unsigned seed) {
    std::mt19937 random(seed);
    const std::size_t nodes = network.masses.size();
    std::vector<std::int32_t> number(nodes);
    std::iota(number.begin(), number.end(), 0);
    std::shuffle(number.begin(), number.end(), random);
    const auto renumbered = [&](std::int32_t n) { return number[static_cast<std::size_t>(n)]; };

    Network result = network;
    for (std::size_t n = 0; n < nodes; ++n) {
        const auto to = static_cast<std::size_t>(number[n]);
        result.rest_positions[to] = network.rest_positions[n];
        result.masses[to] = network.masses[n];
    }
    for (Network::Spring& spring : result.springs) {
        spring.a = renumbered(spring.a);
        spring.b = renumbered(spring.b);
    }
    for (Network::Cell& cell : result.cells) {
        std::transform(cell.nodes.begin(), cell.nodes.end(), cell.nodes.begin(), renumbered);
    }
    std::shuffle(result.springs.begin(), result.springs.end(), random);
    std::shuffle(result.cells.begin(), result.cells.end(), random);
    return result;
}

} // namespace hybmss::bench
