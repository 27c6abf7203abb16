#include "hybmss/separation.hpp"

#include "layouts/messages.hpp"
#include "layouts/node_numbers.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss {
namespace {

using Pair = std::array<std::uint32_t, 2>;

/// Corners of cells that are one node.
class Unions {
public:
    explicit Unions(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0u); }
    std::uint32_t find(std::uint32_t x) {
        while (parent_[x] != x) {
            x = parent_[x] = parent_[parent_[x]];
        }
        return x;
    }
    /// The least of a union stands for it.
    void join(std::uint32_t a, std::uint32_t b) {
        const std::uint32_t x = find(a), y = find(b);
        parent_[std::max(x, y)] = std::min(x, y);
    }

private:
    std::vector<std::uint32_t> parent_;
};

} // namespace

SeparatedNetwork separate(const Lattice& lattice, const Material& material, std::span<const Pair> faces) {
    SeparatedNetwork separated;
    Network& network = separated.network;
    network = Network::from_lattice(lattice, material); // which checks both, and knows what is the same for all
    const Network whole = std::move(network);
    network = {};
    network.volume_energy = whole.volume_energy;
    network.stiffening = whole.stiffening;
    network.means = whole.means;

    // The cells that are there, in grid order as in the network.
    const auto [nx, ny, nz] = lattice.cells();
    std::vector<std::uint32_t> grid, place(lattice.cell_scales().size(), 0);
    for (std::uint32_t cell = 0; cell < lattice.cell_scales().size(); ++cell) {
        if (lattice.cell_scales()[cell] > 0) {
            place[cell] = static_cast<std::uint32_t>(grid.size());
            grid.push_back(cell);
        }
    }
    const auto there = [&](std::uint32_t cell) {
        return cell < lattice.cell_scales().size() && lattice.cell_scales()[cell] > 0;
    };
    const std::array<std::uint32_t, 3> next = {1, static_cast<std::uint32_t>(nx), static_cast<std::uint32_t>(nx * ny)};
    const std::array<int, 3> counts = {nx, ny, nz};
    const auto has_next = [&](std::uint32_t cell, std::size_t axis) {
        return static_cast<int>(cell / next[axis]) % counts[axis] + 1 < counts[axis] && there(cell + next[axis]);
    };
    std::set<Pair> open; // from the lower cell to the next
    for (const Pair& face : faces) {
        const auto [low, high] = std::minmax(face[0], face[1]);
        bool share = false;
        for (std::size_t axis = 0; there(low) && axis < 3; ++axis) {
            share = share || (high == low + next[axis] && has_next(low, axis));
        }
        if (!share) {
            throw std::invalid_argument("cells " + std::to_string(face[0]) + " and " + std::to_string(face[1]) +
                                        " share no face: two neighbours that are there must be given");
        }
        open.insert({low, high});
    }
    const std::vector<std::array<std::uint32_t, 8>> corners = cell_corners(lattice);
    Unions unions(8 * grid.size());
    for (std::uint32_t c = 0; c < grid.size(); ++c) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (!has_next(grid[c], axis) || open.contains({grid[c], grid[c] + next[axis]})) {
                continue;
            }
            const std::uint32_t other = place[grid[c] + next[axis]];
            for (std::uint32_t corner = 0; corner < 8; ++corner) {
                if ((corner >> axis & 1) != 0) {
                    unions.join(8 * c + corner, 8 * other + (corner ^ 1u << axis));
                }
            }
        }
    }
    // Numbers by the lattice's nodes first, by cells then.
    std::vector<std::uint32_t> firsts;
    for (std::uint32_t use = 0; use < 8 * grid.size(); ++use) {
        if (unions.find(use) == use) {
            firsts.push_back(use);
        }
    }
    const auto lattice_node = [&](std::uint32_t use) { return corners[use / 8][use % 8]; };
    std::stable_sort(firsts.begin(), firsts.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return lattice_node(a) < lattice_node(b); });
    std::vector<std::int32_t> number(8 * grid.size(), -1);
    for (const std::uint32_t use : firsts) {
        number[use] = static_cast<std::int32_t>(separated.lattice_nodes.size());
        separated.lattice_nodes.push_back(lattice_node(use));
        network.rest_positions.push_back(whole.rest_positions[lattice_node(use)]);
    }
    network.masses.assign(firsts.size(), 0.0);

    const double h = lattice.cell_size();
    const SpringConstants constants = spring_constants(material, h);
    const double shares[4] = {0, constants.edge / 4, constants.face_diagonal / 2, constants.cube_diagonal};
    const bool on_means = material.springs == SpringForm::means;
    // Springs by their first node: each but the last of a node names the one before it.
    constexpr std::uint32_t kNone = 0xffffffff;
    std::vector<std::uint32_t> last(firsts.size(), kNone), before;
    const auto spring_of = [&](std::int32_t a, std::int32_t b) {
        std::uint32_t& begin = last[static_cast<std::size_t>(a)];
        for (std::uint32_t s = begin; s != kNone; s = before[s]) {
            if (network.springs[s].b == b) {
                return s;
            }
        }
        before.push_back(begin);
        begin = static_cast<std::uint32_t>(network.springs.size());
        return kNone;
    };
    for (std::uint32_t c = 0; c < grid.size(); ++c) {
        std::array<std::int32_t, 8> nodes{};
        for (std::uint32_t corner = 0; corner < 8; ++corner) {
            nodes[corner] = number[unions.find(8 * c + corner)];
        }
        auto& own = separated.corners.emplace_back();
        std::transform(nodes.begin(), nodes.end(), own.begin(),
                       [](std::int32_t node) { return static_cast<std::uint32_t>(node); });
        const auto scale = static_cast<double>(lattice.cell_scales()[grid[c]]);
        const std::size_t tissue = lattice.cell_tissue(grid[c]);
        const double mass = material_of(lattice, tissue, material).density * h * h * h *
                            static_cast<double>(lattice.cell_fill(grid[c]));
        for (const std::int32_t node : nodes) {
            network.masses[static_cast<std::size_t>(node)] += mass / 8;
        }
        // Cells of which there is nothing but springs are not in the list.
        if (network.cells.size() < whole.cells.size() &&
            std::equal(
                corners[c].begin(), corners[c].end(), whole.cells[network.cells.size()].nodes.begin(),
                [](std::uint32_t corner, std::int32_t node) { return static_cast<std::int32_t>(corner) == node; })) {
            network.cells.push_back(whole.cells[network.cells.size()]);
            network.cells.back().nodes = nodes;
        }
        for (std::uint32_t a = 0; a < 8 && !on_means; ++a) {
            for (std::uint32_t b = a + 1; b < 8; ++b) {
                const double share = scale * shares[std::popcount(a ^ b)];
                if (!(share > 0)) {
                    continue;
                }
                const auto [first, second] = std::minmax(nodes[a], nodes[b]);
                const std::uint32_t known = spring_of(first, second);
                if (known == kNone) {
                    const double edge = first == nodes[a] ? h : -h;
                    std::array<double, 3> rest{};
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        rest[axis] = edge * (static_cast<int>(b >> axis & 1) - static_cast<int>(a >> axis & 1));
                    }
                    network.springs.push_back({first, second, 0, rest});
                }
                (known == kNone ? network.springs.back() : network.springs[known]).stiffness += share;
            }
        }
    }
    return separated;
}

std::vector<Pair> torn_faces(const Lattice& lattice, const SeparatedNetwork& body,
                             VectorField<const double> displacement, double tear_strain) {
    if (!(tear_strain > 0) || !std::isfinite(tear_strain)) {
        refuse_value("tear_strain", tear_strain, "finite and above 0");
    }
    if (displacement.size != body.network.rest_positions.size()) {
        throw std::invalid_argument("displacements of " + std::to_string(displacement.size) +
                                    " nodes given: the body has " + std::to_string(body.network.rest_positions.size()));
    }
    std::vector<std::uint32_t> place(lattice.cell_scales().size(), 0), grid;
    for (std::uint32_t cell = 0; cell < place.size(); ++cell) {
        if (lattice.cell_scales()[cell] > 0) {
            place[cell] = static_cast<std::uint32_t>(grid.size());
            grid.push_back(cell);
        }
    }
    if (grid.size() != body.corners.size()) {
        throw std::invalid_argument("a body of " + std::to_string(body.corners.size()) +
                                    " cells given: the lattice has " + std::to_string(grid.size()));
    }
    // F n along an axis is the mean edge along it, by the cell size.
    const double h = lattice.cell_size();
    const double* const u[3] = {displacement.x, displacement.y, displacement.z};
    const auto mean_edge = [&](std::uint32_t cell, std::size_t axis) {
        std::array<double, 3> edge{};
        for (std::size_t corner = 0; corner < 8; ++corner) {
            const double sign = (corner >> axis & 1) != 0 ? 0.25 : -0.25;
            const auto node = static_cast<std::ptrdiff_t>(body.corners[cell][corner]);
            for (std::size_t c = 0; c < 3; ++c) {
                edge[c] += sign * u[c][node * displacement.stride];
            }
        }
        edge[axis] += h;
        return edge;
    };
    const auto [nx, ny, nz] = lattice.cells();
    const std::array<std::uint32_t, 3> next = {1, static_cast<std::uint32_t>(nx), static_cast<std::uint32_t>(nx * ny)};
    const std::array<int, 3> counts = {nx, ny, nz};
    std::vector<Pair> torn;
    for (const std::uint32_t cell : grid) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const bool is_last = static_cast<int>(cell / next[axis]) % counts[axis] + 1 == counts[axis];
            if (is_last || !(lattice.cell_scales()[cell + next[axis]] > 0)) {
                continue;
            }
            const std::uint32_t low = place[cell], high = place[cell + next[axis]];
            bool holds = true;
            for (std::size_t corner = 0; corner < 8; ++corner) {
                if ((corner >> axis & 1) != 0) {
                    holds = holds && body.corners[low][corner] == body.corners[high][corner ^ std::size_t{1} << axis];
                }
            }
            const std::array<double, 3> one = mean_edge(low, axis), other = mean_edge(high, axis);
            const double stretch = std::hypot(one[0] + other[0], one[1] + other[1], one[2] + other[2]) / (2 * h);
            if (holds && stretch - 1 > tear_strain) {
                torn.push_back({cell, cell + next[axis]});
            }
        }
    }
    return torn;
}

std::vector<std::uint32_t> nodes_before(const SeparatedNetwork& before, const SeparatedNetwork& after) {
    if (before.corners.size() != after.corners.size()) {
        throw std::invalid_argument("bodies of " + std::to_string(before.corners.size()) + " and " +
                                    std::to_string(after.corners.size()) + " cells given: they must be of one lattice");
    }
    std::vector<std::uint32_t> from(after.network.rest_positions.size(), 0);
    for (std::size_t cell = 0; cell < after.corners.size(); ++cell) {
        for (std::size_t corner = 0; corner < 8; ++corner) {
            from[after.corners[cell][corner]] = before.corners[cell][corner];
        }
    }
    return from;
}

} // namespace hybmss
