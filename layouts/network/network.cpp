#include "hybmss/network.hpp"

#include "layouts/messages.hpp"
#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

[[noreturn]] void refuse(const std::string& what, std::size_t index, const std::string& why) {
    throw std::invalid_argument(what + " " + std::to_string(index) + ": " + why);
}

struct Offset {
    int x, y, z;
};

/// The kinds of springs that start at a grid node, and the cells around each: those cells' low corners relative to the
/// node.
struct SpringKind {
    Offset from, to;
    Offset cells[4];
    int cell_count;
};

constexpr SpringKind kEdges[] = {
    {{0, 0, 0}, {1, 0, 0}, {{0, 0, 0}, {0, -1, 0}, {0, 0, -1}, {0, -1, -1}}, 4},
    {{0, 0, 0}, {0, 1, 0}, {{0, 0, 0}, {-1, 0, 0}, {0, 0, -1}, {-1, 0, -1}}, 4},
    {{0, 0, 0}, {0, 0, 1}, {{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {-1, -1, 0}}, 4},
};
constexpr SpringKind kFaceDiagonals[] = {
    {{0, 0, 0}, {1, 1, 0}, {{0, 0, 0}, {0, 0, -1}}, 2}, {{1, 0, 0}, {0, 1, 0}, {{0, 0, 0}, {0, 0, -1}}, 2},
    {{0, 0, 0}, {1, 0, 1}, {{0, 0, 0}, {0, -1, 0}}, 2}, {{1, 0, 0}, {0, 0, 1}, {{0, 0, 0}, {0, -1, 0}}, 2},
    {{0, 0, 0}, {0, 1, 1}, {{0, 0, 0}, {-1, 0, 0}}, 2}, {{0, 1, 0}, {0, 0, 1}, {{0, 0, 0}, {-1, 0, 0}}, 2},
};
constexpr SpringKind kCubeDiagonals[] = {
    {{0, 0, 0}, {1, 1, 1}, {{0, 0, 0}}, 1},
    {{1, 0, 0}, {0, 1, 1}, {{0, 0, 0}}, 1},
    {{0, 1, 0}, {1, 0, 1}, {{0, 0, 0}}, 1},
    {{0, 0, 1}, {1, 1, 0}, {{0, 0, 0}}, 1},
};

void validate_means(const Network::Means& means) {
    const auto check = [](const char* name, double value, double least, const char* allowed) {
        if (!(value >= least) || !std::isfinite(value)) {
            refuse_value(name, value, allowed);
        }
    };
    constexpr const char* kNotNegative = "finite and at least 0";
    const auto& [springs, patterns] = means;
    check("network means: edge", springs.edge, 0, kNotNegative);
    check("network means: face_diagonal", springs.face_diagonal, 0, kNotNegative);
    check("network means: cube_diagonal", springs.cube_diagonal, std::numeric_limits<double>::min(),
          "finite and above 0"); // the unit of all others
    check("network means: bending", patterns.bending, 0, kNotNegative);
    check("network means: twist", patterns.twist, 0, kNotNegative);
    check("network means: joint_twist", patterns.joint_twist, 0, kNotNegative);
    check("network means: fourth", patterns.fourth, 0, kNotNegative);
    if (!(std::abs(patterns.coupling) <= 1)) {
        refuse_value("network means: coupling", patterns.coupling, "from -1 to 1");
    }
}

/// Whether the corners of a cell are, up to rounding, those of a cube with edges along x, y and z.
bool is_upright_cube(const Network& network, const Network::Cell& cell) {
    const auto corner = [&](std::size_t c) { return network.rest_positions[static_cast<std::size_t>(cell.nodes[c])]; };
    const std::array<double, 3> low = corner(0);
    const double edge = corner(7)[0] - low[0];
    for (std::size_t c = 0; c < 8; ++c) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double expected = low[axis] + (c >> axis & 1 ? edge : 0);
            if (!(std::abs(corner(c)[axis] - expected) <= 1e-6 * edge)) {
                return false;
            }
        }
    }
    return true;
}

} // namespace

Network Network::from_lattice(const Lattice& lattice, const Material& material) {
    validate(lattice, material);
    if (material.crush.any()) {
        throw std::invalid_argument(
            "crush resistance given for a network: a lattice with it needs the layout flat-rows "
            "or active-rows");
    }
    const auto [nx, ny, nz] = lattice.cells();
    const double h = lattice.cell_size();
    const SpringConstants constants = spring_constants(material, h);
    const bool on_means = material.springs == SpringForm::means;
    const auto scale = [&, nx = nx, ny = ny, nz = nz](int i, int j, int k) -> double {
        const bool inside = i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz;
        return inside ? static_cast<double>(lattice.cell_scale(i, j, k)) : 0.0;
    };

    const std::vector<std::uint32_t> nodes = lattice.nodes();
    std::vector<std::int32_t> number(lattice.grid_node_count(), -1);
    Network network;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        number[nodes[n]] = static_cast<std::int32_t>(n);
        network.rest_positions.push_back(lattice.rest_position(nodes[n]));
    }
    network.masses.assign(nodes.size(), 0.0);
    network.volume_energy = resolved_volume_energy(material);
    network.stiffening = material.stiffening;
    if (on_means) {
        network.means = {constants, pattern_constants(material, h)};
    }
    std::vector<double> kappas, cell_masses; // by tissue
    for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
        const Material own = material_of(lattice, tissue, material);
        const VolumeEnergy energy = resolved_volume_energy(own);
        kappas.push_back(energy == VolumeEnergy::none ? 0.0 : volume_modulus(own));
        cell_masses.push_back(own.density * h * h * h / 8);
        if (network.volume_energy == VolumeEnergy::none) {
            network.volume_energy = energy;
        }
        if (energy != VolumeEnergy::none && energy != network.volume_energy) {
            throw std::invalid_argument(
                "tissues with poisson_ratio on both sides of 0.25 given for a network, which has "
                "one volume energy: such a lattice needs the layout flat-rows or active-rows");
        }
    }

    const auto add_springs = [&](std::span<const SpringKind> kinds, double share, int i, int j, int k) {
        for (const SpringKind& kind : kinds) {
            double scales = 0;
            for (int c = 0; c < kind.cell_count; ++c) {
                scales += scale(i + kind.cells[c].x, j + kind.cells[c].y, k + kind.cells[c].z);
            }
            if (scales * share > 0) {
                const auto a = lattice.grid_node_index(i + kind.from.x, j + kind.from.y, k + kind.from.z);
                const auto b = lattice.grid_node_index(i + kind.to.x, j + kind.to.y, k + kind.to.z);
                network.springs.push_back(
                    {number[a],
                     number[b],
                     scales * share,
                     {h * (kind.to.x - kind.from.x), h * (kind.to.y - kind.from.y), h * (kind.to.z - kind.from.z)}});
            }
        }
    };
    for (int k = 0; k <= nz; ++k) {
        for (int j = 0; j <= ny; ++j) {
            for (int i = 0; i <= nx; ++i) {
                if (!on_means) {
                    add_springs(kEdges, constants.edge / 4, i, j, k);
                    add_springs(kFaceDiagonals, constants.face_diagonal / 2, i, j, k);
                    add_springs(kCubeDiagonals, constants.cube_diagonal, i, j, k);
                }
                if (const double s = scale(i, j, k); s > 0) {
                    const std::size_t index = lattice.cell_index(i, j, k), tissue = lattice.cell_tissue(index);
                    const double mass = cell_masses[tissue] * static_cast<double>(lattice.cell_fill(index));
                    Cell cell{{}, kappas[tissue] * s, on_means ? s : 0};
                    for (int corner = 0; corner < 8; ++corner) {
                        const auto node = static_cast<std::size_t>(number[lattice.grid_node_index(
                            i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2))]);
                        cell.nodes[static_cast<std::size_t>(corner)] = static_cast<std::int32_t>(node);
                        network.masses[node] += mass;
                    }
                    if (kappas[tissue] != 0 || on_means) {
                        network.cells.push_back(cell);
                    }
                }
            }
        }
    }
    return network;
}

void validate(const Network& network) {
    validate(network.stiffening);
    const auto node_count = static_cast<std::int64_t>(network.rest_positions.size());
    if (network.masses.size() != network.rest_positions.size()) {
        throw std::invalid_argument("network: " + std::to_string(network.masses.size()) + " masses for " +
                                    std::to_string(node_count) + " nodes");
    }
    for (std::size_t n = 0; n < network.masses.size(); ++n) {
        if (!(network.masses[n] > 0) || !std::isfinite(network.masses[n])) {
            refuse("mass of node", n,
                   std::to_string(network.masses[n]) + " is not allowed: it must be finite and above 0");
        }
        for (double x : network.rest_positions[n]) {
            if (!std::isfinite(x)) {
                refuse("rest position of node", n, "it must be finite");
            }
        }
    }
    const auto is_node = [&](std::int32_t n) { return n >= 0 && n < node_count; };
    for (std::size_t s = 0; s < network.springs.size(); ++s) {
        const Network::Spring& spring = network.springs[s];
        if (!is_node(spring.a) || !is_node(spring.b) || spring.a == spring.b) {
            refuse("spring", s,
                   "nodes " + std::to_string(spring.a) + " and " + std::to_string(spring.b) +
                       " are not allowed: they must differ and lie in [0, " + std::to_string(node_count) + ")");
        }
        if (!(spring.stiffness >= 0) || !std::isfinite(spring.stiffness)) {
            refuse("spring", s, "its stiffness must be finite and at least 0");
        }
        const auto& r = spring.rest_vector;
        const double length = std::hypot(r[0], r[1], r[2]);
        if (!(length > 0) || !std::isfinite(length)) {
            refuse("spring", s, "its rest vector must be finite and not zero");
        }
    }
    const auto without_volume = [](const auto& cells) {
        return std::all_of(cells.begin(), cells.end(), [](const auto& cell) { return cell.kappa == 0; });
    };
    const bool all_without_volume = without_volume(network.cells) && without_volume(network.polyhedra);
    if (network.volume_energy != VolumeEnergy::quadratic && network.volume_energy != VolumeEnergy::mean_stretch &&
        !(network.volume_energy == VolumeEnergy::none && all_without_volume) &&
        !(network.cells.empty() && network.polyhedra.empty())) {
        throw std::invalid_argument("network: volume_energy must be quadratic or mean_stretch where there are cells");
    }
    if (std::any_of(network.cells.begin(), network.cells.end(), [](const auto& cell) { return cell.scale > 0; })) {
        validate_means(network.means);
    }
    const auto check_nodes = [&](const char* what, std::size_t c, std::span<const std::int32_t> nodes) {
        for (std::size_t corner = 0; corner < nodes.size(); ++corner) {
            const std::int32_t n = nodes[corner];
            if (!is_node(n)) {
                refuse(what, c, "node " + std::to_string(n) + " is outside [0, " + std::to_string(node_count) + ")");
            }
            for (std::size_t other = 0; other < corner; ++other) {
                if (nodes[other] == n) {
                    refuse(what, c, "node " + std::to_string(n) + " appears twice");
                }
            }
        }
    };
    for (std::size_t p = 0; p < network.polyhedra.size(); ++p) {
        const Network::Polyhedron& polyhedron = network.polyhedra[p];
        if (polyhedron.node_count() < 4 || polyhedron.node_count() > 6) {
            refuse("polyhedron", p, "its shape must be tetrahedron, pyramid or prism");
        }
        check_nodes("polyhedron", p, std::span(polyhedron.nodes).first(polyhedron.node_count()));
        const double volume = polyhedron_vectors(network, polyhedron).volume;
        if (!(volume > 0) || !std::isfinite(volume)) {
            refuse("polyhedron", p,
                   "its rest volume is not above 0 (are its nodes in the order of Network::Polyhedron?)");
        }
        if (!std::isfinite(polyhedron.kappa)) {
            refuse("polyhedron", p, "its kappa must be finite");
        }
    }
    for (std::size_t c = 0; c < network.cells.size(); ++c) {
        const Network::Cell& cell = network.cells[c];
        check_nodes("cell", c, cell.nodes);
        if (!(rest_shape(network, cell).volume > 0)) {
            refuse("cell", c, "its rest volume is not above 0 (are its corners in x-fastest order?)");
        }
        if (!std::isfinite(cell.kappa)) {
            refuse("cell", c, "its kappa must be finite");
        }
        if (!(cell.scale >= 0) || !std::isfinite(cell.scale)) {
            refuse("cell", c, "its scale must be finite and at least 0");
        }
        if (cell.scale > 0 && !is_upright_cube(network, cell)) {
            refuse("cell", c, "it has springs on its means, and must be a cube at rest with edges along x, y and z");
        }
    }
}

} // namespace hybmss
