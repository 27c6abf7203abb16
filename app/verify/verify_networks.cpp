#include "app/verify/verify_networks.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <set>
#include <utility>

namespace hybmss::verify {
namespace {

using Position = std::array<double, 3>;

std::size_t index(std::int32_t node) {
    return static_cast<std::size_t>(node);
}

Position between(const Position& a, const Position& b) {
    return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

void add_spring(Network& network, std::int32_t a, std::int32_t b, double stiffness) {
    network.springs.push_back(
        {a, b, stiffness, between(network.rest_positions[index(a)], network.rest_positions[index(b)])});
}

enum class Numbering { in_rows, at_random };

/// Sheared, stretched and slightly irregular hexahedra of mixed stiffness and mass, with a hundred springs across the
/// body on top.
Network sheared_cells(VolumeEnergy energy, Numbering numbering, std::mt19937& random) {
    Material material;
    material.poisson_ratio = energy == VolumeEnergy::mean_stretch ? 0.1 : 0.4;
    material.volume_energy = energy;
    const Network lattice = Network::from_lattice(Lattice::box(6, 5, 4, kNetworkCellSize), material);

    Network network;
    network.volume_energy = energy == VolumeEnergy::none ? VolumeEnergy::quadratic : energy;
    const std::size_t count = lattice.rest_positions.size();
    std::vector<std::int32_t> number(count);
    std::iota(number.begin(), number.end(), 0);
    if (numbering == Numbering::at_random) {
        std::shuffle(number.begin(), number.end(), random);
    }
    std::uniform_real_distribution<double> jitter(-0.1 * kNetworkCellSize, 0.1 * kNetworkCellSize);
    std::uniform_real_distribution<double> factor(0.5, 2.0);
    network.rest_positions.resize(count);
    network.masses.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
        const auto& [x, y, z] = lattice.rest_positions[n];
        network.rest_positions[index(number[n])] = {x + 0.6 * y + jitter(random), 1.2 * y - 0.3 * z + jitter(random),
                                                    0.9 * z + 0.2 * x + jitter(random)};
        network.masses[index(number[n])] = lattice.masses[n] * factor(random);
    }
    for (const Network::Spring& spring : lattice.springs) {
        add_spring(network, number[index(spring.a)], number[index(spring.b)], spring.stiffness * factor(random));
    }
    for (Network::Cell cell : lattice.cells) {
        for (std::int32_t& node : cell.nodes) {
            node = number[index(node)];
        }
        // A negative kappa must stay below what the softest springs around it can hold, or the body explodes.
        cell.kappa *= cell.kappa < 0 ? 0.25 * factor(random) : factor(random);
        network.cells.push_back(cell);
    }
    std::uniform_int_distribution<std::int32_t> any(0, static_cast<std::int32_t>(count) - 1);
    for (int s = 0; s < 100; ++s) {
        const std::int32_t a = any(random), b = any(random);
        if (a != b) {
            add_spring(network, a, b, 1e3 * factor(random));
        }
    }
    return network;
}

/// One node tied to all others, in a ring: the worst case for colouring.
Network hub(std::mt19937& random) {
    Network network;
    std::uniform_real_distribution<double> stiffness(100.0, 5e3);
    std::uniform_real_distribution<double> height(-1.0, 1.0);
    network.rest_positions.push_back({0, 0, 0});
    for (std::int32_t n = 1; n <= 77; ++n) {
        network.rest_positions.push_back(
            {kNetworkCellSize * ((n % 9) - 4.5), height(random), kNetworkCellSize * ((n / 9) - 3.5)});
        add_spring(network, n % 2 ? 0 : n, n % 2 ? n : 0, stiffness(random));
        if (n > 1) {
            add_spring(network, n - 1, n, stiffness(random));
        }
    }
    network.masses.assign(network.rest_positions.size(), 2.0);
    return network;
}

/// Two nodes and one spring, and a third node that nothing holds.
Network one_spring() {
    Network network;
    network.rest_positions = {{0, 0, 0}, {0.3, -0.4, 0.2}, {5, 5, 5}};
    network.masses = {1.0, 2.0, 3.0};
    add_spring(network, 1, 0, 800.0);
    return network;
}

/// Up to six springs a node to random partners near it, as in a truss or a cloth.
Network random_truss(std::mt19937& random) {
    Network network;
    std::uniform_real_distribution<double> jitter(-0.2 * kNetworkCellSize, 0.2 * kNetworkCellSize);
    std::uniform_real_distribution<double> stiffness(10.0, 1e4);
    std::uniform_int_distribution<std::int32_t> ahead(1, 40);
    for (std::int32_t n = 0; n < 500; ++n) {
        network.rest_positions.push_back({kNetworkCellSize * (n % 10) + jitter(random),
                                          kNetworkCellSize * (n / 10 % 10) + jitter(random),
                                          kNetworkCellSize * (n / 100) + jitter(random)});
    }
    network.masses.assign(network.rest_positions.size(), 0.5);
    std::set<std::pair<std::int32_t, std::int32_t>> tied;
    for (std::int32_t n = 0; n < 500; ++n) {
        for (int s = 0; s < 6; ++s) {
            const std::int32_t other = n + ahead(random);
            if (other < 500 && tied.emplace(n, other).second) {
                add_spring(network, s % 2 ? n : other, s % 2 ? other : n, stiffness(random));
            }
        }
    }
    return network;
}

} // namespace

std::vector<NamedNetwork> hand_made_networks(VolumeEnergy energy, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<NamedNetwork> all;
    all.push_back({"sheared cells with extra springs", sheared_cells(energy, Numbering::at_random, random)});
    if (energy == VolumeEnergy::none) {
        all.push_back({"hub of 77 springs", hub(random)});
        all.push_back({"one spring", one_spring()});
        all.push_back({"random truss", random_truss(random)});
    }
    // Last: the bodies above stay what a seed has always made.
    all.push_back({"sheared cells numbered in rows", sheared_cells(energy, Numbering::in_rows, random)});
    return all;
}

} // namespace hybmss::verify
