#include "hybmss/equilibrium.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/polyhedra.hpp"
#include "studies/textbook/problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

// A round bar, whose tension and torsion are known exactly, by cells that follow its side and by cubes that do not.

namespace hybmss::textbook {
namespace {

constexpr double kRadius = 0.5, kLength = 1;

/// Rings of 6, 12, 18, ... nodes about the axis; layers as high as rings are wide. Triangles between the rings.
CellMesh prisms(int rings) {
    CellMesh mesh;
    const int layers = static_cast<int>(std::lround(kLength * rings / kRadius)), a_layer = 1 + 3 * rings * (rings + 1);
    const auto node = [&](int ring, int place, int layer) {
        const int of_ring = ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + place % (6 * ring);
        return layer * a_layer + of_ring;
    };
    for (int layer = 0; layer <= layers; ++layer) {
        for (int ring = 0; ring <= rings; ++ring) {
            for (int place = 0; place < std::max(6 * ring, 1); ++place) {
                const double angle = ring == 0 ? 0 : 2 * kPi * place / (6 * ring), r = kRadius * ring / rings;
                mesh.nodes.push_back({r * std::cos(angle), r * std::sin(angle), kLength * layer / layers});
            }
        }
    }
    for (int layer = 0; layer < layers; ++layer) {
        const auto add = [&](std::array<int, 2> p, std::array<int, 2> q, std::array<int, 2> r) {
            mesh.cells.push_back(
                {CellShape::prism,
                 {node(p[0], p[1], layer), node(q[0], q[1], layer), node(r[0], r[1], layer),
                  node(p[0], p[1], layer + 1), node(q[0], q[1], layer + 1), node(r[0], r[1], layer + 1)},
                 0});
        };
        for (int ring = 1; ring <= rings; ++ring) {
            for (int sector = 0; sector < 6; ++sector) {
                for (int place = 0; place < ring; ++place) {
                    const int outer = sector * ring + place, inner = sector * (ring - 1) + place;
                    add({ring - 1, inner}, {ring, outer}, {ring, outer + 1});
                    if (place + 1 < ring) {
                        add({ring - 1, inner}, {ring, outer + 1}, {ring - 1, inner + 1});
                    }
                }
            }
        }
    }
    return mesh;
}

/// Three to a prism; a face of four nodes is divided from its least node, so that neighbours agree.
CellMesh tetrahedra(int rings) {
    const CellMesh whole = prisms(rings);
    CellMesh mesh{whole.nodes, {}};
    for (const Network::Polyhedron& prism : whole.cells) {
        std::array<std::int32_t, 3> order = {0, 1, 2};
        std::sort(order.begin(), order.end(), [&](auto a, auto b) {
            return prism.nodes[static_cast<std::size_t>(a)] < prism.nodes[static_cast<std::size_t>(b)];
        });
        const auto low = [&](std::size_t c) { return prism.nodes[static_cast<std::size_t>(order[c])]; };
        const auto high = [&](std::size_t c) { return prism.nodes[static_cast<std::size_t>(order[c]) + 3]; };
        mesh.cells.push_back({CellShape::tetrahedron, {low(0), low(1), low(2), high(2), 0, 0}, 0});
        mesh.cells.push_back({CellShape::tetrahedron, {low(0), low(1), high(1), high(2), 0, 0}, 0});
        mesh.cells.push_back({CellShape::tetrahedron, {low(0), high(0), high(1), high(2), 0, 0}, 0});
    }
    return mesh;
}

/// Cubes whose middle is in the bar, `across` of them, about its axis; or by the part of each that is.
Network voxels(int across, bool filled, const Material& material) {
    const double h = 2 * kRadius / across;
    const int along = static_cast<int>(std::lround(kLength / h));
    std::vector<float> scales;
    for (int cell = 0; cell < across * across * along; ++cell) {
        const int i = cell % across, j = cell / across % across;
        constexpr int kParts = 32;
        int inside = 0;
        for (int part = 0; part < kParts * kParts; ++part) {
            const double x = (i + (filled ? (part % kParts + 0.5) / kParts : 0.5)) * h - kRadius,
                         y = (j + (filled ? (part / kParts + 0.5) / kParts : 0.5)) * h - kRadius;
            inside += x * x + y * y <= kRadius * kRadius;
        }
        scales.push_back(static_cast<float>(inside) / (kParts * kParts));
    }
    Network network = Network::from_lattice(Lattice::from_cells(across, across, along, h, scales), material);
    for (auto& x : network.rest_positions) {
        x[0] -= kRadius;
        x[1] -= kRadius;
    }
    return network;
}

struct Pulled {
    double tension, torsion; ///< force over E A strain, torque over G pi R^4 / 2 twist; each less 1
    double seconds;          ///< of both solves
    double step_nanoseconds; ///< of a node's step in float
};

Pulled pulled(const Network& network, const Material& material) {
    PlanOptions options;
    options.threads = 1;
    EquilibriumSolver<double> solver(network, options);
    const std::size_t nodes = network.masses.size();
    constexpr double kStrain = 1e-4;
    Pulled found{};
    const std::clock_t start = std::clock();
    for (const bool twisted : {false, true}) {
        Loading loading;
        for (std::size_t n = 0; n < nodes; ++n) {
            const auto& x = network.rest_positions[n];
            if (x[2] > 1e-9 && x[2] < kLength - 1e-9) {
                continue;
            }
            const double by = x[2] > 0.5 ? kStrain : 0;
            const std::array<double, 3> to =
                twisted ? std::array<double, 3>{-by * x[1], by * x[0], 0} : std::array<double, 3>{0, 0, by * kLength};
            // Pulled ends are free across, but for their middle line's node and one beside it.
            const bool on_axis = std::hypot(x[0], x[1]) < 1e-9;
            const bool on_x = std::abs(x[1]) < 1e-9 && x[0] > 0;
            const unsigned axes = twisted ? 7u : on_axis ? 7u : on_x ? 6u : 4u;
            loading.supports.push_back({static_cast<std::uint32_t>(n), static_cast<std::uint8_t>(axes), to, {}});
        }
        std::vector<double> u(3 * nodes), f(3 * nodes);
        const auto field = VectorField<double>::aos(u.data(), nodes);
        EquilibriumOptions how;
        how.tolerance = 1e-6;
        solver.solve(loading, field, how);
        solver.get_forces(field, VectorField<double>::aos(f.data(), nodes));
        double force = 0, torque = 0;
        for (std::size_t n = 0; n < nodes; ++n) {
            const auto& x = network.rest_positions[n];
            if (x[2] > kLength - 1e-9) { // what holds them is the opposite of what they give
                force -= f[3 * n + 2];
                torque -= x[0] * f[3 * n + 1] - x[1] * f[3 * n];
            }
        }
        const double area = kPi * kRadius * kRadius;
        if (twisted) {
            found.torsion = torque / (shear_modulus(material) * area * kRadius * kRadius / 2 * kStrain / kLength) - 1;
        } else {
            found.tension = force / (material.young_modulus * area * kStrain) - 1;
        }
    }
    found.seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    ExplicitDynamics<float> dynamics(network, options);
    const StepParameters step{.time_step = 0.5 * dynamics.critical_time_step()};
    std::vector<double> rounds;
    for (int round = 0; round < 7; ++round) {
        constexpr int kSteps = 200;
        const std::clock_t begin = std::clock();
        dynamics.step(step, kSteps);
        rounds.push_back(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / kSteps);
    }
    std::nth_element(rounds.begin(), rounds.begin() + 3, rounds.end());
    found.step_nanoseconds = 1e9 * rounds[3] / static_cast<double>(nodes);
    return found;
}

} // namespace

paper::Table cylinder_table() {
    paper::Table table{
        "cylinder",
        "A round bar by cells of several shapes",
        {"Radius 0.5 m, length 1 m, pulled and twisted by 1e-4 between its ends, at nu = 0.3: force by E pi R^2 times "
         "the "
         "strain and torque by G pi R^4 / 2 times the twist, errors in %. Prisms and tetrahedra stand in rings, with "
         "fitted springs (hybmss/polyhedra.hpp): misfit around nodes, anisotropy and error of the shear modulus of the "
         "fit in %. Cubes are there where their middle is, or by the part that is within. One thread, time of the "
         "processor: seconds of both equilibria in double to 1e-6; a step in float in ns a node, median of seven "
         "rounds."},
        {{"cells_of", "cells"},
         {"across", "across"},
         {"nodes", "nodes"},
         {"misfit", "misfit, %", 1},
         {"anisotropy", "anisotropy, %", 2},
         {"modulus", "G of the fit, %", 2},
         {"tension", "tension, %", 2},
         {"torsion", "torsion, %", 2},
         {"seconds", "s", 2},
         {"step", "ns a node", 1}},
        {},
        {"Tetrahedra that prisms are divided into have one diagonal to a face and none through the middle: far from "
         "isotropic, and refused unless more is allowed than by default."}};
    Material material;
    material.young_modulus = 1;
    material.poisson_ratio = 0.3;
    material.density = 1;
    for (const int across : {4, 8, 16}) {
        const auto add = [&](const std::string& name, const Network& network, const FittedCells* fit) {
            const Pulled found = pulled(network, material);
            const double none = std::nan("");
            table.rows.push_back({name, fmt::format("{}", across), fmt::format("{}", network.masses.size()),
                                  fit ? 100 * fit->misfit : none, fit ? 100 * fit->anisotropy : none,
                                  fit ? 100 * fit->modulus_error : none, 100 * found.tension, 100 * found.torsion,
                                  found.seconds, found.step_nanoseconds});
        };
        add("cubes", voxels(across, false, material), nullptr);
        add("cubes in part", voxels(across, true, material), nullptr);
        const FittedCells of_prisms = fit_springs(prisms(across / 2), material, 1);
        add("prisms", of_prisms.network, &of_prisms);
        const FittedCells of_tetrahedra = fit_springs(tetrahedra(across / 2), material, 1);
        add("tetrahedra", of_tetrahedra.network, &of_tetrahedra);
    }
    return table;
}

} // namespace hybmss::textbook
