#include "integrations/petsc/commands.hpp"

#include <cstdio>

namespace hybmss::distributed {

void print_model(const std::array<long, 3>& cells, long ranks) {
    std::array<long, 3> nodes, block;
    for (std::size_t a = 0; a < 3; ++a) {
        nodes[a] = cells[a] + 1;
    }
    const ProcessGrid processes = choose_process_grid(nodes, ranks);
    double owned = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        block[a] = (nodes[a] + processes[a] - 1) / processes[a];
        owned *= static_cast<double>(block[a]);
    }
    const double ghosts = most_ghosts(nodes, processes);
    std::printf("%ld x %ld x %ld cells on %ld x %ld x %ld ranks: a rank owns at most %ld x %ld x %ld nodes = %.6g\n",
                cells[0], cells[1], cells[2], processes[0], processes[1], processes[2], block[0], block[1], block[2],
                owned);
    std::printf("ghosts: at most %.0f, %.3g of the nodes owned\n", ghosts, ghosts / owned);
    for (const int bytes : {4, 8}) {
        std::printf("%s: a rank receives at most %.0f bytes a step, all ranks at most %.4g\n",
                    bytes == 4 ? "float" : "double", 3 * bytes * ghosts,
                    3 * bytes * ghosts * static_cast<double>(ranks));
    }
}

} // namespace hybmss::distributed
