#include "simulation/scene/other_cells.hpp"

#include "layouts/messages.hpp"
#include "layouts/network/network_geometry.hpp"
#include "simulation/scene/scene_body.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <variant>

namespace hybmss {
namespace {

/// What only bodies of cubes have that do not part, by key, and what there is instead; `who` has not.
void refuse_keys(const Scene& scene, const std::string& who) {
    const auto refuse_where = [&](bool given, const char* key, const char* why) {
        if (given) {
            throw scene_error(scene, key, who + why);
        }
    };
    const auto has_kind = [&](LoadKind kind) {
        return std::ranges::any_of(scene.loads, [kind](const Load& load) { return load.kind == kind; });
    };
    refuse_where(scene.material.crush.any(), "material.crush_resistance", "cubes alone resist crushing so far");
    refuse_where(!scene.relaxation.empty(), "material.relaxation", "cubes alone relax; damping.stiffness may be given");
    refuse_where(!scene.pressures.empty(), "pressure[0].where", "a [[load]] of force or moment may be given");
    refuse_where(!scene.actuations.empty(), "actuate[0].stretch", "cubes alone are actuated; [[move]] leads nodes");
    refuse_where(has_kind(LoadKind::traction) || has_kind(LoadKind::acceleration) || has_kind(LoadKind::force_density),
                 "load[0].where", "a load may be a force or a moment; gravity acts on the whole body");
    refuse_where(scene.body.skin_touches, "body.contact", "obstacles touch their nodes");
    refuse_where(scene.output.skin != SkinFile::none, "output.skin", "the .vtu files hold them as they are");
    refuse_where(scene.output.stress, "output.stress", "cubes alone have stresses so far");
    refuse_where(scene.solver.accuracy.has_value(), "solver.accuracy",
                 "compare meshes of your own; tolerance is allowed");
    refuse_where(scene.solver.preconditioner == PreconditionerKind::multigrid, "solver.preconditioner",
                 "\"automatic\" or \"block-jacobi\" may be given");
    if (scene.body.shape == SceneCells::cubes) {
        return;
    }
    refuse_where(scene.material.springs == SpringForm::means, "material.springs", "their springs are between nodes");
    refuse_where(!scene.labels.empty(), "label[0].value", "they are of the one [material]");
    refuse_where(!scene.cuts.empty(), "cut[0].at", "cubes alone are cut");
    refuse_where(scene.tear_strain.has_value(), "material.tear_strain", "cubes alone tear");
    const bool is_box = scene.body.shape == SceneCells::tetrahedra || scene.body.shape == SceneCells::pyramids;
    refuse_where(scene.body.place.rotate && !is_box, "body.place",
                 "it may be translated; turn the mesh's file instead");
}

FittedCells fitted_or_exact(const Scene& scene) {
    const SceneBody& body = scene.body;
    if (body.shape == SceneCells::mesh) {
        return fit_springs(body.cell_mesh, scene.material, body.most_anisotropy);
    }
    const std::array<int, 3> cells = {static_cast<int>(body.cells[0]), static_cast<int>(body.cells[1]),
                                      static_cast<int>(body.cells[2])};
    FittedCells exact;
    switch (body.shape) {
    case SceneCells::tetrahedra:
        exact.network = tetrahedron_lattice(cells, body.cell_size, scene.material);
        exact.network.nodal_volumes = true;
        break;
    case SceneCells::pyramids:
        exact.network = pyramid_lattice(cells, body.cell_size, scene.material);
        break;
    default:
        exact.network = prism_lattice(cells, body.cell_size, body.cell_size, scene.material);
        break;
    }
    return exact;
}

} // namespace

std::optional<FittedCells> other_cells(const Scene& scene) {
    if (scene.body.shape == SceneCells::cubes) {
        return std::nullopt;
    }
    refuse_keys(scene, "the body's cells are no cubes: ");
    try {
        FittedCells made = fitted_or_exact(scene);
        for (std::array<double, 3>& x : made.network.rest_positions) {
            for (std::size_t a = 0; a < 3; ++a) {
                x[a] += scene.body.origin[a];
            }
        }
        return made;
    } catch (const std::invalid_argument& error) {
        throw scene_error(scene, body_key(scene.body), error.what());
    }
}

void require_cubes(const Scene& scene, const std::string& what) {
    if (scene.body.shape != SceneCells::cubes) {
        throw scene_error(scene, scene.body.shape == SceneCells::mesh ? "body.mesh" : "body.shape",
                          "the body's cells are no cubes, which " + what + " needs");
    }
}

namespace {

bool names_a_node(const Region& region) {
    const auto* const difference = std::get_if<RegionWithout>(&region);
    return std::holds_alternative<NodeRegion>(region) ||
           (difference && (std::ranges::any_of(difference->of, names_a_node) ||
                           std::ranges::any_of(difference->without, names_a_node)));
}

} // namespace

bool may_part(const Scene& scene) {
    return scene.tear_strain.has_value() || std::ranges::any_of(scene.cuts, &Cut::separates);
}

void check_parting(const Scene& scene) {
    refuse_keys(scene, "the body may part: ");
    for (std::size_t c = 0; c < scene.cuts.size(); ++c) {
        if (!scene.cuts[c].separates) {
            throw scene_error(scene, "cut[" + std::to_string(c) + "].at",
                              "the body parts elsewhere: its cuts must have mode = \"separate\"");
        }
    }
    const std::string key = scene.tear_strain ? "material.tear_strain" : "cut[0].at";
    if (scene.solver.method != SolverMethod::symplectic_euler) {
        throw scene_error(scene, key,
                          "cells part while a body moves by symplectic-euler, not with method = \"" +
                              std::string(name(scene.solver.method)) + "\"");
    }
    const auto refuse_nodes = [&](const auto& list, const std::string& table) {
        for (std::size_t i = 0; i < list.size(); ++i) {
            if (names_a_node(list[i].where)) {
                throw scene_error(scene, table + "[" + std::to_string(i) + "].where",
                                  "the body may part, and its nodes are numbered anew then: a region of places may be "
                                  "given");
            }
        }
    };
    refuse_nodes(scene.fixes, "fix");
    refuse_nodes(scene.moves, "move");
    refuse_nodes(scene.loads, "load");
    refuse_nodes(scene.probes, "probe");
    for (std::size_t m = 0; m < scene.moves.size(); ++m) {
        if (std::holds_alternative<Rotation>(scene.moves[m].motion)) {
            throw scene_error(scene, "move[" + std::to_string(m) + "].rotate",
                              "the body may part: nodes are led by translate");
        }
    }
    if (!scene.obstacles.empty()) {
        throw scene_error(scene, "obstacle[0].friction", "the body may part: it touches no obstacles so far");
    }
    if (scene.output.energy_balance) {
        throw scene_error(scene, "output.energy_balance", "the body may part: the summary tells its energy");
    }
}

double edge_of_mesh(const CellMesh& mesh) {
    const std::vector<double> volumes = volumes_of(mesh.cells, mesh.nodes);
    double sum = 0;
    for (const double volume : volumes) {
        sum += std::abs(volume);
    }
    return std::cbrt(sum / static_cast<double>(mesh.nodes.size()));
}

std::vector<double> volumes_of(std::span<const Network::Polyhedron> cells,
                               std::span<const std::array<double, 3>> positions) {
    std::vector<double> volumes;
    volumes.reserve(cells.size());
    for (const Network::Polyhedron& cell : cells) {
        std::array<std::array<double, 3>, 6> corners{};
        for (std::size_t c = 0; c < cell.node_count(); ++c) {
            corners[c] = positions[static_cast<std::size_t>(cell.nodes[c])];
        }
        volumes.push_back(polyhedron_vectors(cell.shape, corners).volume);
    }
    return volumes;
}

namespace {

std::vector<std::array<double, 3>> moved(std::span<const std::array<double, 3>> rest,
                                         std::span<const std::array<double, 3>> displacements) {
    std::vector<std::array<double, 3>> at(rest.begin(), rest.end());
    for (std::size_t n = 0; n < at.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            at[n][a] += displacements[n][a];
        }
    }
    return at;
}

} // namespace

std::vector<double> volume_ratios(std::span<const Network::Polyhedron> cells,
                                  std::span<const std::array<double, 3>> rest,
                                  std::span<const std::array<double, 3>> displacements) {
    const std::vector<double> before = volumes_of(cells, rest);
    std::vector<double> ratios = volumes_of(cells, moved(rest, displacements));
    for (std::size_t c = 0; c < ratios.size(); ++c) {
        ratios[c] /= before[c];
    }
    return ratios;
}

VolumeChange measure_volume_change(std::span<const Network::Polyhedron> cells,
                                   std::span<const std::array<double, 3>> rest,
                                   std::span<const std::array<double, 3>> displacements) {
    const std::vector<double> before = volumes_of(cells, rest), now = volumes_of(cells, moved(rest, displacements));
    VolumeChange change;
    double change_sum = 0;
    for (std::size_t c = 0; c < now.size(); ++c) {
        const double ratio = now[c] / before[c];
        change_sum += now[c] - before[c];
        change.min_cell_volume_ratio = c == 0 ? ratio : std::min(change.min_cell_volume_ratio, ratio);
        change.max_cell_volume_ratio = c == 0 ? ratio : std::max(change.max_cell_volume_ratio, ratio);
    }
    change.relative_volume_change = std::abs(change_sum) / std::accumulate(before.begin(), before.end(), 0.0);
    return change;
}

} // namespace hybmss
