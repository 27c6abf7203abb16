#include "layouts/node_runs.hpp"

#include <algorithm>

namespace hybmss {

void append_node(std::vector<NodeRun>& runs, std::size_t index) {
    const std::size_t node = runs.empty() ? 0 : runs.back().node + runs.back().length;
    if (runs.empty() || runs.back().index + runs.back().length != index) {
        runs.push_back({node, index, 0});
    }
    ++runs.back().length;
}

std::size_t index_in(const std::vector<NodeRun>& runs, std::size_t node) {
    const auto after =
        std::upper_bound(runs.begin(), runs.end(), node, [](std::size_t n, const NodeRun& r) { return n < r.node; });
    const NodeRun& run = *(after - 1);
    return run.index + (node - run.node);
}

} // namespace hybmss
