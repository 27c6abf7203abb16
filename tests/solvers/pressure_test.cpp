// Equilibria and implicit steps under pressure: the potential against finite differences, exact volumes, and where
// there is no potential.

#include "hybmss/equilibrium.hpp"
#include "layouts/node_numbers.hpp"
#include "plan/tuning/planned_body.hpp"
#include "solvers/newton/pressure_potential.hpp"
#include "tests/kernels/hessian_plans.hpp"
#include "tests/moving_body.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hybmss {
namespace {

using testing::expect_refusal;
using Point = std::array<double, 3>;

constexpr double kCellSize = 0.1;
const Material kMaterial{1e5, 0.3, 1000, 1};
const double kBulkModulus = 1e5 / (3 * (1 - 2 * 0.3));

Lattice hollow_block() {
    Lattice lattice = Lattice::box(6, 5, 7, kCellSize);
    const std::array<std::array<int, 3>, 3> gone = {{{2, 2, 2}, {2, 2, 3}, {3, 2, 3}}};
    lattice.remove_cells(gone);
    return lattice;
}

std::vector<PrescribedNode> held(const Lattice& lattice, std::uint8_t axes_at_low_sides) {
    std::vector<PrescribedNode> supports;
    const std::vector<std::uint32_t> grid = lattice.nodes();
    for (std::uint32_t n = 0; n < grid.size(); ++n) {
        std::uint8_t axes = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const bool low = lattice.rest_position(grid[n])[a] == 0;
            axes = static_cast<std::uint8_t>(axes | (low && (axes_at_low_sides >> a & 1) ? 1 << a : 0));
        }
        if (axes != 0) {
            supports.push_back({n, axes});
        }
    }
    return supports;
}

/// Those that keep a free body from moving as a whole, and nothing else.
std::vector<PrescribedNode> three_points(const Lattice& lattice) {
    const auto [nx, ny, nz] = lattice.cells();
    const auto node = [&](int i, int j, int k) { return static_cast<std::uint32_t>(lattice.grid_node_index(i, j, k)); };
    return {{node(0, 0, 0), 7}, {node(nx, 0, 0), 6}, {node(0, ny, 0), 4}};
}

std::vector<SurfaceFace> faces_where(const Lattice& lattice, const auto& chosen) {
    std::vector<SurfaceFace> faces;
    for (const SurfaceFace& face : surface_faces(lattice)) {
        if (chosen(face.middle())) {
            faces.push_back(face);
        }
    }
    return faces;
}

/// Every point moves to (1 - s) times its place, with K = p (1/(1-3s)...): at small strain s = p / (3 K).
template <class T>
void expect_shrunk(const Lattice& lattice, const std::vector<SurfaceFace>& faces,
                   const std::vector<PrescribedNode>& supports, double tolerance) {
    const double pressure = 1e-5 * kBulkModulus;
    EquilibriumSolver<T> solver(lattice, kMaterial);
    solver.press(faces);
    Loading loading{.supports = supports, .forces = {}};
    loading.pressures.assign(faces.size(), pressure);
    const std::vector<std::uint32_t> grid = lattice.nodes();
    std::vector<T> u(3 * grid.size(), T(0));
    EquilibriumOptions options;
    options.tolerance = std::is_same_v<T, float> ? 1e-4 : 1e-9;
    const EquilibriumResult result = solver.solve(loading, VectorField<T>::aos(u.data(), grid.size()), options);
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_LE(result.newton_iterations, 5);
    const double shrink = pressure / (3 * kBulkModulus), extent = 0.7;
    for (std::size_t n = 0; n < grid.size(); ++n) {
        const Point x = lattice.rest_position(grid[n]);
        for (std::size_t a = 0; a < 3; ++a) {
            ASSERT_NEAR(static_cast<double>(u[3 * n + a]), -shrink * x[a], tolerance * shrink * extent) << n;
        }
    }
    EXPECT_NEAR(1 - result.min_cell_volume_ratio, pressure / kBulkModulus, 2 * tolerance * pressure / kBulkModulus);
    const std::vector<EffectEnergy> effects = solver.effect_energies();
    ASSERT_EQ(effects.size(), 1u);
    const double volume = 6 * 5 * 7 * kCellSize * kCellSize * kCellSize;
    if (faces.size() == 214) { // the box alone
        EXPECT_NEAR(effects[0].stored, -pressure * volume * 3 * shrink, 1e-3 * pressure * volume * 3 * shrink);
    }
}

TEST(Pressure, a_block_shrinks_by_its_bulk_modulus) {
    const Lattice box = Lattice::box(6, 5, 7, kCellSize);
    expect_shrunk<double>(box, surface_faces(box), three_points(box), 1e-4);
    expect_shrunk<float>(box, surface_faces(box), three_points(box), 3e-2);
}

/// With the same pressure in a hollow as around it every part of the body shrinks alike.
TEST(Pressure, a_block_with_a_hollow_shrinks_like_one_without) {
    const Lattice lattice = hollow_block();
    std::vector<PrescribedNode> supports;
    const std::vector<std::uint32_t> grid = lattice.nodes();
    for (const PrescribedNode& support : three_points(lattice)) {
        const auto at = std::lower_bound(grid.begin(), grid.end(), support.node) - grid.begin();
        supports.push_back({static_cast<std::uint32_t>(at), support.axes});
    }
    expect_shrunk<double>(lattice, surface_faces(lattice), supports, 1e-4);
}

/// An eighth of a body twice as large: its surface ends in the planes of symmetry.
TEST(Pressure, planes_of_symmetry_close_a_surface) {
    const Lattice box = Lattice::box(6, 5, 7, kCellSize);
    const std::vector<SurfaceFace> faces =
        faces_where(box, [](const Point& x) { return x[0] > 0 && x[1] > 0 && x[2] > 0; });
    expect_shrunk<double>(box, faces, held(box, 7), 1e-4);
}

/// Derivatives of the potential by differences, about a state far from rest; and the gradient where it is the force.
TEST(Pressure, forces_and_second_derivatives_are_those_of_the_potential) {
    const Lattice lattice = hollow_block();
    const PlannedBody<double> planned = plan_body<double>(lattice, kMaterial, {}, Operation::forces);
    const Body<double>& body = *planned.body;
    const std::vector<SurfaceFace> faces = surface_faces(lattice);
    std::vector<double> pressures(faces.size(), 300);
    for (std::size_t f = 0; f < faces.size(); ++f) { // another one in the hollow
        const Point x = faces[f].middle();
        const bool outside = x[0] == 0 || x[1] == 0 || x[2] == 0 || x[0] > 0.599 || x[1] > 0.499 || x[2] > 0.699;
        pressures[f] = outside ? 300 : -70;
    }
    PressurePotential<double> pressure(body, faces);
    pressure.set(pressures, {});
    EXPECT_TRUE(pressure.acts());
    const std::size_t n = body.node_count();
    const auto field = [&](NodeField<double>& to, double size, unsigned seed) {
        const std::vector<double> values = testing::random_field<double>(n, size, seed);
        body.write(VectorField<const double>::aos(values.data(), n), 1 / body.length_unit(), to);
        return values;
    };
    State<double> state = body.make_state(false), near = body.make_state(false);
    NodeField<double> along, gradient, product, more, less, force;
    for (NodeField<double>* each : {&along, &gradient, &product, &more, &less, &force}) {
        Body<double>::clear_like(state.displacement, *each);
    }
    const std::vector<double> u = field(state.displacement, 0.2 * kCellSize, 3), p = field(along, kCellSize, 4);
    pressure.add_gradient(state, gradient);
    pressure.add_forces(state, force);
    pressure.add_product(state, along, product);
    const double eps = 1e-4;
    const auto moved = [&](double step) {
        std::vector<double> at = u;
        for (std::size_t i = 0; i < at.size(); ++i) {
            at[i] += step * p[i];
        }
        body.write(VectorField<const double>::aos(at.data(), n), 1 / body.length_unit(), near.displacement);
        return pressure.value(near);
    };
    const double by_difference = (moved(eps) - moved(-eps)) / (2 * eps);
    moved(eps);
    pressure.add_gradient(near, more);
    moved(-eps);
    pressure.add_gradient(near, less);
    double work = 0, size = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const Component<double> g = component(gradient, c), a = component(along, c), f = component(force, c),
                                h = component(product, c), m = component(more, c), l = component(less, c);
        for (std::size_t i = 0; i < n; ++i) {
            const auto at = [&](const Component<double>& of) {
                return of.first[static_cast<std::ptrdiff_t>(body.index_of(i)) * of.stride];
            };
            work += at(g) * at(a) * body.length_unit();
            size = std::max(size, std::abs(at(h)));
            EXPECT_NEAR(at(g), -at(f), 1e-12) << i;
            EXPECT_NEAR(at(h), (at(m) - at(l)) / (2 * eps), 1e-8) << i;
        }
    }
    EXPECT_NEAR(work, by_difference, 1e-7 * std::abs(work));
    EXPECT_GT(size, 1);
}

/// A block that stands on its held foot, pressed on all other faces by far more than a small load.
TEST(Pressure, a_held_rim_closes_a_surface_and_the_end_is_an_equilibrium) {
    const Lattice box = Lattice::box(4, 6, 4, kCellSize);
    std::vector<PrescribedNode> supports = held(box, 2);
    for (PrescribedNode& node : supports) {
        node.axes = 7;
    }
    const std::vector<SurfaceFace> faces = faces_where(box, [](const Point& x) { return x[1] > 0; });
    EquilibriumSolver<double> solver(box, kMaterial);
    solver.press(faces);
    Loading loading{.supports = supports, .forces = {}};
    loading.pressures.assign(faces.size(), 3e4);
    const std::size_t n = solver.node_count();
    std::vector<double> u(3 * n, 0.0), zero(3 * n, 0.0), internal(3 * n), pressed(3 * n);
    const EquilibriumResult result = solver.solve(loading, VectorField<double>::aos(u.data(), n));
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_LT(result.newton_iterations, 30);
    const auto view = [n](const std::vector<double>& of) { return VectorField<const double>::aos(of.data(), n); };
    solver.get_forces(view(u), VectorField<double>::aos(internal.data(), n));
    solver.get_effect_forces(view(u), view(zero), VectorField<double>::aos(pressed.data(), n));
    double largest = 0, support = 0, foot = 0;
    for (std::size_t i = 0; i < 3 * n; ++i) {
        const bool free = box.rest_position(i / 3)[1] > 0;
        const double sum = std::abs(internal[i] + pressed[i]);
        (free ? largest : support) = std::max(free ? largest : support, sum);
        foot += !free && i % 3 == 1 ? -(internal[i] + pressed[i]) : 0;
    }
    EXPECT_LT(largest, 1e-7 * support);
    // The foot bears what presses on the top, whose area has changed: the sides bulge less than they are squeezed.
    EXPECT_NEAR(foot, 3e4 * 0.16, 0.5 * 3e4 * 0.16);
    double down = 0;
    for (std::size_t i = 0; i < n; ++i) {
        down = std::min(down, u[3 * i + 1]);
    }
    EXPECT_LT(down, -0.02);

    // Backward Euler comes to rest there.
    std::vector<double> w(3 * n, 0.0), v(3 * n, 0.0);
    EquilibriumSolver<double> in_time(box, kMaterial);
    in_time.press(faces);
    for (int step = 0; step < 400; ++step) {
        const EquilibriumResult taken = in_time.step(loading, 0.02, 20, VectorField<double>::aos(w.data(), n),
                                                     VectorField<double>::aos(v.data(), n));
        ASSERT_EQ(taken.status, EquilibriumStatus::converged) << taken.message;
    }
    for (std::size_t i = 0; i < 3 * n; ++i) {
        EXPECT_NEAR(w[i], u[i], 1e-5 * kCellSize);
    }
    EXPECT_NEAR(in_time.effect_energies().at(0).stored, solver.effect_energies().at(0).stored,
                1e-4 * std::abs(solver.effect_energies().at(0).stored));
    EXPECT_EQ(in_time.effect_memory().size(), 1u);
}

TEST(Pressure, surfaces_that_end_on_free_nodes_are_refused) {
    const Lattice box = Lattice::box(3, 3, 3, kCellSize);
    const std::vector<SurfaceFace> top = faces_where(box, [](const Point& x) { return x[1] > 0.299; });
    std::vector<double> u(3 * box.nodes().size(), 0.0);
    const auto solve = [&](const std::vector<SurfaceFace>& faces, const std::vector<PrescribedNode>& supports) {
        EquilibriumSolver<double> solver(box, kMaterial);
        solver.press(faces);
        Loading loading{.supports = supports, .forces = {}};
        loading.pressures.assign(faces.size(), 1);
        solver.solve(loading, VectorField<double>::aos(u.data(), box.nodes().size()));
    };
    expect_refusal([&] { solve(top, held(box, 2)); }, {"pressed faces must close", "free to move there"});
    // Held along an axis in two planes of different height there is no one point that all triangles are flat with.
    std::vector<PrescribedNode> both = held(box, 1);
    for (std::uint32_t n = 0; n < box.nodes().size(); ++n) {
        if (box.rest_position(n)[0] > 0.299) {
            both.push_back({n, 1});
        }
    }
    const std::vector<SurfaceFace> band = faces_where(box, [](const Point& x) { return x[0] > 0 && x[0] < 0.3; });
    expect_refusal([&] { solve(band, both); }, {"x = 0", "x = 0.3"});
    EquilibriumSolver<double> solver(box, kMaterial);
    Loading loading{.supports = held(box, 7), .forces = {}};
    loading.pressures = {1};
    expect_refusal([&] { solver.solve(loading, VectorField<double>::aos(u.data(), box.nodes().size())); },
                   {"1 pressures", "0 faces"});
}

} // namespace
} // namespace hybmss
