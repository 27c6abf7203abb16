#include "app/body_report.hpp"

#include "simulation/geometry/cell_parts.hpp"
#include "simulation/run/memory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

namespace hybmss {

std::string body_line(const Simulation& simulation, const SimulationOptions& options) {
    const Lattice& lattice = simulation.lattice();
    const auto grid = lattice.cells();
    const std::size_t filled = lattice.cell_count();
    std::string line = fmt::format("{} x {} x {} cells", grid[0], grid[1], grid[2]);
    if (filled < lattice.cell_scales().size()) {
        line = fmt::format("{} cells of a grid of {} x {} x {}", filled, grid[0], grid[1], grid[2]);
    }
    return line + fmt::format(", {} nodes, {} springs, about {:.3g} MB", simulation.node_count(),
                              simulation.describe().springs, estimated_bytes(simulation.scene().body, options) / 1e6);
}

std::string parts_line(const Lattice& lattice) {
    constexpr std::size_t kShown = 5;
    const std::vector<std::size_t> parts = cell_parts(lattice);
    if (parts.size() < 2) {
        return "";
    }
    std::string sizes;
    const std::size_t shown = parts.size() <= kShown + 1 ? parts.size() : kShown;
    for (std::size_t p = 0; p < shown; ++p) {
        sizes += (p == 0 ? "" : p + 1 == parts.size() ? " and " : ", ") + std::to_string(parts[p]);
    }
    if (shown < parts.size()) {
        const auto rest = std::accumulate(parts.begin() + kShown, parts.end(), std::size_t{0});
        sizes += fmt::format(" cells, and {} more parts of {} cells in all", parts.size() - shown, rest);
    } else {
        sizes += " cells";
    }
    return fmt::format("{} parts that share no face with each other: {}", parts.size(), sizes);
}

std::string labels_line(const Scene& scene) {
    std::array<std::size_t, 256> counts{};
    for (std::uint8_t value : scene.body.labels) {
        ++counts[value];
    }
    std::string line;
    for (std::size_t value = 1; value < counts.size(); ++value) {
        if (counts[value] == 0) {
            continue;
        }
        const auto label = std::find_if(scene.labels.begin(), scene.labels.end(),
                                        [value](const Label& each) { return each.value == value; });
        const double young_modulus = label == scene.labels.end() ? scene.material.young_modulus : label->young_modulus;
        line += fmt::format("{}{}: {} cells of {:g} Pa", line.empty() ? "" : "; ", value, counts[value], young_modulus);
        line += young_modulus > 0 ? "" : ", left out";
    }
    return line;
}

} // namespace hybmss
