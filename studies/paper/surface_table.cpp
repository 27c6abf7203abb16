#include "hybmss/equilibrium.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "hybmss/skin.hpp"
#include "hybmss/stress.hpp"
#include "simulation/geometry/triangle_surface.hpp"
#include "simulation/scene/scene_body.hpp"
#include "studies/paper/experiment.hpp"
#include "studies/paper/tables.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace hybmss::paper {
namespace {

using std::numbers::pi;

/// So fine that what facets cut off a circle, 2 pi^2/3 by their square, is far below all errors.
constexpr int kFacets = 1024;
/// So small that what the model has beyond linear elasticity is far below all errors.
constexpr double kStrain = 1e-6;
constexpr double kPoisson = 0.3;

double angle_of(int facet) {
    return 2 * pi * facet / kFacets;
}

/// Triangles of the quadrangle a b c d, counter-clockwise seen from outside.
void add_quadrangle(TriangleSurface& surface, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    surface.triangles.push_back({a, b, c});
    surface.triangles.push_back({a, c, d});
}

/// What a profile, from its low end on the axis to its high one, sweeps about the y axis; (radius, height), m.
TriangleSurface revolved(const std::vector<std::array<double, 2>>& profile) {
    TriangleSurface surface;
    const auto rings = static_cast<std::uint32_t>(profile.size());
    for (int f = 0; f < kFacets; ++f) {
        for (const auto& [r, y] : profile) {
            surface.vertices.push_back({r * std::cos(angle_of(f)), y, r * std::sin(angle_of(f))});
        }
    }
    for (std::uint32_t f = 0; f < kFacets; ++f) {
        const std::uint32_t here = f * rings, next = (f + 1) % kFacets * rings;
        for (std::uint32_t r = 0; r + 1 < rings; ++r) {
            add_quadrangle(surface, here + r, here + r + 1, next + r + 1, next + r);
        }
    }
    weld(surface); // on the axis
    return surface;
}

/// A plate of the half width `half` along x and y and from 0 to `thickness` along z, with a round hole.
TriangleSurface holed_plate(double radius, double half, double thickness) {
    TriangleSurface surface;
    for (int f = 0; f < kFacets; ++f) {
        const double c = std::cos(angle_of(f)), s = std::sin(angle_of(f));
        const double out = half / std::max(std::abs(c), std::abs(s));
        for (const double z : {0.0, thickness}) {
            surface.vertices.push_back({radius * c, radius * s, z});
            surface.vertices.push_back({out * c, out * s, z});
        }
    }
    for (std::uint32_t f = 0; f < kFacets; ++f) {
        const std::uint32_t a = 4 * f, b = 4 * ((f + 1) % kFacets); // hole and edge below, hole and edge above
        add_quadrangle(surface, a, b, b + 1, a + 1);
        add_quadrangle(surface, a + 2, a + 3, b + 3, b + 2);
        add_quadrangle(surface, a, a + 2, b + 2, b);
        add_quadrangle(surface, a + 1, b + 1, b + 3, a + 3);
    }
    return surface;
}

enum class Fill { centre, fraction };

/// How the surface becomes cells, and what they are made of.
struct Way {
    Model model;
    Fill fill;

    SceneBody body(const TriangleSurface& surface, double cell_size) const {
        SceneBody made = (fill == Fill::fraction ? filled : voxelised)(surface, require_closed(surface), cell_size);
        made.mesh = surface;
        for (Vector3& vertex : made.mesh.vertices) {
            for (std::size_t a = 0; a < 3; ++a) {
                vertex[a] -= made.origin[a];
            }
        }
        return made;
    }
    Material material() const { return with_model({.poisson_ratio = kPoisson}, model); }
};

// ---- bodies that turn about the y axis, of radius 1, between plates

constexpr double kFar = 1e3;
const Region kLowPlate = FaceRegion{1, false}, kHighPlate = FaceRegion{1, true};

Summary at_rest(const Way& way, const TriangleSurface& surface, int cells, Scene scene) {
    scene.body = way.body(surface, 1.0 / cells);
    scene.material = way.material();
    scene.solver.method = SolverMethod::static_equilibrium;
    scene.probes = {{"plate", kHighPlate}};
    Summary summary = Simulation(scene).run();
    if (!summary.converged) {
        throw std::runtime_error("surfaces: " + summary.failure);
    }
    return summary;
}

ProbeReading pressed_or_turned(const Way& way, const TriangleSurface& surface, int cells, const std::vector<Fix>& fixes,
                               const Move& move) {
    Scene scene;
    scene.fixes = fixes;
    scene.moves = {move};
    return at_rest(way, surface, cells, scene).probes.at(0);
}

/// The nodes of the planes x = 0 and z = 0, which symmetry holds there.
const Fix kHalfX = {BoxRegion{{-1e-6, -kFar, -kFar}, {1e-6, kFar, kFar}}, 1};
const Fix kHalfZ = {BoxRegion{{-kFar, -kFar, -1e-6}, {kFar, kFar, 1e-6}}, 4};

/// By smooth plates: sides are free, and symmetry holds the rest. N over the displacement.
double axial_stiffness(const Way& way, const TriangleSurface& surface, int cells) {
    const std::vector<Fix> fixes = {{kLowPlate, 2}, kHalfX, kHalfZ};
    const Move move = {kHighPlate, 2, std::array{0.0, kStrain, 0.0}};
    return pressed_or_turned(way, surface, cells, fixes, move).force[1] / kStrain;
}

constexpr double kLength = 2; ///< of the cylinder, m

TriangleSurface cylinder() {
    return revolved({{0, 0}, {1, 0}, {1, kLength}, {0, kLength}});
}

/// Of its own stiffness E A / L.
double tension_error(const Way& way, int cells) {
    return axial_stiffness(way, cylinder(), cells) / (way.material().young_modulus * pi / kLength) - 1;
}

/// Ends turn as rigid plates and may warp. Of G J / L.
double torsion_error(const Way& way, int cells) {
    const double degrees = kStrain * 180 / pi;
    const ProbeReading plate = pressed_or_turned(way, cylinder(), cells, {{kLowPlate, 5}, {NodeRegion{0}, 2}},
                                                 {kHighPlate, 5, Rotation{1, degrees}});
    return plate.torque[1] / (kStrain * shear_modulus(way.material()) * pi / 2 / kLength) - 1;
}

/// A ball without its caps beyond 0.8 of its radius.
TriangleSurface capped_ball() {
    std::vector<std::array<double, 2>> profile = {{0, -0.8}};
    constexpr int kArc = 200;
    for (int a = -kArc; a <= kArc; ++a) {
        const double angle = std::asin(0.8) * a / kArc;
        profile.push_back({std::cos(angle), std::sin(angle)});
    }
    profile.push_back({0, 0.8});
    return revolved(profile);
}

/// A traction on the flat ends: its square over the work that it does, N/m by m^4.
double stiffness_under_traction(const Way& way, int cells) {
    const double traction = kStrain * way.material().young_modulus;
    Scene scene;
    scene.fixes = {kHalfX, kHalfZ, {BoxRegion{{-kFar, -1e-6, -kFar}, {kFar, 1e-6, kFar}}, 2}};
    scene.loads = {{kHighPlate, {0, traction, 0}, {}, LoadKind::traction},
                   {kLowPlate, {0, -traction, 0}, {}, LoadKind::traction}};
    return traction * traction / -at_rest(way, capped_ball(), cells, scene).energies.external;
}

// ---- a plate with a hole under the tension S along x, plane strain (Kirsch, 1898)

/// On the rim and beyond: u 8 G / (S a), polar coordinates by the hole's radius a.
std::array<double, 2> kirsch_displacement(double r, double angle) {
    constexpr double k = 3 - 4 * kPoisson;
    const double c = std::cos(angle), s = std::sin(angle), c3 = std::cos(3 * angle), s3 = std::sin(3 * angle);
    return {r * (k + 1) * c + 2 / r * ((1 + k) * c + c3) - 2 / (r * r * r) * c3,
            r * (k - 3) * s + 2 / r * ((1 - k) * s + s3) - 2 / (r * r * r) * s3};
}

struct HoleErrors {
    double stress, rim;
};

/// The outer edge, four radii from the middle, is led as in the infinite plate; S so that u / a is small.
///
/// The stress: the mean of xx in the two columns of cells beside the y axis, those that are whole from the rim to two
/// radii, by least squares as c0 + c1 r^-2 + c2 r^-4, taken at r = 1. The rim's displacement: as the surface's vertices
/// there move, root mean square of its error over that of the exact one.
HoleErrors hole_errors(const Way& way, int cells) {
    constexpr double kHalf = 4;
    const double h = 1.0 / cells;
    Scene scene;
    scene.body = way.body(holed_plate(1, kHalf, h), h);
    const Lattice lattice = scene_lattice(scene);
    const std::vector<Vector3> rest = rest_positions(lattice, scene.body.origin);
    Loading loading;
    for (std::size_t n = 0; n < rest.size(); ++n) {
        const auto& [x, y, z] = rest[n];
        PrescribedNode node{static_cast<std::uint32_t>(n), 4};
        if (std::max(std::abs(x), std::abs(y)) > kHalf - h / 2) {
            const auto u = kirsch_displacement(std::hypot(x, y), std::atan2(y, x));
            node = {node.node, 7, {kStrain * u[0], kStrain * u[1], 0}, {0, 0, 0}};
        }
        loading.supports.push_back(node);
    }
    EquilibriumSolver<double> solver(lattice, way.material());
    std::vector<Vector3> u(rest.size(), Vector3{});
    const EquilibriumResult result = solver.solve(loading, VectorField<double>::aos(u[0].data(), u.size()));
    if (result.status != EquilibriumStatus::converged) {
        throw std::runtime_error("surfaces, hole: " + result.message);
    }
    const auto displacement = VectorField<const double>::aos(u[0].data(), u.size());

    const StressMeter meter(lattice, way.material());
    std::vector<CellStress> stresses(meter.cell_count());
    meter.read(displacement, stresses);
    std::vector<Eigen::Vector3d> terms;
    std::vector<double> values;
    std::size_t number = 0;
    for (std::size_t cell = 0; cell < lattice.cell_scales().size(); ++cell) {
        if (!(lattice.cell_scales()[cell] > 0)) {
            continue;
        }
        const auto nx = static_cast<std::size_t>(lattice.cells()[0]);
        const double x = scene.body.origin[0] + h * (static_cast<double>(cell % nx) + 0.5),
                     y = scene.body.origin[1] + h * (static_cast<double>(cell / nx) + 0.5), r = std::hypot(x, y);
        if (std::abs(x) < h && r > 1 && r < 2 && lattice.cell_fill(cell) == 1) {
            terms.push_back({1, 1 / (r * r), 1 / (r * r * r * r)});
            values.push_back(stresses[number].cauchy[0]);
        }
        ++number;
    }
    Eigen::MatrixXd matrix(terms.size(), 3);
    Eigen::VectorXd right(terms.size());
    for (std::size_t t = 0; t < terms.size(); ++t) {
        matrix.row(static_cast<Eigen::Index>(t)) = terms[t].transpose();
        right[static_cast<Eigen::Index>(t)] = values[t];
    }
    const double at_rim = matrix.colPivHouseholderQr().solve(right).sum();

    const TriangleMesh& mesh = scene.body.mesh;
    std::vector<Vector3> moved(mesh.vertices.size());
    Skin<double>(lattice, mesh).update(displacement, VectorField<double>::aos(moved[0].data(), moved.size()));
    double error = 0, norm = 0;
    for (int f = 0; f < kFacets; ++f) {
        const auto v = static_cast<std::size_t>(4 * f);
        const auto exact = kirsch_displacement(1, angle_of(f));
        for (std::size_t a = 0; a < 2; ++a) {
            error += std::pow(moved[v][a] - mesh.vertices[v][a] - kStrain * exact[a], 2);
            norm += std::pow(kStrain * exact[a], 2);
        }
    }
    const double tension = 8 * shear_modulus(way.material()) * kStrain;
    return {at_rim / (3 * tension) - 1, std::sqrt(error / norm)};
}

} // namespace

Table surface_table(TableContext& context) {
    Table table{"surfaces",
                "Bodies from surfaces",
                {"A cylinder pulled between smooth plates, and turned at its ends; a ball without its caps, pressed "
                 "between smooth plates, and pulled by a traction on its flat ends; the hole of a plate under tension. "
                 "Cells filled where their centre is inside "
                 "(centre), or by the part of their volume that is (fraction); errors in percent, nu = 0.3, small "
                 "strain."},
                {{"figure", "figure"},
                 {"model", "model"},
                 {"cells", "cells in the radius", 0},
                 {"centre", "centre, %", 3},
                 {"fraction", "fraction, %", 3},
                 {"order", "order of fraction", 2}},
                {},
                {}};
    const std::vector<int> radii = context.quick ? std::vector<int>{4, 8} : std::vector<int>{4, 8, 16};
    /// Errors of one figure, by model, radius and fill.
    const auto add = [&](const std::string& figure, const std::vector<int>& cells, auto errors_of) {
        for (const Model model : {Model::hybmss, Model::hybmss_m}) {
            const std::vector<double> by_centre = errors_of(Way{model, Fill::centre}, cells),
                                      by_fraction = errors_of(Way{model, Fill::fraction}, cells);
            for (std::size_t r = 0; r < by_fraction.size(); ++r) {
                const bool told = r > 0 && std::min(std::abs(by_fraction[r]), std::abs(by_fraction[r - 1])) > 1e-5;
                table.rows.push_back({figure, std::string(name(model)), static_cast<double>(cells[r]),
                                      100 * by_centre[r], 100 * by_fraction[r],
                                      told ? Cell(observed_order(std::abs(by_fraction[r - 1]), cells[r - 1],
                                                                 std::abs(by_fraction[r]), cells[r]))
                                           : Cell()});
            }
        }
    };
    const auto each = [&](const char* what, const auto& error_of) {
        return [&context, what, error_of](const Way& way, const std::vector<int>& cells) {
            std::vector<double> errors;
            for (const int n : cells) {
                context.progress(fmt::format("{}, {} cells in the radius", what, n));
                errors.push_back(error_of(way, n));
            }
            return errors;
        };
    };
    add("cylinder, tension", radii, each("tension", tension_error));
    add("cylinder, torsion", radii, each("torsion", torsion_error));
    // 4/5 of its radius are whole cells. The limit: of the finest by fractions of this model.
    const std::vector<int> ball = context.quick ? std::vector<int>{5, 10} : std::vector<int>{5, 10, 20};
    const auto against_finest = [&](const auto& stiffness_of) {
        std::optional<std::pair<Model, double>> limit;
        return [&, limit, stiffness_of](const Way& way, const std::vector<int>& cells) mutable {
            if (!limit || limit->first != way.model) {
                context.progress("ball, the finest");
                limit = {way.model, stiffness_of(Way{way.model, Fill::fraction}, 2 * cells.back())};
            }
            return each("ball", [&](const Way& w, int n) { return stiffness_of(w, n) / limit->second - 1; })(way,
                                                                                                             cells);
        };
    };
    add("ball between plates", ball,
        against_finest([](const Way& way, int n) { return axial_stiffness(way, capped_ball(), n); }));
    add("ball under traction", ball, against_finest(stiffness_under_traction));
    for (const bool stress : {true, false}) {
        add(stress ? "hole, largest hoop stress" : "hole, displacement of the rim", radii,
            each("hole", [stress](const Way& way, int n) {
                const HoleErrors errors = hole_errors(way, n);
                return stress ? errors.stress : errors.rim;
            }));
    }
    return table;
}

} // namespace hybmss::paper
