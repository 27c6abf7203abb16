#include "reference/body.hpp"
#include "reference/constants.hpp"
#include "reference/volume_energy.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <utility>

namespace hybmss::reference {
namespace {

/// visit(the grid indices of a cell's corners in corner order, its scale, the number of its tissue, its fill)
template <class Visit>
void for_each_filled_cell(const Lattice& lattice, Visit visit) {
    const auto [nx, ny, nz] = lattice.cells();
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                if (!(lattice.cell_scale(i, j, k) > 0)) {
                    continue;
                }
                std::array<std::size_t, 8> corners{};
                for (int c = 0; c < 8; ++c) {
                    corners[static_cast<std::size_t>(c)] =
                        lattice.grid_node_index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                }
                visit(corners, static_cast<double>(lattice.cell_scale(i, j, k)),
                      lattice.cell_tissue(lattice.cell_index(i, j, k)),
                      static_cast<double>(lattice.cell_fill(lattice.cell_index(i, j, k))));
            }
        }
    }
}

/// Numbers the grid nodes that touch a cell, in grid order; -1 for the others.
std::vector<int> number_nodes(const Lattice& lattice) {
    std::vector<int> number(lattice.grid_node_count(), -1);
    for_each_filled_cell(lattice, [&](const std::array<std::size_t, 8>& corners, double, std::size_t, double) {
        for (std::size_t corner : corners) {
            number[corner] = 0;
        }
    });
    int next = 0;
    for (int& n : number) {
        if (n == 0) {
            n = next++;
        }
    }
    return number;
}

Cell make_cell(const std::vector<Vector3d>& rest, const std::array<int, 8>& nodes, double cell_kappa) {
    std::array<Vector3d, 8> corners;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        corners[corner] = rest[static_cast<std::size_t>(nodes[corner])];
    }
    return {nodes, mean_edges(corners), cell_kappa};
}

/// Each face's nodes counter-clockwise seen from outside.
Polyhedron make_polyhedron(const std::vector<Vector3d>& rest, const Network::Polyhedron& given) {
    using Faces = std::vector<std::vector<std::size_t>>;
    const Faces faces = given.shape == CellShape::tetrahedron ? Faces{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}
                        : given.shape == CellShape::pyramid
                            ? Faces{{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}
                            : Faces{{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
    Polyhedron polyhedron;
    polyhedron.nodes.assign(given.nodes.begin(), given.nodes.begin() + static_cast<std::ptrdiff_t>(given.shape));
    for (const std::vector<std::size_t>& f : faces) {
        if (f.size() == 3) {
            polyhedron.triangles.push_back({{f[0], f[1], f[2]}, 1});
            continue;
        }
        for (std::size_t corner = 0; corner < 4; ++corner) {
            polyhedron.triangles.push_back({{f[corner], f[(corner + 1) % 4], f[(corner + 2) % 4]}, 0.5});
        }
    }
    std::vector<Vector3d> corners;
    for (const int node : polyhedron.nodes) {
        corners.push_back(rest[static_cast<std::size_t>(node)]);
    }
    polyhedron.rest_volume = polyhedron_volume(polyhedron, corners);
    return polyhedron;
}

/// Of each polyhedron by itself, or of the nodes, each with equal parts of the volumes around it.
std::vector<VolumeSum> volume_sums(const Body& body, const Network& network) {
    std::vector<VolumeSum> sums;
    if (!network.nodal_volumes) {
        for (std::size_t p = 0; p < body.polyhedra.size(); ++p) {
            sums.push_back({{{p, 1.0}}, body.polyhedra[p].rest_volume, network.polyhedra[p].kappa});
        }
        return sums;
    }
    sums.assign(body.rest.size(), VolumeSum{{}, 0, 0});
    for (std::size_t p = 0; p < body.polyhedra.size(); ++p) {
        const double share = 1.0 / static_cast<double>(body.polyhedra[p].nodes.size());
        for (const int node : body.polyhedra[p].nodes) {
            VolumeSum& sum = sums[static_cast<std::size_t>(node)];
            sum.parts.push_back({p, share});
            sum.rest_volume += share * body.polyhedra[p].rest_volume;
            sum.kappa += share * body.polyhedra[p].rest_volume * network.polyhedra[p].kappa; // by volume: divided below
        }
    }
    std::erase_if(sums, [](const VolumeSum& sum) { return sum.parts.empty(); });
    for (VolumeSum& sum : sums) {
        sum.kappa /= sum.rest_volume;
    }
    return sums;
}

} // namespace

VolumeEnergy resolve_volume_energy(const Material& material) {
    const double modulus = kappa(material.young_modulus, material.poisson_ratio);
    if (modulus == 0) {
        return VolumeEnergy::none;
    }
    if (material.volume_energy == VolumeEnergy::automatic) {
        return modulus > 0 ? VolumeEnergy::quadratic : VolumeEnergy::mean_stretch;
    }
    return material.volume_energy;
}

// Each cell of scale s adds s k_e/4 to its 12 edges, s k_f/2 to its 12 face diagonals and s k_c to its 4 cube diagonals
// (section 5.4), and rho h^3/8 times its fill to the mass of its 8 corners.
// On means: whole springs k_e, k_f, k_c to each cell, times s. A tissue's cells have G s as all others, with kappa and
// rho by its own Poisson's ratio and density.
Body assemble(const Lattice& lattice, const Material& material) {
    const double h = lattice.cell_size();
    const double ratio = material.face_diagonal_ratio;
    const double modulus = shear_modulus(material.young_modulus, material.poisson_ratio);
    // A cell's share, by the number of axes along which a spring's ends differ.
    const double share[4] = {0, edge_stiffness(modulus, ratio, h) / 4, face_diagonal_stiffness(modulus, ratio, h) / 2,
                             cube_diagonal_stiffness(modulus, ratio, h)};
    std::vector<double> kappas = {kappa(material.young_modulus, material.poisson_ratio)};
    std::vector<double> densities = {material.density};
    for (const Tissue& tissue : lattice.tissues()) {
        kappas.push_back(kappa(2 * (1 + tissue.poisson_ratio) * modulus, tissue.poisson_ratio));
        densities.push_back(tissue.density);
    }
    const HourglassStiffness hourglass = hourglass_stiffness(material.young_modulus, material.poisson_ratio, h);

    Body body;
    body.volume_energy = resolve_volume_energy(material);
    if (std::any_of(kappas.begin(), kappas.end(), [&](double k) { return k != kappas[0]; })) {
        body.volume_energy = material.volume_energy;
    }
    body.stiffening = material.stiffening;
    const std::vector<int> number = number_nodes(lattice);
    const auto row = static_cast<std::size_t>(lattice.cells()[0] + 1);
    const auto rows = static_cast<std::size_t>(lattice.cells()[1] + 1);
    for (std::size_t grid = 0; grid < number.size(); ++grid) {
        if (number[grid] >= 0) {
            body.rest.push_back(h * Vector3d(static_cast<double>(grid % row), static_cast<double>(grid / row % rows),
                                             static_cast<double>(grid / row / rows)));
        }
    }
    body.mass.assign(body.rest.size(), 0.0);

    std::map<std::pair<int, int>, Spring> springs;
    for_each_filled_cell(
        lattice, [&](const std::array<std::size_t, 8>& corners, double scale, std::size_t tissue, double fill) {
            std::array<int, 8> nodes{};
            for (std::size_t c = 0; c < 8; ++c) {
                nodes[c] = number[corners[c]];
                body.mass[static_cast<std::size_t>(nodes[c])] += fill * densities[tissue] * h * h * h / 8;
            }
            const bool means = material.springs == SpringForm::means;
            if (means) {
                body.mean_springs.push_back(
                    {nodes,
                     h,
                     {scale * 4 * share[1], scale * 2 * share[2], scale * share[3]},
                     {scale * hourglass.bending, scale * hourglass.coupling, scale * hourglass.twisting,
                      scale * hourglass.twist_sum, scale * hourglass.fourth}});
            }
            for (unsigned low = 0; low < 8 && !means; ++low) {
                for (unsigned high = low + 1; high < 8; ++high) {
                    const double stiffness = share[std::popcount(low ^ high)] * scale;
                    if (stiffness == 0) {
                        continue;
                    }
                    const auto axis = [&](unsigned bit) {
                        return h * (static_cast<double>(high >> bit & 1) - static_cast<double>(low >> bit & 1));
                    };
                    const Vector3d rest_vector(axis(0), axis(1), axis(2));
                    const int a = nodes[low], b = nodes[high]; // a < b: corners ascend in the grid's order
                    springs.try_emplace({a, b}, Spring{a, b, rest_vector, 0.0}).first->second.stiffness += stiffness;
                }
            }
            if (body.volume_energy != VolumeEnergy::none || material.crush.any()) {
                body.cells.push_back({nodes, h * Matrix3d::Identity(), kappas[tissue] * scale,
                                      modulus * material.crush.stiffness * scale, material.crush.ratio});
            }
        });
    for (const auto& entry : springs) {
        body.springs.push_back(entry.second);
    }
    return body;
}

Body assemble(const Network& network) {
    Body body;
    body.mass = network.masses;
    for (const auto& x : network.rest_positions) {
        body.rest.emplace_back(x[0], x[1], x[2]);
    }
    for (const Network::Spring& s : network.springs) {
        const Vector3d rest_vector(s.rest_vector[0], s.rest_vector[1], s.rest_vector[2]);
        body.springs.push_back({s.a, s.b, rest_vector, s.stiffness});
    }
    body.stiffening = network.stiffening;
    const auto& [springs, patterns] = network.means;
    for (const Network::Cell& cell : network.cells) {
        if (cell.scale == 0) {
            continue;
        }
        const double s = cell.scale;
        const Matrix3d edges = make_cell(body.rest, cell.nodes, 0).rest_edges;
        body.mean_springs.push_back({cell.nodes,
                                     edges(0, 0),
                                     {s * springs.edge, s * springs.face_diagonal, s * springs.cube_diagonal},
                                     {s * patterns.bending, s * patterns.coupling * patterns.bending,
                                      s * patterns.twist, s * patterns.joint_twist, s * patterns.fourth}});
    }
    if (network.volume_energy == VolumeEnergy::none || (network.cells.empty() && network.polyhedra.empty())) {
        return body;
    }
    body.volume_energy = network.volume_energy;
    for (const Network::Polyhedron& given : network.polyhedra) {
        body.polyhedra.push_back(make_polyhedron(body.rest, given));
    }
    body.volume_sums = volume_sums(body, network);
    for (const Network::Cell& cell : network.cells) {
        body.cells.push_back(make_cell(body.rest, cell.nodes, cell.kappa));
    }
    return body;
}

} // namespace hybmss::reference
