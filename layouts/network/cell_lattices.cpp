#include "hybmss/polyhedra.hpp"

#include "layouts/messages.hpp"
#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss {
namespace {

using Position = std::array<double, 3>;

/// A network that grows cell by cell; springs between the same nodes are one, of the sum of the cells' shares.
class Assembly {
public:
    explicit Assembly(const Material& material)
        : density_(material.density),
          kappa_(resolved_volume_energy(material) == VolumeEnergy::none ? 0 : volume_modulus(material)) {
        if (material.springs == SpringForm::means) {
            throw std::invalid_argument("springs on means given for cells that are no cubes: cubes alone have them");
        }
        if (material.crush.any()) {
            throw std::invalid_argument("crush resistance given for cells that are no cubes: lattices alone have it");
        }
        network_.volume_energy = resolved_volume_energy(material);
        network_.stiffening = material.stiffening;
    }

    std::int32_t add_node(const Position& at) {
        network_.rest_positions.push_back(at);
        network_.masses.push_back(0);
        return static_cast<std::int32_t>(network_.masses.size()) - 1;
    }

    /// With shares of the springs between its corners of these numbers.
    struct Share {
        int a, b;
        double stiffness;
    };
    void add(CellShape shape, const std::array<std::int32_t, 6>& nodes, const std::vector<Share>& shares) {
        const Network::Polyhedron& cell = network_.polyhedra.emplace_back(Network::Polyhedron{shape, nodes, kappa_});
        const double mass =
            density_ * polyhedron_vectors(network_, cell).volume / static_cast<double>(cell.node_count());
        for (std::size_t c = 0; c < cell.node_count(); ++c) {
            network_.masses[static_cast<std::size_t>(nodes[c])] += mass;
        }
        for (const Share& share : shares) {
            const auto [a, b] =
                std::minmax(nodes[static_cast<std::size_t>(share.a)], nodes[static_cast<std::size_t>(share.b)]);
            if (!(share.stiffness > 0)) {
                continue;
            }
            const auto [at, is_new] = springs_.try_emplace({a, b}, network_.springs.size());
            if (is_new) {
                const Position &from = network_.rest_positions[static_cast<std::size_t>(a)],
                               &to = network_.rest_positions[static_cast<std::size_t>(b)];
                network_.springs.push_back({a, b, 0, {to[0] - from[0], to[1] - from[1], to[2] - from[2]}});
            }
            network_.springs[at->second].stiffness += share.stiffness;
        }
    }

    Network take() && {
        // A spring stands by its lower node, as in a lattice's network.
        std::stable_sort(network_.springs.begin(), network_.springs.end(),
                         [](const auto& s, const auto& t) { return std::pair(s.a, s.b) < std::pair(t.a, t.b); });
        return std::move(network_);
    }

private:
    double density_, kappa_;
    Network network_;
    std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> springs_;
};

/// Corners, x fastest, and a middle to each cube, behind all corners.
struct CentredCubes {
    CentredCubes(const std::array<int, 3>& cells, double edge, const Material& material, Assembly& assembly)
        : n(cells) {
        validate(Lattice::box(cells[0], cells[1], cells[2], edge), material);
        for_each({n[0] + 1, n[1] + 1, n[2] + 1}, [&](int i, int j, int k) {
            assembly.add_node({edge * i, edge * j, edge * k});
        });
        for_each(n, [&](int i, int j, int k) {
            assembly.add_node({edge * (i + 0.5), edge * (j + 0.5), edge * (k + 0.5)});
        });
    }

    template <class Visit>
    static void for_each(const std::array<int, 3>& counts, const Visit& visit) {
        for (int k = 0; k < counts[2]; ++k) {
            for (int j = 0; j < counts[1]; ++j) {
                for (int i = 0; i < counts[0]; ++i) {
                    visit(i, j, k);
                }
            }
        }
    }
    std::int32_t corner(const std::array<int, 3>& at) const {
        return (at[2] * (n[1] + 1) + at[1]) * (n[0] + 1) + at[0];
    }
    std::int32_t middle(const std::array<int, 3>& cell) const {
        return corner({n[0], n[1], n[2]}) + 1 + (cell[2] * n[1] + cell[1]) * n[0] + cell[0];
    }
    /// The corners of a cube's low or high face normal to an axis, counter-clockwise seen from within.
    std::array<std::int32_t, 4> face(const std::array<int, 3>& cell, std::size_t axis, bool high) const {
        std::array<std::int32_t, 4> around{};
        constexpr int kAlong[4] = {0, 1, 1, 0}, kAcross[4] = {0, 0, 1, 1};
        for (std::size_t c = 0; c < 4; ++c) {
            std::array<int, 3> at = cell;
            at[axis] += high;
            at[(axis + 1) % 3] += kAlong[c];
            at[(axis + 2) % 3] += kAcross[c];
            around[high ? 3 - c : c] = corner(at);
        }
        return around;
    }

    std::array<int, 3> n;
};

/// Shares of a pyramid of such cubes: an edge of the base is one of eight pyramids', one to the apex of three's.
std::vector<Assembly::Share> pyramid_shares(double shear_modulus, double edge) {
    const double base = shear_modulus * edge / 4, side = shear_modulus * edge / 2;
    return {{0, 1, base}, {1, 2, base}, {2, 3, base}, {3, 0, base},
            {0, 4, side}, {1, 4, side}, {2, 4, side}, {3, 4, side}};
}

} // namespace

Network tetrahedron_lattice(const std::array<int, 3>& cells, double edge, const Material& material) {
    Assembly assembly(material);
    const CentredCubes cubes(cells, edge, material, assembly);
    const double share = shear_modulus(material) * edge / 4; // G a / 4 and 3 G a / 2 / 6
    const std::vector<Assembly::Share> all = {{0, 1, share}, {0, 2, share}, {0, 3, share},
                                              {1, 2, share}, {1, 3, share}, {2, 3, share}};
    const std::vector<Assembly::Share> closing = pyramid_shares(shear_modulus(material), edge);
    CentredCubes::for_each(cells, [&](int i, int j, int k) {
        const std::array<int, 3> cell = {i, j, k};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const bool high : {false, true}) {
                const std::array<std::int32_t, 4> face = cubes.face(cell, axis, high);
                std::array<int, 3> next = cell;
                next[axis] += high ? 1 : -1;
                if (next[axis] < 0 || next[axis] == cells[axis]) {
                    assembly.add(CellShape::pyramid, {face[0], face[1], face[2], face[3], cubes.middle(cell), 0},
                                 closing);
                } else if (high) {
                    for (std::size_t c = 0; c < 4; ++c) {
                        assembly.add(CellShape::tetrahedron,
                                     {cubes.middle(next), face[c], face[(c + 1) % 4], cubes.middle(cell), 0, 0}, all);
                    }
                }
            }
        }
    });
    return std::move(assembly).take();
}

Network pyramid_lattice(const std::array<int, 3>& cells, double edge, const Material& material) {
    Assembly assembly(material);
    const CentredCubes cubes(cells, edge, material, assembly);
    const std::vector<Assembly::Share> shares = pyramid_shares(shear_modulus(material), edge);
    CentredCubes::for_each(cells, [&](int i, int j, int k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const bool high : {false, true}) {
                const std::array<std::int32_t, 4> face = cubes.face({i, j, k}, axis, high);
                assembly.add(CellShape::pyramid, {face[0], face[1], face[2], face[3], cubes.middle({i, j, k}), 0},
                             shares);
            }
        }
    });
    return std::move(assembly).take();
}

Network prism_lattice(const std::array<int, 3>& cells, double edge, double height, const Material& material) {
    validate(Lattice::box(cells[0], cells[1], cells[2], edge), material);
    if (!(height >= edge / 2 && height <= std::sqrt(1.5) * edge)) {
        refuse_value("height", height,
                     "from " + printed("%g", edge / 2) + " to " + printed("%g", std::sqrt(1.5) * edge) +
                         " m, half to sqrt(3/2) of the edge, where no spring has a negative stiffness");
    }
    Assembly assembly(material);
    CentredCubes::for_each({cells[0] + 1, cells[1] + 1, cells[2] + 1}, [&](int i, int j, int k) {
        assembly.add_node({edge * (i + 0.5 * j), edge * std::sqrt(0.75) * j, height * k});
    });
    const double a2 = edge * edge, h2 = height * height, modulus = shear_modulus(material);
    const double volume = std::sqrt(0.75) * a2 * height;
    // An edge of a triangle is one of four prisms', a diagonal of two's, an edge along z of six's.
    const double in_plane = 8 * modulus * volume / (3 * a2) * (1 - a2 / (4 * h2)) / 4;
    const double diagonal = modulus * (a2 + h2) * volume / (3 * a2 * h2) / 2;
    const double along = modulus * volume / h2 * (3 - 2 * h2 / a2) / 6;
    std::vector<Assembly::Share> shares;
    for (int c = 0; c < 3; ++c) {
        const int next = (c + 1) % 3;
        shares.insert(shares.end(), {{c, next, in_plane},
                                     {c + 3, next + 3, in_plane},
                                     {c, c + 3, along},
                                     {c, next + 3, diagonal},
                                     {next, c + 3, diagonal}});
    }
    CentredCubes::for_each(cells, [&](int i, int j, int k) {
        const auto node = [&](int x, int y, int z) {
            return ((k + z) * (cells[1] + 1) + j + y) * (cells[0] + 1) + i + x;
        };
        assembly.add(CellShape::prism,
                     {node(0, 0, 0), node(1, 0, 0), node(0, 1, 0), node(0, 0, 1), node(1, 0, 1), node(0, 1, 1)},
                     shares);
        assembly.add(CellShape::prism,
                     {node(1, 0, 0), node(1, 1, 0), node(0, 1, 0), node(1, 0, 1), node(1, 1, 1), node(0, 1, 1)},
                     shares);
    });
    return std::move(assembly).take();
}

} // namespace hybmss
