#include "bindings/c/arguments.hpp"

#include "bindings/c/fields.hpp"
#include "hybmss/polyhedra.hpp"
#include "hybmss/stress.hpp"
#include "layouts/messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace hybmss::c_interface {

VolumeEnergy volume_energy(hybmss_volume_energy number) {
    switch (number) {
    case HYBMSS_VOLUME_AUTOMATIC:
        return VolumeEnergy::automatic;
    case HYBMSS_VOLUME_QUADRATIC:
        return VolumeEnergy::quadratic;
    case HYBMSS_VOLUME_MEAN_STRETCH:
        return VolumeEnergy::mean_stretch;
    case HYBMSS_VOLUME_NONE:
        return VolumeEnergy::none;
    default:
        throw std::invalid_argument("volume_energy = " + std::to_string(number) +
                                    " is not allowed: it must be 0 to 3 (HYBMSS_VOLUME_...)");
    }
}

SpringForm springs(hybmss_springs number) {
    if (number != HYBMSS_SPRINGS_NODES && number != HYBMSS_SPRINGS_MEANS) {
        throw std::invalid_argument("springs = " + std::to_string(number) +
                                    " is not allowed: it must be 0 or 1 (HYBMSS_SPRINGS_...)");
    }
    return static_cast<SpringForm>(number);
}

Material material(const hybmss_material* given) {
    require(given, "material");
    const Material material = {given->young_modulus,
                               given->poisson_ratio,
                               given->density,
                               given->face_diagonal_ratio,
                               volume_energy(given->volume_energy),
                               {given->stiffening_quadratic, given->stiffening_cubic},
                               springs(given->springs),
                               {given->crush_resistance, given->crush_ratio}};
    validate(material);
    return material;
}

const LatticeBody& lattice_of(const hybmss_body& body, const char* what) {
    const auto* shape = std::get_if<LatticeBody>(&body.shape);
    if (!shape) {
        throw std::invalid_argument(std::string("body is a network: only ") + what);
    }
    return *shape;
}

namespace {

template <class T>
void read(const StressMeter& meter, const hybmss_const_field& displacements, std::span<CellStress> stresses) {
    check<T>(&displacements, meter.node_count(), "displacements");
    Scratch<T> scratch;
    meter.read(Input<T>(displacements, meter.node_count(), scratch).view(), stresses);
}

std::array<double, 3> vector_at(const double* xyz) {
    return {xyz[0], xyz[1], xyz[2]};
}

Network network_of(const hybmss_network& given) {
    constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
    if (given.node_count > kMost || given.spring_count > kMost || given.cell_count > kMost) {
        throw std::invalid_argument("network: at most " + std::to_string(kMost) +
                                    " nodes, springs and cells are allowed");
    }
    require(given.rest_positions, "network rest_positions", given.node_count);
    require(given.masses, "network masses", given.node_count);
    require(given.springs, "network springs", given.spring_count);
    require(given.cells, "network cells", given.cell_count);
    Network network;
    network.volume_energy = volume_energy(given.volume_energy);
    for (std::size_t n = 0; n < given.node_count; ++n) {
        network.rest_positions.push_back(vector_at(given.rest_positions + 3 * n));
        network.masses.push_back(given.masses[n]);
    }
    for (std::size_t s = 0; s < given.spring_count; ++s) {
        const hybmss_spring& spring = given.springs[s];
        network.springs.push_back({spring.a, spring.b, spring.stiffness, vector_at(spring.rest_vector)});
    }
    for (std::size_t c = 0; c < given.cell_count; ++c) {
        Network::Cell cell{{}, given.cells[c].kappa, 0};
        std::copy_n(given.cells[c].nodes, 8, cell.nodes.begin());
        network.cells.push_back(cell);
    }
    return network;
}

hybmss_body* body_of(Network&& network) {
    validate(network);
    const std::size_t nodes = network.masses.size();
    return new hybmss_body{std::move(network), nodes};
}

const SeparatedNetwork& parted_of(const hybmss_body* body, const char* name) {
    require(body, name);
    if (!body->parted) {
        throw std::invalid_argument(std::string(name) + " is not allowed: it must come from hybmss_body_separate");
    }
    return *body->parted;
}

void write_numbers(const std::vector<std::uint32_t>& numbers, std::uint32_t* to, std::size_t count) {
    require(to, "nodes", count);
    require_count(count, numbers.size(), "nodes");
    std::copy(numbers.begin(), numbers.end(), to);
}

hybmss_body* body_of(FittedCells&& fitted, hybmss_spring_fit* fit) {
    if (fit != nullptr) {
        *fit = {fitted.misfit, fitted.anisotropy, fitted.modulus_error, fitted.without};
    }
    return body_of(std::move(fitted.network));
}

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

extern "C" {

hybmss_material hybmss_default_material(void) {
    const Material m;
    return {m.young_modulus,      m.poisson_ratio,   m.density,    m.face_diagonal_ratio, HYBMSS_VOLUME_AUTOMATIC, 0, 0,
            HYBMSS_SPRINGS_NODES, m.crush.stiffness, m.crush.ratio};
}

hybmss_status hybmss_lattice_create(const int32_t cells[3], double cell_size, const float* scales, size_t scale_count,
                                    const hybmss_material* material, hybmss_body** body) {
    return guarded([&] {
        require(body, "body");
        require(cells, "cells");
        require(scales, "scales", scale_count);
        const Material checked = c_interface::material(material);
        Lattice lattice = scales ? Lattice::from_cells(cells[0], cells[1], cells[2], cell_size,
                                                       std::vector<float>(scales, scales + scale_count))
                                 : Lattice::box(cells[0], cells[1], cells[2], cell_size);
        const std::size_t nodes = lattice.nodes().size();
        *body = new hybmss_body{LatticeBody{std::move(lattice), checked}, nodes};
    });
}

hybmss_status hybmss_lattice_create_of_materials(const int32_t cells[3], double cell_size, const uint8_t* labels,
                                                 size_t label_count, const hybmss_material* materials,
                                                 size_t material_count, hybmss_body** body) {
    return guarded([&] {
        require(body, "body");
        require(cells, "cells");
        require(labels, "labels", label_count);
        require(materials, "materials");
        if (material_count < 1 || material_count > 255) {
            throw std::invalid_argument("material_count = " + std::to_string(material_count) +
                                        " is not allowed: from 1 to 255");
        }
        std::vector<Material> all;
        all.reserve(material_count);
        for (std::size_t m = 0; m < material_count; ++m) {
            all.push_back(c_interface::material(materials + m));
        }
        Lattice lattice =
            Lattice::from_materials(cells[0], cells[1], cells[2], cell_size, std::span(labels, label_count), all);
        validate(lattice, all[0]);
        const std::size_t nodes = lattice.nodes().size();
        *body = new hybmss_body{LatticeBody{std::move(lattice), all[0]}, nodes};
    });
}

hybmss_status hybmss_network_create(const hybmss_network* network, hybmss_body** body) {
    return guarded([&] {
        require(body, "body");
        require(network, "network");
        *body = body_of(network_of(*network));
    });
}

hybmss_status hybmss_network_create_on_means(const hybmss_network* network, const hybmss_material* material,
                                             double cell_size, const double* scales, size_t scale_count,
                                             hybmss_body** body) {
    return guarded([&] {
        require(body, "body");
        require(network, "network");
        require(scales, "scales", scale_count);
        require_count(scale_count, network->cell_count, "scales");
        const Material checked = c_interface::material(material);
        if (!(cell_size > 0) || !std::isfinite(cell_size)) {
            refuse_value("cell_size", cell_size, "finite and above 0");
        }
        if (checked.crush.any()) {
            throw std::invalid_argument("crush resistance given for a network: lattices alone have it");
        }
        Network made = network_of(*network);
        made.means = {spring_constants(checked, cell_size), pattern_constants(checked, cell_size)};
        made.stiffening = checked.stiffening;
        for (std::size_t c = 0; c < scale_count; ++c) {
            made.cells[c].scale = scales[c];
        }
        *body = body_of(std::move(made));
    });
}

hybmss_status hybmss_cells_create(hybmss_cell_shape shape, const int32_t cells[3], double edge, double height,
                                  const hybmss_material* material, hybmss_body** body) {
    return guarded([&] {
        require(body, "body");
        require(cells, "cells");
        const Material checked = c_interface::material(material);
        const std::array<int, 3> counts = {cells[0], cells[1], cells[2]};
        Network made;
        switch (static_cast<int>(shape)) {
        case HYBMSS_TETRAHEDRON:
            made = tetrahedron_lattice(counts, edge, checked);
            made.nodal_volumes = true;
            break;
        case HYBMSS_PYRAMID:
            made = pyramid_lattice(counts, edge, checked);
            break;
        case HYBMSS_PRISM:
            made = prism_lattice(counts, edge, height, checked);
            break;
        default:
            refuse_value("shape", static_cast<int>(shape), "4, 5 or 6: a hybmss_cell_shape");
        }
        *body = body_of(std::move(made));
    });
}

hybmss_status hybmss_mesh_create(const double* nodes, size_t node_count, const hybmss_polyhedron* cells,
                                 size_t cell_count, const hybmss_material* material, double most_anisotropy,
                                 hybmss_spring_fit* fit, hybmss_body** body) {
    return guarded([&] {
        require(body, "body");
        require(nodes, "nodes", 3 * node_count);
        require(cells, "cells", cell_count);
        const Material checked = c_interface::material(material);
        CellMesh mesh;
        for (std::size_t n = 0; n < node_count; ++n) {
            mesh.nodes.push_back(vector_at(nodes + 3 * n));
        }
        for (std::size_t c = 0; c < cell_count; ++c) {
            const std::int32_t shape = cells[c].shape;
            if (shape < HYBMSS_TETRAHEDRON || shape > HYBMSS_PRISM) {
                throw std::invalid_argument("cell " + std::to_string(c) + ": shape = " + std::to_string(shape) +
                                            " is not allowed: 4, 5 or 6, a hybmss_cell_shape");
            }
            Network::Polyhedron cell{static_cast<CellShape>(shape), {}, 0};
            std::copy_n(cells[c].nodes, shape, cell.nodes.begin());
            mesh.cells.push_back(cell);
        }
        *body = body_of(fit_springs(mesh, checked, most_anisotropy), fit);
    });
}

hybmss_status hybmss_mesh_read(const char* path, const hybmss_material* material, double most_anisotropy,
                               hybmss_spring_fit* fit, hybmss_body** body) {
    return guarded([&] {
        require(body, "body");
        require(path, "path");
        const Material checked = c_interface::material(material);
        *body = body_of(fit_springs(read_cells(path), checked, most_anisotropy), fit);
    });
}

hybmss_status hybmss_body_polyhedra(const hybmss_body* body, hybmss_polyhedron* cells, size_t* count) {
    return guarded([&] {
        require(body, "body");
        require(count, "count");
        const auto* const network = std::get_if<Network>(&body->shape);
        const std::size_t all = network ? network->polyhedra.size() : 0;
        for (std::size_t c = 0; cells && c < all; ++c) {
            cells[c].shape = static_cast<std::int32_t>(network->polyhedra[c].shape);
            std::copy_n(network->polyhedra[c].nodes.begin(), 6, cells[c].nodes);
        }
        *count = all;
    });
}

hybmss_status hybmss_body_separate(const hybmss_body* lattice, const uint32_t* faces, size_t face_count,
                                   hybmss_body** parted) {
    return guarded([&] {
        require(parted, "parted");
        require(lattice, "lattice");
        require(faces, "faces", 2 * face_count);
        const LatticeBody& whole = lattice_of(*lattice, "the cells of a lattice part");
        std::vector<std::array<std::uint32_t, 2>> given(face_count);
        for (std::size_t f = 0; f < face_count; ++f) {
            given[f] = {faces[2 * f], faces[2 * f + 1]};
        }
        auto made = std::make_unique<SeparatedNetwork>(separate(whole.lattice, whole.material, given));
        std::unique_ptr<hybmss_body> body(body_of(std::move(made->network)));
        made->network = {};
        made->network.rest_positions = std::get<Network>(body->shape).rest_positions;
        body->parted = std::move(made);
        *parted = body.release();
    });
}

hybmss_status hybmss_body_lattice_nodes(const hybmss_body* parted, uint32_t* nodes, size_t count) {
    return guarded([&] { write_numbers(parted_of(parted, "parted").lattice_nodes, nodes, count); });
}

hybmss_status hybmss_body_nodes_before(const hybmss_body* before, const hybmss_body* after, uint32_t* nodes,
                                       size_t count) {
    return guarded(
        [&] { write_numbers(nodes_before(parted_of(before, "before"), parted_of(after, "after")), nodes, count); });
}

hybmss_status hybmss_body_torn_faces(const hybmss_body* lattice, const hybmss_body* parted,
                                     const hybmss_const_field* displacements, double tear_strain, uint32_t* faces,
                                     size_t* count) {
    return guarded([&] {
        require(lattice, "lattice");
        require(count, "count");
        require(displacements, "displacements");
        const SeparatedNetwork& body = parted_of(parted, "parted");
        check<double>(displacements, parted->node_count, "displacements");
        Scratch<double> scratch;
        const std::vector<std::array<std::uint32_t, 2>> torn =
            torn_faces(lattice_of(*lattice, "a lattice has cells that part").lattice, body,
                       Input<double>(*displacements, parted->node_count, scratch).view(), tear_strain);
        for (std::size_t f = 0; faces && f < torn.size(); ++f) {
            std::copy(torn[f].begin(), torn[f].end(), faces + 2 * f);
        }
        *count = torn.size();
    });
}

hybmss_status hybmss_body_without_cells(const hybmss_body* body, const uint32_t* cells, size_t count,
                                        hybmss_body** less) {
    return guarded([&] {
        require(less, "less");
        require(body, "body");
        require(cells, "cells", count);
        LatticeBody cut = lattice_of(*body, "a lattice has cells to remove");
        const auto [nx, ny, nz] = cut.lattice.cells();
        const std::size_t all = cut.lattice.cell_scales().size();
        for (const std::uint32_t cell : std::span(cells, count)) {
            if (cell >= all) {
                throw std::invalid_argument("cell " + std::to_string(cell) + " is not in the grid, which has " +
                                            std::to_string(all) + " cells");
            }
            const auto c = static_cast<int>(cell);
            cut.lattice.set_cell_scale(c % nx, c / nx % ny, c / nx / ny, 0);
        }
        const std::size_t nodes = cut.lattice.nodes().size();
        *less = new hybmss_body{std::move(cut), nodes};
    });
}

void hybmss_body_destroy(hybmss_body* body) {
    delete body;
}

hybmss_status hybmss_body_node_count(const hybmss_body* body, size_t* count) {
    return guarded([&] {
        require(body, "body");
        require(count, "count");
        *count = body->node_count;
    });
}

hybmss_status hybmss_body_rest_positions(const hybmss_body* body, double* positions, size_t count) {
    return guarded([&] {
        require(body, "body");
        require(positions, "positions", count);
        require_count(count, 3 * body->node_count, "positions");
        if (const auto* network = std::get_if<Network>(&body->shape)) {
            for (const std::array<double, 3>& position : network->rest_positions) {
                positions = std::copy(position.begin(), position.end(), positions);
            }
            return;
        }
        const Lattice& lattice = std::get<LatticeBody>(body->shape).lattice;
        for (const std::uint32_t node : lattice.nodes()) {
            const std::array<double, 3> position = lattice.rest_position(node);
            positions = std::copy(position.begin(), position.end(), positions);
        }
    });
}

hybmss_status hybmss_body_grid_indices(const hybmss_body* body, uint32_t* indices, size_t count) {
    return guarded([&] {
        require(body, "body");
        require(indices, "indices", count);
        require_count(count, body->node_count, "indices");
        const std::vector<std::uint32_t> nodes =
            lattice_of(*body, "the nodes of a lattice have grid indices").lattice.nodes();
        std::copy(nodes.begin(), nodes.end(), indices);
    });
}

hybmss_status hybmss_body_cell_count(const hybmss_body* body, size_t* count) {
    return guarded([&] {
        require(body, "body");
        require(count, "count");
        *count = lattice_of(*body, "the cells of a lattice are counted").lattice.cell_count();
    });
}

hybmss_status hybmss_body_stresses(const hybmss_body* body, const hybmss_const_field* displacements,
                                   hybmss_cell_stress* stresses, size_t count) {
    return guarded([&] {
        require(body, "body");
        require(displacements, "displacements");
        require(stresses, "stresses", count);
        const LatticeBody& shape = lattice_of(*body, "the cells of a lattice have stresses");
        const StressMeter meter(shape.lattice, shape.material);
        require_count(count, meter.cell_count(), "stresses");
        std::vector<CellStress> made(count);
        if (displacements->precision == HYBMSS_FLOAT) {
            read<float>(meter, *displacements, made);
        } else {
            read<double>(meter, *displacements, made);
        }
        for (const CellStress& stress : made) {
            std::copy(stress.first_piola.begin(), stress.first_piola.end(), stresses->first_piola);
            std::copy(stress.cauchy.begin(), stress.cauchy.end(), stresses->cauchy);
            std::copy(stress.green_strain.begin(), stress.green_strain.end(), stresses->green_strain);
            stresses->volume_ratio = stress.volume_ratio;
            stresses->energy_density = stress.energy_density;
            stresses->von_mises = stress.von_mises();
            stresses->pressure = stress.pressure();
            ++stresses;
        }
    });
}

} // extern "C"
