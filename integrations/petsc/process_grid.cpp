#include "integrations/petsc/process_grid.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace hybmss::distributed {

double most_ghosts(const std::array<long, 3>& nodes, const ProcessGrid& processes) {
    double owned = 1, ghosted = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        const long own = (nodes[a] + processes[a] - 1) / processes[a];
        owned *= static_cast<double>(own);
        ghosted *= static_cast<double>(own + std::min(processes[a] - 1, 2L));
    }
    return ghosted - owned;
}

ProcessGrid choose_process_grid(const std::array<long, 3>& nodes, long ranks) {
    ProcessGrid best = {0, 0, 0};
    double fewest = std::numeric_limits<double>::infinity();
    for (long px = 1; px <= std::min(ranks, nodes[0]); ++px) {
        for (long py = 1; ranks % px == 0 && py <= std::min(ranks / px, nodes[1]); ++py) {
            const long pz = ranks / px / py;
            if (px * py * pz != ranks || pz > nodes[2]) {
                continue;
            }
            if (const double ghosts = most_ghosts(nodes, {px, py, pz}); ghosts < fewest) {
                fewest = ghosts;
                best = {px, py, pz};
            }
        }
    }
    if (best[0] == 0) {
        const auto text = [&](std::size_t a) { return std::to_string(nodes[a]); };
        throw std::invalid_argument("ranks = " + std::to_string(ranks) + " is not allowed for " + text(0) + " x " +
                                    text(1) + " x " + text(2) + " nodes: it must be a product of three counts, none " +
                                    "above the nodes along its axis");
    }
    return best;
}

} // namespace hybmss::distributed
