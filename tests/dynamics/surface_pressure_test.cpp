// Pressure that follows a surface: its forces against the reference and as the derivative of a volume, its energy, what
// it is for small pressures, cuts, contact, and what is refused.

#include "dynamics/effects/surface_pressure.hpp"
#include "reference/forces.hpp"
#include "tests/dynamics/touching_body.hpp"
#include "tests/kernels/hessian_plans.hpp"
#include "tests/refusal.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

using reference::Vector3d;
using testing::expect_refusal;
using testing::kEpsilon;

constexpr double kCellSize = 0.3;
const Material kMaterial{1e4, 0.3, 1000, 1};

template <class T>
struct SurfacePressures : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(SurfacePressures, Precisions);

template <class T>
void set_displacements(ExplicitDynamics<T>& body, std::span<const Vector3d> u) {
    const std::vector<T> at = testing::interleaved<T>(u);
    body.set_displacements(VectorField<const T>::aos(at.data(), u.size()));
}
template <class T, class Get>
std::vector<Vector3d> read(const ExplicitDynamics<T>& body, const Get& get) {
    std::vector<T> out(3 * body.node_count());
    get(VectorField<T>::aos(out.data(), body.node_count()));
    return testing::vectors(out);
}
template <class T>
std::vector<Vector3d> effect_forces(const ExplicitDynamics<T>& body) {
    return read(body, [&](const auto& out) { body.get_effect_forces(out); });
}
template <class T>
std::vector<Vector3d> displacements(const ExplicitDynamics<T>& body) {
    return read(body, [&](const auto& out) { body.get_displacements(out); });
}
template <class T>
std::vector<Vector3d> velocities(const ExplicitDynamics<T>& body) {
    return read(body, [&](const auto& out) { body.get_velocities(out); });
}

std::vector<Vector3d> random_vectors(std::size_t count, double size, unsigned seed) {
    return testing::vectors(testing::random_field<double>(count, size, seed));
}

Vector3d vector(const std::array<double, 3>& x) {
    return {x[0], x[1], x[2]};
}

/// The sum of what each face gets of its own pressure.
std::vector<Vector3d> expected_forces(std::span<const SurfaceFace> faces, std::span<const double> pressures,
                                      std::span<const Vector3d> u) {
    std::vector<Vector3d> forces(u.size(), Vector3d::Zero());
    for (std::size_t f = 0; f < faces.size(); ++f) {
        std::array<Vector3d, 4> x;
        for (std::size_t c = 0; c < 4; ++c) {
            x[c] = vector(faces[f].rest_positions[c]) + u[faces[f].nodes[c]];
        }
        const auto of_face = reference::pressure_forces(x);
        for (std::size_t c = 0; c < 4; ++c) {
            forces[faces[f].nodes[c]] += pressures[f] * of_face[c];
        }
    }
    return forces;
}

/// Of all cells together.
double volume(const Lattice& lattice, std::span<const Vector3d> u) {
    const std::vector<std::uint32_t> grid = lattice.nodes();
    double sum = 0;
    for (const auto& cell : cell_corners(lattice)) {
        reference::Corners x;
        for (std::size_t c = 0; c < 8; ++c) {
            x[c] = vector(lattice.rest_position(grid[cell[c]])) + u[cell[c]];
        }
        sum += reference::trilinear_volume(x);
    }
    return sum;
}

/// A block with a hollow and a notch.
Lattice hollow_block() {
    Lattice lattice = Lattice::box(5, 4, 6, kCellSize);
    const std::array<std::array<int, 3>, 4> gone = {{{2, 2, 2}, {2, 2, 3}, {0, 3, 5}, {1, 3, 5}}};
    lattice.remove_cells(gone);
    return lattice;
}

TYPED_TEST(SurfacePressures, forces_agree_with_the_reference_in_every_layout) {
    using T = TypeParam;
    const Lattice lattice = hollow_block();
    const std::vector<SurfaceFace> faces = surface_faces(lattice, {0.4, -1, 3});
    // 148 on the box, 10 around the hollow, and what the notch in an edge adds and takes away: none.
    EXPECT_EQ(faces.size(), 158u);
    std::vector<double> pressures(faces.size());
    for (std::size_t f = 0; f < pressures.size(); ++f) {
        pressures[f] = f % 7 == 0 ? 0 : 100 * std::sin(static_cast<double>(f));
    }
    const std::vector<Vector3d> u = testing::as_held<T>(random_vectors(lattice.nodes().size(), 0.2 * kCellSize, 3));
    const std::vector<Vector3d> expected = expected_forces(faces, pressures, u);
    for (const std::string& layout : distinct_lattice_layouts()) {
        PlanOptions options;
        options.layout = layout;
        ExplicitDynamics<T> body(lattice, kMaterial, options);
        body.press(faces, pressures);
        set_displacements<T>(body, u);
        const std::vector<Vector3d> forces = effect_forces(body);
        for (std::size_t n = 0; n < forces.size(); ++n) {
            EXPECT_NEAR((forces[n] - expected[n]).norm(), 0, 4 * kEpsilon<T> * 100 * kCellSize * kCellSize)
                << layout << ", node " << n;
        }
        // A step from rest gives exactly this momentum, and the elastic forces'.
        const std::vector<Vector3d> elastic = read(body, [&](const auto& out) { body.get_forces(out); });
        const double dt = 0.1 * body.critical_time_step();
        body.step({.time_step = dt});
        const std::vector<Vector3d> v = velocities(body);
        for (std::size_t n = 0; n < v.size(); ++n) {
            const Vector3d wanted = dt / body.masses()[n] * (elastic[n] + expected[n]);
            EXPECT_NEAR((v[n] - wanted).norm(), 0, 1e-5 * wanted.norm() + 1e-6 * dt) << layout << ", node " << n;
        }
    }
}

TEST(SurfacePressure, is_minus_the_derivative_of_the_volume_and_without_sum_or_torque) {
    const Lattice lattice = hollow_block();
    const std::vector<SurfaceFace> faces = surface_faces(lattice);
    const double p = 250;
    std::vector<Vector3d> u = random_vectors(lattice.nodes().size(), 0.2 * kCellSize, 5);
    ExplicitDynamics<double> body(lattice, kMaterial);
    body.press(faces, std::vector<double>(faces.size(), p));
    set_displacements<double>(body, u);
    const std::vector<Vector3d> forces = effect_forces(body);
    const std::vector<std::uint32_t> grid = lattice.nodes();
    Vector3d sum = Vector3d::Zero(), torque = Vector3d::Zero();
    const double area = kCellSize * kCellSize, step = 1e-4 * kCellSize;
    for (std::size_t n = 0; n < forces.size(); ++n) {
        sum += forces[n];
        torque += (vector(lattice.rest_position(grid[n])) + u[n]).cross(forces[n]);
        for (int a = 0; a < 3; ++a) { // volumes are linear in one coordinate: differences have no error but rounding
            const double at = u[n][a];
            u[n][a] = at + step;
            const double more = volume(lattice, u);
            u[n][a] = at - step;
            const double less = volume(lattice, u);
            u[n][a] = at;
            EXPECT_NEAR(forces[n][a], -p * (more - less) / (2 * step), 1e-9 * p * area) << n;
        }
    }
    EXPECT_NEAR(sum.norm(), 0, 1e-12 * p * area);
    EXPECT_NEAR(torque.norm(), 0, 1e-12 * p * area);
}

TEST(SurfacePressure, faces_of_a_network_are_those_of_its_lattice) {
    const Lattice lattice = hollow_block();
    const auto sorted = [](const std::vector<SurfaceFace>& faces) {
        std::vector<std::array<std::uint32_t, 4>> all;
        for (const SurfaceFace& face : faces) {
            std::array<std::uint32_t, 4> nodes = face.nodes; // from the least on, so that the sense stays
            std::rotate(nodes.begin(), std::min_element(nodes.begin(), nodes.end()), nodes.end());
            all.push_back(nodes);
        }
        std::sort(all.begin(), all.end());
        return all;
    };
    const Network network = Network::from_lattice(lattice, kMaterial);
    EXPECT_EQ(sorted(surface_faces(network)), sorted(surface_faces(lattice)));
    std::vector<SurfaceFace> named = surface_faces(lattice, {1, 2, 3});
    for (SurfaceFace& face : named) {
        face.rest_positions = {};
    }
    set_rest_positions(lattice, named, {1, 2, 3});
    for (std::size_t f = 0; f < named.size(); ++f) {
        EXPECT_EQ(named[f].rest_positions, surface_faces(lattice, {1, 2, 3})[f].rest_positions);
    }
    ExplicitDynamics<double> of_lattice(lattice, kMaterial), of_network(network);
    std::vector<SurfaceFace> faces = surface_faces(network);
    of_lattice.press(surface_faces(lattice), std::vector<double>(faces.size(), 10));
    of_network.press(faces, std::vector<double>(faces.size(), 10));
    for (auto* body : {&of_lattice, &of_network}) {
        body->step({.time_step = 0.5 * of_lattice.critical_time_step()}, 20);
    }
    const std::vector<Vector3d> a = displacements(of_lattice), b = displacements(of_network);
    for (std::size_t n = 0; n < a.size(); ++n) {
        EXPECT_NEAR((a[n] - b[n]).norm(), 0, 1e-7 * a[n].norm() + 1e-12);
    }
}

double total_energy(const ExplicitDynamics<double>& body) {
    double sum = body.potential_energy().total() + body.kinetic_energy();
    for (const EffectEnergy& effect : body.effect_energies()) {
        sum += effect.stored + effect.dissipated;
    }
    return sum;
}

/// A tenth of Young's modulus: the body shrinks and swings. Where the surface closes, p (V - V at rest) is stored.
TEST(SurfacePressure, energy_is_kept) {
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        for (const bool closed : {true, false}) {
            const Lattice lattice = hollow_block();
            std::vector<SurfaceFace> faces = surface_faces(lattice);
            faces.resize(closed ? faces.size() : 60);
            const double p = 1000;
            ExplicitDynamics<double> body(lattice, kMaterial);
            body.press(faces, std::vector<double>(faces.size(), p));
            const double dt = 0.02 * body.critical_time_step();
            const StepParameters step{.time_step = dt, .integrator = integrator};
            double greatest = 0, error = 0;
            for (int i = 0; i < 100; ++i) {
                body.step(step, 50);
                const EffectEnergy effect = body.effect_energies().at(0);
                EXPECT_EQ(effect.name, "pressure");
                EXPECT_EQ(effect.dissipated, 0);
                greatest = std::max(greatest, std::abs(effect.stored));
                error = std::max(error, std::abs(total_energy(body)));
                if (closed) {
                    const std::vector<Vector3d> u = displacements(body), none(u.size(), Vector3d::Zero());
                    const double stored = p * (volume(lattice, u) - volume(lattice, none));
                    EXPECT_NEAR(effect.stored, stored, 0.01 * greatest) << i;
                }
            }
            EXPECT_GT(greatest, 10); // J
            EXPECT_LT(error, (integrator == Integrator::leapfrog ? 0.002 : 0.02) * greatest) << closed;
        }
    }
}

/// A small pressure is the load that it is at rest, also where it changes from step to step.
TEST(SurfacePressure, a_small_one_is_a_load) {
    const Lattice lattice = hollow_block();
    const std::vector<SurfaceFace> faces = surface_faces(lattice);
    const std::vector<Vector3d> none(lattice.nodes().size(), Vector3d::Zero());
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        ExplicitDynamics<double> pressed(lattice, kMaterial), loaded(lattice, kMaterial);
        const StepParameters step{
            .time_step = 0.4 * pressed.critical_time_step(), .mass_damping = 3, .integrator = integrator};
        pressed.press(faces, std::vector<double>(faces.size(), 0));
        for (int i = 0; i < 60; ++i) {
            std::vector<double> pressures;
            for (std::size_t f = 0; f < faces.size(); ++f) {
                pressures.push_back(1e-6 * std::sin(0.3 * i + static_cast<double>(f)));
            }
            std::vector<NodalLoad> loads;
            const std::vector<Vector3d> forces = expected_forces(faces, pressures, none);
            for (std::uint32_t n = 0; n < forces.size(); ++n) {
                loads.push_back({n, {forces[n][0], forces[n][1], forces[n][2]}});
            }
            pressed.set_pressures(pressures);
            loaded.load(loads);
            pressed.step(step);
            loaded.step(step);
        }
        const std::vector<Vector3d> a = displacements(pressed), b = displacements(loaded), v = velocities(pressed),
                                    w = velocities(loaded);
        double size = 0, speed = 0;
        for (std::size_t n = 0; n < a.size(); ++n) {
            size = std::max(size, b[n].norm());
            speed = std::max(speed, w[n].norm());
        }
        EXPECT_GT(size, 1e-12);
        for (std::size_t n = 0; n < a.size(); ++n) {
            EXPECT_NEAR((a[n] - b[n]).norm(), 0, 1e-7 * size) << n;
            EXPECT_NEAR((v[n] - w[n]).norm(), 0, 1e-7 * speed) << n;
        }
    }
}

template <class T>
std::uint64_t bits(const ExplicitDynamics<T>& body) {
    const std::vector<T> state = body.exact_state();
    return testing::bits_of(body.effect_memory(), Digest(testing::bits_of(state)));
}

TYPED_TEST(SurfacePressures, bits_do_not_depend_on_threads_calls_or_a_checkpoint) {
    using T = TypeParam;
    const Lattice lattice = Lattice::box(20, 9, 17, kCellSize);
    const std::vector<SurfaceFace> faces = surface_faces(lattice);
    const std::vector<double> pressures(faces.size(), 400);
    const auto made = [&](int threads) {
        PlanOptions options;
        options.threads = threads;
        ExplicitDynamics<T> body(lattice, kMaterial, options);
        body.press(faces, pressures);
        return body;
    };
    const StepParameters step{.time_step = 0.5 * made(1).critical_time_step(), .acceleration = {0, -9, 0}};
    ExplicitDynamics<T> one = made(1);
    one.step(step, 40);
    for (const int threads : {2, 5}) {
        ExplicitDynamics<T> body = made(threads);
        body.step(step, 11);
        body.set_pressures(pressures); // the same
        body.step(step, 9);
        ExplicitDynamics<T> other = made(threads);
        other.set_exact_state(body.exact_state());
        other.set_effect_memory(body.effect_memory());
        other.step(step, 20);
        EXPECT_EQ(bits(other), bits(one)) << threads;
    }
    ExplicitDynamics<T> released = made(1), never(lattice, kMaterial);
    released.press({}, {});
    EXPECT_TRUE(released.effect_energies().empty());
    for (ExplicitDynamics<T>* body : {&released, &never}) {
        body->step(step, 20);
    }
    EXPECT_EQ(bits(released), bits(never));
    EXPECT_NE(bits(one), bits(never));
}

/// Faces go with their cells, whichever of the two sides of a plane they are on; what is laid bare is not pressed.
TEST(SurfacePressure, cut_cells_take_their_faces_along) {
    Lattice lattice = Lattice::box(4, 3, 5, kCellSize);
    const std::vector<SurfaceFace> faces = surface_faces(lattice, {1, 1, 1});
    std::vector<double> pressures(faces.size(), 100);
    ExplicitDynamics<double> body(lattice, kMaterial);
    body.press(faces, pressures);
    const std::vector<Vector3d> u = random_vectors(lattice.nodes().size(), 0.1 * kCellSize, 9);
    set_displacements<double>(body, u);
    std::vector<std::uint32_t> cells;
    for (const auto& [i, j, k] : {std::array{0, 0, 0}, {3, 2, 4}, {3, 1, 2}, {1, 1, 1}, {2, 2, 0}}) {
        cells.push_back(static_cast<std::uint32_t>(lattice.cell_index(i, j, k)));
    }
    const std::vector<std::uint32_t> grid = lattice.nodes();
    EXPECT_EQ(body.remove_cells(lattice, cells), 5u);
    for (std::size_t f = 0; f < faces.size(); ++f) {
        Vector3d middle = vector(faces[f].middle()) - Vector3d(1, 1, 1);
        // Into the cell, against the normal.
        const auto& x = faces[f].rest_positions;
        const Vector3d normal = (vector(x[1]) - vector(x[0])).cross(vector(x[3]) - vector(x[0])).normalized();
        middle = (middle - 0.5 * kCellSize * normal) / kCellSize;
        const auto place = [&](int a) { return static_cast<int>(std::floor(middle[a])); };
        pressures[f] *= lattice.cell_scale(place(0), place(1), place(2)) > 0 ? 1 : 0;
    }
    EXPECT_EQ(std::count(pressures.begin(), pressures.end(), 0.0), 3 + 3 + 1 + 0 + 2);
    const std::vector<Vector3d> expected = expected_forces(faces, pressures, u), forces = effect_forces(body);
    for (std::size_t n = 0; n < forces.size(); ++n) {
        EXPECT_NEAR((forces[n] - expected[n]).norm(), 0, 1e-12) << n;
    }
    body.step({.time_step = 0.5 * body.critical_time_step()}, 50);
    EXPECT_TRUE(body.finite());
}

/// Sucked down to a floor faster than its own waves: it moves as one of which every step looks at all nodes.
TYPED_TEST(SurfacePressures, contact_sees_a_body_come_that_is_pushed) {
    using T = TypeParam;
    const Lattice shape = Lattice::box(3, 2, 3, testing::kEdge);
    std::vector<SurfaceFace> below;
    for (const SurfaceFace& face : surface_faces(shape)) {
        if (face.middle()[1] == 0) {
            below.push_back(face);
        }
    }
    EXPECT_EQ(below.size(), 9u);
    // From rest a block of nodes is not looked at for some steps: within them it comes down from the lesser height.
    for (const auto& [gap, acceleration] : {std::pair{0.3, 1e5}, {0.1, 1e5}, {0.05, 3e4}, {0.02, 1e4}}) {
        SCOPED_TRACE(gap);
        testing::TouchingBody<T> body(shape, {testing::floor_at(-gap)}), watched(shape, {testing::floor_at(-gap)});
        const double pressure = acceleration * body.mass() / (9 * testing::kEdge * testing::kEdge);
        for (testing::TouchingBody<T>* each : {&body, &watched}) {
            each->dynamics.press(below, std::vector<double>(9, 0));
            each->dynamics.step({0.2 * body.time_step}); // a look at rest
            each->dynamics.set_pressures(std::vector<double>(9, -pressure));
        }
        int touched = 0;
        for (long i = 1; touched < 4 && i < 4000; ++i) {
            const std::vector<T> v = watched.velocities();
            watched.dynamics.set_velocities(VectorField<const T>::aos(v.data(), v.size() / 3));
            for (testing::TouchingBody<T>* each : {&body, &watched}) {
                each->dynamics.step({0.2 * body.time_step});
            }
            ASSERT_EQ(body.displacements(), watched.displacements()) << i;
            touched += body.dynamics.obstacle_readings().at(0).nodes > 0;
        }
        EXPECT_EQ(touched, 4);
    }
}

TEST(SurfacePressure, bad_input_is_refused) {
    const Lattice lattice = Lattice::box(2, 1, 1, kCellSize);
    ExplicitDynamics<double> body(lattice, kMaterial);
    const std::vector<SurfaceFace> faces = surface_faces(lattice);
    const std::vector<double> pressures(faces.size(), 1);
    const double nan = std::nan("");
    expect_refusal([&] { body.press(faces, std::vector<double>{1, 2}); }, {"2 pressures", "10 faces"});
    expect_refusal([&] { body.set_pressures(std::vector<double>{1}); }, {"1 pressures", "0 faces"});
    std::vector<SurfaceFace> bad = faces;
    bad[3].nodes[2] = 12;
    expect_refusal([&] { body.press(bad, pressures); }, {"face 3", "node 12", "12 nodes"});
    bad = faces;
    bad[1].nodes[2] = bad[1].nodes[0];
    expect_refusal([&] { body.press(bad, pressures); }, {"face 1", "different"});
    bad = faces;
    bad[0].rest_positions[1][2] = nan;
    expect_refusal([&] { body.press(bad, pressures); }, {"face 0", "finite"});
    EXPECT_TRUE(body.effect_energies().empty());
    body.press(faces, pressures);
    expect_refusal([&] { body.set_pressures(std::vector<double>(faces.size(), nan)); }, {"face 0", "finite"});
    EXPECT_EQ(body.effect_energies().size(), 1u);
}

} // namespace
} // namespace hybmss
