#include "simulation/memory.hpp"

#include "simulation/scene_lattice.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <unistd.h>

namespace hybmss {
namespace {

std::string gigabytes(double bytes) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g GB", bytes / 1e9);
    return text;
}

double grid_nodes(const Body& body) {
    double nodes = 1;
    for (std::int64_t n : body.cells) {
        nodes *= static_cast<double>(n) + 1;
    }
    return nodes;
}

} // namespace

double estimated_bytes(const Body& body, const SimulationOptions& options) {
    const double real = options.precision == Precision::float32 ? 4 : 8;
    // Nine components of state and force, up to eight weights a node in the plan; in double: rest positions, masses,
    // the last good state, and one copy for results; node numbers, cell corners and scales.
    double bytes_a_node = 17 * real + 8 * (3 + 1 + 6 + 9) + 48;
    // While a result is written: positions, displacements, velocities, corners, and the file's text.
    bytes_a_node += 300;
    const std::string& layout = options.plan.layout;
    if (layout == "active-rows") {
        // Rows padded to vectors of 16 lanes; each node may be a run of its own.
        const double row = static_cast<double>(body.cells[0]) + 1;
        bytes_a_node += 17 * real * (16 * std::ceil(row / 16) / row - 1) + 24;
    } else if (!layout.empty() && layout != "flat-rows" && layout != "gather-rows") {
        // Every other layout is a network's. 13 springs and one cell a node: as given, coloured, and while they are
        // sorted.
        bytes_a_node += 13 * 2 * 48.0 + 2 * 64.0;
    }
    return bytes_a_node * grid_nodes(body);
}

double available_bytes() {
    std::ifstream meminfo("/proc/meminfo");
    std::string key;
    double kilobytes = 0;
    while (meminfo >> key) {
        if (key == "MemAvailable:" && meminfo >> kilobytes) {
            return 1024 * kilobytes;
        }
    }
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return pages > 0 && page > 0 ? static_cast<double>(pages) * static_cast<double>(page) : HUGE_VAL;
}

void check_size(const Scene& scene, const SimulationOptions& options, double available) {
    constexpr double kMostNodes = 1e9; // what Lattice can number
    const double bytes = estimated_bytes(scene.body, options);
    if (bytes > available) {
        throw scene_error(scene, body_key(scene.body),
                          "these cells need about " + gigabytes(bytes) + " of memory; this machine has " +
                              gigabytes(available) + " available");
    }
    if (grid_nodes(scene.body) > kMostNodes) {
        throw scene_error(scene, body_key(scene.body), "these cells make more than the 1e9 nodes that are allowed");
    }
}

} // namespace hybmss
