#pragma once

#include <cstddef>
#include <vector>

namespace hybmss {

/// A run of consecutive nodes of the body that are also consecutive in the layout.
struct NodeRun {
    std::size_t node;
    std::size_t index;
    std::size_t length;
};

/// Adds the body's next node, which lies at `index`, to the last run where that goes on there.
void append_node(std::vector<NodeRun>& runs, std::size_t index);

/// The layout index of a node that one of the runs holds; they ascend by node.
std::size_t index_in(const std::vector<NodeRun>& runs, std::size_t node);

} // namespace hybmss
