// Bodies that touch each other and themselves, and are tied to each other: momentum, weight, friction, welds.

#include "hybmss/world.hpp"

#include "dynamics/world/body_cells.hpp"
#include "layouts/node_numbers.hpp"

#include "tests/moving_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

using Vector = std::array<double, 3>;

constexpr double kEdge = 0.125;
const Material kSoft{.young_modulus = 1e5, .poisson_ratio = 0.3, .density = 1000};
const Material kFirm{.young_modulus = 1e6, .poisson_ratio = 0.3, .density = 1000};

template <class T>
PlanOptions one_thread() {
    PlanOptions options;
    options.threads = 1;
    return options;
}

template <class T>
std::size_t add_box(World<T>& world, std::array<int, 3> cells, const Vector& origin, const Material& material = kSoft,
                    double edge = kEdge) {
    const Lattice lattice = Lattice::box(cells[0], cells[1], cells[2], edge);
    return world.add(ExplicitDynamics<T>(lattice, material), lattice, origin);
}

template <class T>
std::vector<double> read(const ExplicitDynamics<T>& body, bool velocities) {
    std::vector<T> values(3 * body.node_count());
    const auto field = VectorField<T>::aos(values.data(), body.node_count());
    velocities ? body.get_velocities(field) : body.get_displacements(field);
    return {values.begin(), values.end()};
}

template <class T>
double mass_of(const ExplicitDynamics<T>& body) {
    const auto masses = body.masses();
    return std::accumulate(masses.begin(), masses.end(), 0.0);
}

/// The mean over the mass.
template <class T>
Vector mean(const ExplicitDynamics<T>& body, bool velocities) {
    const std::vector<double> values = read(body, velocities);
    Vector sum = {0, 0, 0};
    for (std::size_t i = 0; i < values.size(); ++i) {
        sum[i % 3] += body.masses()[i / 3] * values[i] / mass_of(body);
    }
    return sum;
}

template <class T>
std::uint64_t bits(World<T>& world) {
    std::uint64_t hash = 0;
    for (std::size_t b = 0; b < world.body_count(); ++b) {
        for (const bool velocities : {false, true}) {
            hash = testing::bits_of(read(world.body(b), velocities), Digest(hash));
        }
    }
    return hash;
}

template <class T>
double energy(World<T>& world) {
    double sum = 0;
    for (std::size_t b = 0; b < world.body_count(); ++b) {
        sum += world.body(b).kinetic_energy() + world.body(b).potential_energy().total();
    }
    return sum;
}

/// Linear and angular momentum of a body whose nodes are at `origin` + rest + displacement.
struct Momentum {
    Vector linear = {0, 0, 0}, angular = {0, 0, 0};
};
template <class T>
void add_momentum(const ExplicitDynamics<T>& body, const Lattice& lattice, const Vector& origin, Momentum& sum) {
    const std::vector<double> u = read(body, false), v = read(body, true);
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        Vector x = lattice.rest_position(nodes[n]), p{};
        for (std::size_t a = 0; a < 3; ++a) {
            x[a] += origin[a] + u[3 * n + a];
            p[a] = body.masses()[n] * v[3 * n + a];
            sum.linear[a] += p[a];
        }
        sum.angular[0] += x[1] * p[2] - x[2] * p[1];
        sum.angular[1] += x[2] * p[0] - x[0] * p[2];
        sum.angular[2] += x[0] * p[1] - x[1] * p[0];
    }
}

template <class T>
class WorldOf : public ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(WorldOf, Precisions);

TYPED_TEST(WorldOf, bodies_apart_move_as_if_alone) {
    World<TypeParam> world;
    const Lattice lattice = Lattice::box(3, 4, 5, kEdge);
    ExplicitDynamics<TypeParam> alone(lattice, kSoft);
    const std::size_t first = add_box(world, {3, 4, 5}, {0, 0, 0}), second = add_box(world, {2, 2, 2}, {1, 0.1, 0.1});
    world.set_contacts(std::array{BodyContact{.first = first, .second = second}, BodyContact{first, first}});
    const NodalLoad load{0, {10, 20, -5}};
    alone.load({&load, 1});
    world.body(first).load({&load, 1});
    const StepParameters step{0.5 * world.critical_time_step(), {0, -1, 0}, 0.1};
    alone.step(step, 50);
    world.step(step, 20);
    world.step(step, 30);
    EXPECT_EQ(testing::bits_of(read(alone, false)), testing::bits_of(read(world.body(first), false)));
    EXPECT_EQ(testing::bits_of(read(alone, true)), testing::bits_of(read(world.body(first), true)));
    EXPECT_EQ(world.contact_readings().at(0).greatest_depth, 0);
}

/// Two boxes hit each other off centre: what one loses of momentum the other gains, and no energy comes from nowhere.
TYPED_TEST(WorldOf, a_collision_keeps_momentum) {
    World<TypeParam> world;
    const std::array<Vector, 2> origins = {Vector{0, 0, 0}, Vector{0.52, 0.21, -0.13}};
    const Lattice lattice = Lattice::box(4, 4, 4, kEdge);
    for (const Vector& origin : origins) {
        add_box(world, {4, 4, 4}, origin);
    }
    Lattice cut = lattice; // some cells of the face that is hit
    EXPECT_EQ(world.remove_cells(1, cut, std::array<std::uint32_t, 3>{20, 24, 36}), 3u);
    world.set_contacts(std::array{BodyContact{.first = 0, .second = 1, .friction = 0.4}});
    world.place(0, {.velocity = {1.5, 0.1, 0}});
    world.place(1, {.velocity = {-1, 0, 0.2}});
    const auto momentum = [&] {
        Momentum sum;
        for (std::size_t b = 0; b < 2; ++b) {
            add_momentum(world.body(b), lattice, origins[b], sum);
        }
        return sum;
    };
    const Momentum before = momentum();
    const double start = energy(world);
    double most = start;
    for (int i = 0; i < 40; ++i) {
        world.step({.time_step = 0.3 * world.critical_time_step()}, 20);
        most = std::max(most, energy(world));
    }
    const BodyContactReading reading = world.contact_readings().at(0);
    EXPECT_EQ(reading.nodes, 0u);
    EXPECT_LT(mean(world.body(0), true)[0], 0.2); // it has been stopped
    EXPECT_GT(reading.greatest_depth, 0);
    EXPECT_LT(reading.greatest_depth, kEdge); // in the pocket of the cut nodes come near two faces at once
    EXPECT_LT(most, 1.001 * start);
    EXPECT_GT(energy(world), 0.3 * start);
    const double scale = 2.5 * mass_of(world.body(0)), tolerance = std::is_same_v<TypeParam, float> ? 2e-6 : 1e-12;
    const Momentum after = momentum();
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(after.linear[a], before.linear[a], tolerance * scale) << a;
        EXPECT_NEAR(after.angular[a], before.angular[a], 1e-3 * scale * kEdge) << a;
        const double gained = mass_of(world.body(0)) * (mean(world.body(0), true)[a] - (a == 0   ? 1.5
                                                                                        : a == 1 ? 0.1
                                                                                                 : 0));
        EXPECT_NEAR(reading.impulse[a], gained, 2 * tolerance * scale) << a;
    }
}

/// A heap of boxes falls on a held one; the same whoever does the work, however it is called.
TYPED_TEST(WorldOf, threads_and_calls_do_not_change_a_bit) {
    std::vector<std::uint64_t> all;
    for (const int threads : {1, 2, 8}) {
        for (const long call : {1, 7, 120}) {
            World<TypeParam> world(threads);
            add_box(world, {8, 1, 8}, {0, -kEdge, 0});
            std::vector<PrescribedNode> held(world.body(0).node_count());
            for (std::uint32_t n = 0; n < held.size(); ++n) {
                held[n].node = n;
            }
            world.body(0).prescribe(held);
            std::vector<BodyContact> contacts;
            for (std::size_t b = 0; b < 5; ++b) {
                const double shift = 0.1 * static_cast<double>(b);
                add_box(world, {2, 2, 2}, {0.1 + shift, 0.01 + 0.27 * static_cast<double>(b), 0.2 + shift});
                contacts.push_back({.first = 0, .second = b + 1, .friction = 0.3});
                for (std::size_t other = 1; other <= b; ++other) {
                    contacts.push_back({.first = other, .second = b + 1, .friction = 0.3});
                }
            }
            world.set_contacts(contacts);
            const StepParameters step{0.5 * world.critical_time_step(), {0, -10, 0}};
            for (long done = 0; done < 840; done += call) {
                world.step(step, call);
            }
            EXPECT_GT(world.contact_readings().at(0).impulse[1] * world.contact_readings().at(0).impulse[1], 0);
            all.push_back(bits(world));
        }
    }
    for (const std::uint64_t hash : all) {
        EXPECT_EQ(hash, all.front());
    }
}

/// Turned cubes dropped into a box pile up and come to rest: none is pushed through another or through a wall, energy
/// goes down alone, and all that is the same bits for any number of threads.
TEST(World, what_is_dropped_into_a_box_comes_to_rest) {
    constexpr int kAcross = 4, kBodies = 12;
    constexpr double kCell = 0.1 / kAcross, kPitch = 0.15, kWide = 2 * kPitch, kGravity = 9.81;
    const Lattice lattice = Lattice::box(kAcross, kAcross, kAcross, kCell);
    Material material{.young_modulus = 1e5, .poisson_ratio = 0.3, .density = 1000};
    material.crush.stiffness = 20; // they hit each other at a quarter of the speed of sound in them
    std::vector<std::uint64_t> all;
    for (const int threads : {1, 2, 8}) {
        World<float> world(threads);
        std::vector<BodyContact> contacts;
        for (int b = 0; b < kBodies; ++b) {
            const std::size_t body =
                world.add(ExplicitDynamics<float>(lattice, material, one_thread<float>()), lattice);
            // About an axis and by an angle of its own.
            const double angle = 0.7 * std::sin(3.1 * b + 1), c = std::cos(angle), s = std::sin(angle);
            const std::array<double, 9> about = b % 2 == 0 ? std::array<double, 9>{c, -s, 0, s, c, 0, 0, 0, 1}
                                                           : std::array<double, 9>{1, 0, 0, 0, c, -s, 0, s, c};
            Vector position = {(b % 2 + 0.5) * kPitch, 0.1 + 0.15 * (b / 4), (b / 2 % 2 + 0.5) * kPitch};
            for (std::size_t a = 0; a < 3; ++a) { // its middle is there
                position[a] -= 0.05 * (about[3 * a] + about[3 * a + 1] + about[3 * a + 2]);
            }
            world.place(body, {.position = position, .rotation = about});
            std::vector<Obstacle> walls;
            const auto add_wall = [&](const Vector& normal, const Vector& at) {
                walls.push_back({.shape = PlaneShape{normal}, .pose = {.position = at}, .friction = 0.5});
            };
            add_wall({0, 1, 0}, {0, 0, 0});
            add_wall({1, 0, 0}, {0, 0, 0});
            add_wall({-1, 0, 0}, {kWide, 0, 0});
            add_wall({0, 0, 1}, {0, 0, 0});
            add_wall({0, 0, -1}, {0, 0, kWide});
            world.body(body).set_obstacles(surface_nodes(lattice), walls);
            for (std::size_t other = 0; other < body; ++other) {
                contacts.push_back({.first = other, .second = body, .friction = 0.5});
            }
        }
        world.set_contacts(contacts);
        const auto height = [&] { // m kg: of the middle, by the mass
            double sum = 0;
            for (std::size_t b = 0; b < world.body_count(); ++b) {
                sum += mass_of(world.body(b)) * mean(world.body(b), false)[1];
            }
            return sum;
        };
        const double step = 0.5 * world.critical_time_step();
        double before = energy(world) + kGravity * height();
        const double whole = kGravity * mass_of(world.body(0)) * kBodies * 0.1; // J: to lift them by a cube
        for (int i = 0; i < 30; ++i) {
            world.step({step, {0, -kGravity, 0}, 2}, std::lround(0.1 / step));
            const double now = energy(world) + kGravity * height();
            EXPECT_LT(now, before + 1e-4 * whole) << i;
            before = now;
        }
        double depth = 0, kinetic = 0;
        for (const BodyContactReading& reading : world.contact_readings()) {
            depth = std::max(depth, reading.depth);
        }
        EXPECT_GT(depth, 0);
        EXPECT_LT(depth, 0.1 * kCell);
        for (std::size_t b = 0; b < world.body_count(); ++b) {
            kinetic += world.body(b).kinetic_energy();
            const std::vector<double> u = read(world.body(b), false);
            const std::vector<std::uint32_t> nodes = lattice.nodes();
            for (std::size_t n = 0; n < nodes.size(); ++n) {
                for (std::size_t a = 0; a < 3; ++a) {
                    const double x = lattice.rest_position(nodes[n])[a] + u[3 * n + a];
                    EXPECT_GT(x, -0.1 * kCell);
                    EXPECT_LT(x, (a == 1 ? 1 : kWide) + 0.1 * kCell);
                }
            }
        }
        EXPECT_LT(kinetic, 1e-4 * whole);
        all.push_back(bits(world));
    }
    EXPECT_EQ(all[1], all[0]);
    EXPECT_EQ(all[2], all[0]);
}

/// Three boxes on a held plate: each contact carries what lies above it.
TYPED_TEST(WorldOf, a_stack_carries_its_weight) {
    World<TypeParam> world;
    add_box(world, {6, 1, 6}, {-kEdge, -kEdge, -kEdge}, kFirm);
    std::vector<PrescribedNode> held(world.body(0).node_count());
    for (std::uint32_t n = 0; n < held.size(); ++n) {
        held[n].node = n;
    }
    world.body(0).prescribe(held);
    std::vector<BodyContact> contacts;
    for (std::size_t b = 1; b < 4; ++b) {
        const double shift = 0.03 * static_cast<double>(b);
        add_box(world, {4, 3, 4}, {shift, 3 * kEdge * static_cast<double>(b - 1), -shift}, kFirm);
        contacts.push_back({.first = b - 1, .second = b, .friction = 0.5});
    }
    world.set_contacts(contacts);
    const double weight = 10 * mass_of(world.body(1));
    world.step({0.5 * world.critical_time_step(), {0, -10, 0}, 20}, 6000);
    const auto readings = world.contact_readings();
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(readings[c].force[1], -weight * static_cast<double>(3 - c), 1e-3 * weight) << c;
        EXPECT_LT(readings[c].depth, 0.05 * kEdge);
        EXPECT_GT(readings[c].nodes, 20u);
    }
    for (const double u : read(world.body(0), false)) {
        EXPECT_EQ(u, 0); // what is held does not yield, not even for a moment
    }
    for (std::size_t b = 1; b < 4; ++b) {
        for (const double v : mean(world.body(b), true)) {
            EXPECT_NEAR(v, 0, 1e-4);
        }
    }
}

/// Nodes that came in by a plate's top are pushed up, however near its side they are.
TEST(World, what_stands_at_an_edge_is_not_pushed_off) {
    World<double> world;
    add_box(world, {4, 1, 4}, {-4 * kEdge, -kEdge, 0}, kFirm);
    std::vector<PrescribedNode> held(world.body(0).node_count());
    for (std::uint32_t n = 0; n < held.size(); ++n) {
        held[n].node = n;
    }
    world.body(0).prescribe(held);
    add_box(world, {3, 1, 2}, {-2.04 * kEdge, 0, 0.9 * kEdge}, kFirm);
    const double weight = 10 * mass_of(world.body(1)), sunk = 0.1 * kEdge;
    // A column of nodes is nearer to the side than it sinks.
    world.set_contacts(std::array{BodyContact{.first = 1, .second = 0, .stiffness = 2 * 10 / sunk}});
    world.step({0.5 * world.critical_time_step(), {0, -10, 0}, 20}, 500); // then it slides: it leans a little
    const BodyContactReading reading = world.contact_readings().at(0);
    EXPECT_GT(reading.depth, 0.08 * kEdge);
    EXPECT_NEAR(reading.force[1], weight, 0.02 * weight);
    EXPECT_NEAR(reading.force[0], 0, 0.02 * weight);
}

/// Bodies that overlap when they are added part, and slowly.
TYPED_TEST(WorldOf, what_overlaps_at_the_start_parts_without_a_blow) {
    World<TypeParam> world;
    add_box(world, {4, 4, 4}, {0, 0, 0});
    add_box(world, {4, 4, 4}, {0.03, 3.6 * kEdge, 0.03});
    world.set_contacts(std::array{BodyContact{.first = 0, .second = 1}});
    double fastest = 0;
    for (int i = 0; i < 200; ++i) {
        world.step({.time_step = 0.5 * world.critical_time_step()}, 10);
        fastest = std::max(fastest, mean(world.body(1), true)[1]);
    }
    const double gap = mean(world.body(1), false)[1] - mean(world.body(0), false)[1] - 0.4 * kEdge;
    EXPECT_GT(gap, 0);
    const double wave_speed = std::sqrt(kSoft.young_modulus / kSoft.density);
    EXPECT_GT(fastest, 0);
    EXPECT_LT(fastest, 0.06 * wave_speed);
    EXPECT_EQ(world.contact_readings().at(0).nodes, 0u);
}

/// On a slope a box sticks below the angle of friction and slides above it.
TEST(World, friction_holds_up_to_its_angle) {
    for (const double tangent : {0.45, 0.55}) {
        World<double> world;
        add_box(world, {12, 1, 4}, {-0.5, -kEdge, 0});
        std::vector<PrescribedNode> held(world.body(0).node_count());
        for (std::uint32_t n = 0; n < held.size(); ++n) {
            held[n].node = n;
        }
        world.body(0).prescribe(held);
        add_box(world, {2, 1, 2}, {-0.3, 0, 0.11}, kFirm);
        world.set_contacts(std::array{BodyContact{.first = 1, .second = 0, .friction = 0.5}});
        const double g = 1, time_step = 0.5 * world.critical_time_step();
        const auto steps = [&](double seconds) { return std::lround(seconds / time_step); };
        world.step({time_step, {0, -g, 0}, 20}, steps(0.5));
        world.step({time_step, {tangent * g, -g, 0}}, steps(0.05));
        const double before = mean(world.body(1), true)[0];
        world.step({time_step, {tangent * g, -g, 0}}, steps(0.5));
        const double gained = mean(world.body(1), true)[0] - before;
        EXPECT_NEAR(gained, std::max(0.0, tangent - 0.5) * g * 0.5, 0.006) << tangent;
    }
}

/// Halves of a box, welded node by node, move as the box.
TYPED_TEST(WorldOf, welded_halves_are_the_whole) {
    World<TypeParam> world;
    const Lattice whole = Lattice::box(4, 3, 2, kEdge);
    ExplicitDynamics<TypeParam> box(whole, kSoft);
    add_box(world, {2, 3, 2}, {0, 0, 0});
    add_box(world, {2, 3, 2}, {2 * kEdge, 0, 0});
    for (int k = 0; k <= 2; ++k) {
        for (int j = 0; j <= 3; ++j) {
            const Anchor from{0, {2 * kEdge, j * kEdge, k * kEdge}};
            world.attach({from, {1, from.point}});
        }
    }
    const NodalLoad push{0, {3, 5, -2}};
    box.load({&push, 1});
    world.body(0).load({&push, 1}); // the low corner of both
    const StepParameters step{0.5 * box.critical_time_step(), {0, -2, 0}, 0.2};
    box.step(step, 200);
    world.step(step, 200);
    const std::vector<double> u = read(box, false), left = read(world.body(0), false),
                              right = read(world.body(1), false);
    const double scale = *std::max_element(u.begin(), u.end()),
                 tolerance = std::is_same_v<TypeParam, float> ? 1e-5 : 1e-13;
    EXPECT_GT(scale, 1e-5);
    for (int k = 0; k <= 2; ++k) {
        for (int j = 0; j <= 3; ++j) {
            for (int i = 0; i <= 4; ++i) {
                const auto node = static_cast<std::size_t>(i + 5 * (j + 4 * k)),
                           half = static_cast<std::size_t>(i % 3 + 3 * (j + 4 * k));
                for (std::size_t a = 0; a < 3; ++a) {
                    const double part =
                        i < 3 ? left[3 * half + a] : right[3 * (static_cast<std::size_t>(i - 2 + 3 * (j + 4 * k))) + a];
                    EXPECT_NEAR(part, u[3 * node + a], tolerance * scale * 30) << i << j << k;
                }
            }
        }
    }
}

/// A box hangs from a spring that holds it in the middle of a cell, and follows when the other end is moved.
TYPED_TEST(WorldOf, a_spring_carries_what_hangs_on_it) {
    World<TypeParam> world;
    add_box(world, {3, 3, 3}, {0, 0, 0}, kFirm);
    const double k = 2000, weight = 10 * mass_of(world.body(0));
    const Vector middle = {1.5 * kEdge, 1.5 * kEdge, 1.5 * kEdge};
    const std::size_t spring = world.attach({{0, middle}, {{}, middle}, k});
    const StepParameters step{0.5 * world.critical_time_step(), {0, -10, 0}, 10};
    world.step(step, 6000);
    EXPECT_NEAR(world.attachment_force(spring)[1], weight, 1e-3 * weight);
    const double sunk = mean(world.body(0), false)[1];
    EXPECT_NEAR(sunk, -weight / k, 0.03 * weight / k);
    world.move_anchor(spring, {middle[0] + 1, middle[1], middle[2]});
    world.step(step, 6000);
    EXPECT_NEAR(mean(world.body(0), false)[0], 1, 1e-3);
    EXPECT_NEAR(mean(world.body(0), false)[1], sunk, 1e-3);
    world.detach(spring);
    world.step(step, 100);
    EXPECT_EQ(world.attachment_force(spring), (Vector{0, 0, 0}));
    EXPECT_LT(mean(world.body(0), false)[1], sunk - 0.01);
}

/// However stiff it is, and however far it is away, a pointer that drags a node keeps the body finite.
TEST(World, dragging_is_stable) {
    for (const double stiffness : {1.0, 1e6, std::numeric_limits<double>::infinity()}) {
        World<float> world;
        add_box(world, {4, 4, 4}, {0, 0, 0});
        const Vector corner = {4 * kEdge, 4 * kEdge, 4 * kEdge};
        const std::size_t pointer = world.attach({{0, corner}, {{}, corner}, stiffness});
        const StepParameters step{0.9 * world.critical_time_step(), {0, 0, 0}, 2};
        for (int i = 0; i < 500; ++i) {
            const double angle = 0.02 * i;
            world.move_anchor(pointer, {corner[0] + std::sin(angle), corner[1], corner[2] + 1 - std::cos(angle)});
            world.step(step, 5);
        }
        EXPECT_TRUE(world.body(0).finite());
        if (std::isinf(stiffness)) { // it is there
            const std::vector<double> u = read(world.body(0), false);
            EXPECT_NEAR(u[u.size() - 3], std::sin(0.02 * 499), 1e-5);
        }
    }
}

/// The arms of a U are pressed together: they meet, and do not go through each other.
TYPED_TEST(WorldOf, a_body_touches_itself) {
    World<TypeParam> world;
    std::vector<float> cells(7 * 8 * 2, 1);
    for (int k = 0; k < 2; ++k) {
        for (int j = 2; j < 8; ++j) {
            for (int i = 2; i < 5; ++i) {
                cells[static_cast<std::size_t>(i + 7 * (j + 8 * k))] = 0;
            }
        }
    }
    const Lattice lattice = Lattice::from_cells(7, 8, 2, kEdge, cells);
    for (const bool touches : {false, true}) {
        const std::size_t body = world.add(ExplicitDynamics<TypeParam>(lattice, kSoft), lattice);
        const auto nodes = lattice.nodes();
        std::vector<NodalLoad> loads;
        std::vector<PrescribedNode> foot;
        for (std::uint32_t n = 0; n < nodes.size(); ++n) {
            const Vector x = lattice.rest_position(nodes[n]);
            if (x[1] == 8 * kEdge) {
                loads.push_back({n, {x[0] < 3 * kEdge ? 6.0 : -6.0, 0, 0}});
            } else if (x[1] == 0) {
                foot.push_back({n, 7, {}, {}});
            }
        }
        world.body(body).load(loads);
        world.body(body).prescribe(foot);
        if (touches) {
            world.set_contacts(std::array{BodyContact{.first = body, .second = body, .friction = 0.2}});
        }
        world.step({0.5 * world.critical_time_step(), {0, 0, 0}, 5}, 4000);
        // The inner edges of the arms' ends.
        const std::vector<double> u = read(world.body(body), false);
        double gap = 1;
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            const Vector x = lattice.rest_position(nodes[n]);
            if (x[1] == 8 * kEdge && x[0] == 2 * kEdge) {
                gap = std::min(gap, u[3 * (n + 1)] + 3 * kEdge - u[3 * n]);
            }
        }
        if (touches) {
            EXPECT_GT(gap, -0.12 * kEdge);
            EXPECT_LT(gap, 0.1 * kEdge);
            EXPECT_GT(world.contact_readings().at(0).nodes, 0u);
        } else {
            EXPECT_LT(gap, -0.4 * kEdge); // one through the other
        }
    }
}

/// A body turned by the pose is at rest, and turns on as the pose says.
TYPED_TEST(WorldOf, a_placed_body_is_a_rigid_one) {
    World<TypeParam> world;
    add_box(world, {2, 3, 4}, {0.3, 0, 0});
    const double c = std::cos(0.7), s = std::sin(0.7);
    world.place(0, {.position = {5, -1, 2}, .rotation = {c, -s, 0, s, c, 0, 0, 0, 1}, .angular_velocity = {0, 0, 2}});
    const ExplicitDynamics<TypeParam>& body = world.body(0);
    EXPECT_LT(body.potential_energy().total(), (std::is_same_v<TypeParam, float> ? 1e-6 : 1e-20));
    const std::vector<double> u = read(body, false), v = read(body, true);
    EXPECT_NEAR(u[0], 5 + c * 0.3 - 0.3, 1e-6); // of the node at (0.3, 0, 0)
    EXPECT_NEAR(u[1], -1 + s * 0.3, 1e-6);
    EXPECT_NEAR(v[0], -2 * s * 0.3, 1e-6);
    EXPECT_NEAR(v[1], 2 * c * 0.3, 1e-6);
}

TEST(World, what_is_placed_beside_another_touches_it_at_once) {
    World<double> world;
    add_box(world, {2, 2, 2}, {0, 0, 0});
    add_box(world, {2, 2, 2}, {0, 0, 0});
    world.set_contacts(std::array{BodyContact{.first = 0, .second = 1}});
    world.place(1, {.position = {50, 0, 0}});
    const StepParameters step{0.5 * world.critical_time_step()};
    world.step(step, 3);
    EXPECT_EQ(world.contact_readings().at(0).nodes, 0u);
    world.place(1, {.position = {0.01, 1.98 * kEdge, 0.01}, .velocity = {0, -1, 0}});
    world.step(step, 5);
    EXPECT_GT(world.contact_readings().at(0).nodes, 0u);
}

/// Leapfrog's velocities are made whole where something changes between steps; contact goes on with them.
TEST(World, contact_outlives_a_change_of_integrator) {
    std::vector<double> impulses;
    for (const Integrator first : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        World<double> world;
        add_box(world, {4, 4, 4}, {0, 0, 0});
        add_box(world, {4, 4, 4}, {0.02, 4.1 * kEdge, 0.02});
        world.set_contacts(std::array{BodyContact{.first = 0, .second = 1}});
        world.place(1, {.velocity = {0, -1, 0}});
        const double step = 0.3 * world.critical_time_step();
        world.step({.time_step = step, .integrator = first}, 5);
        world.body(0).damp_springs(1e-6);
        world.step({.time_step = step}, 100);
        impulses.push_back(world.contact_readings().at(0).impulse[1]);
        EXPECT_LT(world.contact_readings().at(0).greatest_depth, 0.1 * kEdge);
    }
    EXPECT_NEAR(impulses[1], impulses[0], 0.02 * std::abs(impulses[0]));
}

/// A tie between points of one cell takes account of the nodes that both have.
TEST(World, points_of_one_cell_are_welded_exactly) {
    World<double> world;
    add_box(world, {2, 2, 2}, {0, 0, 0});
    world.attach({{0, {0.3 * kEdge, 0.4 * kEdge, 0.5 * kEdge}}, {0, {0.6 * kEdge, 0.4 * kEdge, 0.5 * kEdge}}});
    world.step({0.3 * world.critical_time_step()}, 1);
    const std::vector<double> u = read(world.body(0), false);
    const auto at = [&](double xi) { // of the first cell
        const std::array<double, 8> weights = trilinear_weights({xi, 0.4, 0.5});
        double x = xi * kEdge;
        for (std::size_t c = 0; c < 8; ++c) {
            x += weights[c] * u[3 * ((c & 1) + 3 * ((c >> 1 & 1) + 3 * (c >> 2)))];
        }
        return x;
    };
    EXPECT_NEAR(at(0.3), at(0.6), 1e-12);
}

/// A bar that is cut in three hangs by a tie: as it moves as one body whose parts have nothing in common, so it moves
/// as three. And they fall on a plate, as it would.
TYPED_TEST(WorldOf, parts_that_were_cut_off_move_on_as_bodies) {
    const Vector origin = {0.01, kEdge, 0.02}, tied = {1.5 * kEdge + 0.01, 2 * kEdge, kEdge / 2 + 0.02};
    for (const double height : {1.0, 0.02}) {
        World<TypeParam> one, several;
        std::vector<Lattice> bars(2, Lattice::box(9, 1, 1, kEdge));
        const auto set_up = [&](World<TypeParam>& world, Lattice& bar) {
            add_box(world, {10, 1, 3}, {0, 0, -kEdge}, kFirm);
            world.add(ExplicitDynamics<TypeParam>(bar, kSoft), bar, origin);
            world.set_contacts(std::array{BodyContact{.first = 0, .second = 1, .friction = 0.3}, BodyContact{1, 1}});
            world.attach({{1, tied}, {{}, {tied[0], tied[1] + height, tied[2]}}, 1e4});
            world.place(1, {.position = {0, height, 0}, .velocity = {0, -0.3, 0}, .angular_velocity = {0.1, 0, 0.2}});
            world.step({0.3 * world.critical_time_step()}, 10);
            world.remove_cells(1, bar, std::array<std::uint32_t, 2>{2, 6});
        };
        set_up(one, bars[0]);
        set_up(several, bars[1]);
        const auto momentum = [&](World<TypeParam>& world, std::span<const BodyPart> parts) {
            Momentum sum;
            add_momentum(world.body(1), Lattice::box(9, 1, 1, kEdge), origin, sum); // with the masses of now
            for (const BodyPart& part : parts) {
                add_momentum(world.body(part.body), part.lattice, origin, sum);
            }
            return sum;
        };
        const Momentum before = momentum(several, {});
        const auto make = [](const Lattice& part) { return ExplicitDynamics<TypeParam>(part, kSoft); };
        const std::vector<BodyPart> parts = several.split_parts(1, bars[1], make);
        ASSERT_EQ(parts.size(), 2u);
        EXPECT_EQ(several.body_count(), 4u);
        EXPECT_EQ(bars[1].cell_count(), 3u); // those in the middle: cells 3, 4, 5
        EXPECT_EQ(parts[0].lattice.cell_count(), 2u);
        EXPECT_EQ(parts[1].lattice.cell_scale(7, 0, 0), 1);
        EXPECT_EQ(several.contact_readings().size(), 2u + 2 + 2 + 3); // the plate's, each its own, each other
        const double rounding = std::is_same_v<TypeParam, float> ? 1e-6 : 1e-15;
        const Momentum after = momentum(several, parts);
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(after.linear[a], before.linear[a], rounding * mass_of(one.body(1)));
            EXPECT_NEAR(after.angular[a], before.angular[a], rounding * mass_of(one.body(1)));
        }
        EXPECT_TRUE(several.split_parts(1, bars[1], make).empty());
        const StepParameters step{0.3 * one.critical_time_step(), {0, -5, 0}};
        const long steps = height < 0.1 ? 500 : 100;
        one.step(step, steps);
        several.step(step, steps);
        if (height < 0.1) { // the last part lies on the plate now, the one before hangs
            const BodyContactReading on_plate = several.contact_readings().at(3);
            EXPECT_LT(on_plate.impulse[1], 0);
            EXPECT_LT(on_plate.greatest_depth, 0.2 * kEdge);
            continue;
        }
        const std::vector<double> all = read(one.body(1), false);
        const double close = std::is_same_v<TypeParam, float> ? 1e-5 : 1e-13;
        for (const BodyPart& part : parts) {
            const std::vector<double> u = read(several.body(part.body), false);
            const std::vector<std::uint32_t> nodes = part.lattice.nodes();
            EXPECT_EQ(nodes.size(), 12u);
            for (std::size_t n = 0; n < nodes.size(); ++n) {
                for (std::size_t a = 0; a < 3; ++a) {
                    EXPECT_NEAR(u[3 * n + a], all[3 * nodes[n] + a], close);
                }
            }
        }
        const double pull = one.attachment_force(0)[1];
        EXPECT_GT(std::abs(pull), 1e-3); // the tie went with the first part
        EXPECT_NEAR(several.attachment_force(0)[1], pull, 1e4 * close);
    }
}

TEST(World, attachments_let_go_of_what_is_cut_away) {
    World<double> world;
    Lattice bar = Lattice::box(3, 1, 1, kEdge);
    world.add(ExplicitDynamics<double>(bar, kSoft), bar);
    const Vector inside = {0.5 * kEdge, 0.5 * kEdge, 0.5 * kEdge}, corner = {0, 0, 0};
    const std::size_t held = world.attach({{0, inside}, {{}, inside}, 1000}),
                      gone = world.attach({{0, corner}, {{}, corner}, 1000});
    world.remove_cells(0, bar, std::array<std::uint32_t, 1>{0});
    world.step({0.3 * world.critical_time_step(), {0, -1, 0}, 5}, 3000);
    const double weight = 10 * 0.1 * mass_of(world.body(0));
    EXPECT_NEAR(world.attachment_force(held)[1], weight, 0.02 * weight);
    EXPECT_EQ(world.attachment_force(gone), (Vector{0, 0, 0}));
}

/// What is cut away touches nothing, and what it laid bare does.
TEST(World, cuts_lay_bare_what_touches) {
    World<double> world;
    Lattice block = Lattice::box(4, 4, 4, kEdge);
    world.add(ExplicitDynamics<double>(block, kSoft), block, {-kEdge, -4 * kEdge, -kEdge});
    std::vector<PrescribedNode> held;
    for (std::uint32_t n = 0; n < world.body(0).node_count(); ++n) {
        held.push_back({n, 7, {}, {}});
    }
    world.body(0).prescribe(held);
    add_box(world, {1, 1, 1}, {0.4 * kEdge, 0, 0.6 * kEdge});
    world.set_contacts(std::array{BodyContact{.first = 0, .second = 1}});
    const StepParameters step{0.5 * world.critical_time_step(), {0, -10, 0}, 5};
    world.step(step, 3000);
    EXPECT_NEAR(mean(world.body(1), false)[1], 0, 0.1 * kEdge);
    // A shaft of two cells' depth below it, three wide.
    std::vector<std::uint32_t> cells;
    for (const int j : {2, 3}) {
        for (const int k : {0, 1, 2}) {
            for (const int i : {0, 1, 2}) {
                cells.push_back(static_cast<std::uint32_t>(block.cell_index(i + 1 - 1, j, k)));
            }
        }
    }
    EXPECT_EQ(world.remove_cells(0, block, cells), 18u);
    world.step(step, 6000);
    EXPECT_NEAR(mean(world.body(1), false)[1], -2 * kEdge, 0.1 * kEdge);
    EXPECT_NEAR(world.contact_readings().at(0).force[1], -10 * mass_of(world.body(1)),
                0.01 * 10 * mass_of(world.body(1)));
}

/// Networks touch as lattices do; one that has springs alone by its nodes.
TEST(World, networks_touch_too) {
    World<double> lattices, networks;
    const Lattice lattice = Lattice::box(2, 2, 2, kEdge);
    for (const double height : {0.0, 2.1 * kEdge}) {
        add_box(lattices, {2, 2, 2}, {0.01, height, height});
        Network network = Network::from_lattice(lattice, kSoft);
        for (Vector& x : network.rest_positions) {
            x = {x[0] + 0.01, x[1] + height, x[2] + height / 4};
        }
        networks.add(ExplicitDynamics<double>(network), network);
    }
    for (auto* world : {&lattices, &networks}) {
        world->set_contacts(std::array{BodyContact{.first = 0, .second = 1}});
        world->place(1, {.velocity = {0, -1, 0}});
        world->step({0.3 * world->critical_time_step()}, 200);
    }
    EXPECT_GT(networks.contact_readings().at(0).greatest_depth, 0);
    EXPECT_LT(mean(networks.body(0), true)[1], -0.3);
}

TEST(BodyCells, layers_are_counted_from_each_side) {
    const Lattice lattice = Lattice::box(6, 5, 7, kEdge);
    std::vector<Point> rest;
    for (std::size_t n = 0; n < lattice.grid_node_count(); ++n) {
        rest.push_back(lattice.rest_position(n));
    }
    const BodyCells cells(cell_corners(lattice), rest);
    std::size_t inner = 0;
    for (int k = 0; k < 7; ++k) {
        for (int j = 0; j < 5; ++j) {
            for (int i = 0; i < 6; ++i) {
                const auto cell = static_cast<std::size_t>(i + 6 * (j + 5 * k));
                const std::array<int, 6> expected = {i, 5 - i, j, 4 - j, k, 6 - k};
                EXPECT_TRUE(std::equal(expected.begin(), expected.end(), cells.layers[cell].begin())) << cell;
                inner += *std::min_element(expected.begin(), expected.end()) >= 2;
            }
        }
    }
    EXPECT_EQ(cells.outer.size(), 6u * 5 * 7 - inner);
    EXPECT_EQ(cells.surface.size(), 7u * 6 * 8 - 5u * 4 * 6);
    EXPECT_DOUBLE_EQ(cells.edge, kEdge);
}

TEST(BodyCells, places_are_found_in_bent_cells_and_not_in_inverted_ones) {
    std::array<Point, 8> corners;
    for (std::size_t c = 0; c < 8; ++c) {
        const double x = static_cast<double>(c & 1), y = static_cast<double>(c >> 1 & 1),
                     z = static_cast<double>(c >> 2);
        corners[c] = {x + 0.2 * y * z, 0.8 * y - 0.1 * x, z + 0.15 * x * y};
    }
    for (const Point& xi : {Point{0.1, 0.9, 0.4}, Point{1, 0, 0.5}, Point{-0.05, 0.5, 1.04}}) {
        const std::array<double, 8> weights = trilinear_weights(xi);
        Point x = {0, 0, 0};
        for (std::size_t c = 0; c < 8; ++c) {
            x = plus(x, weights[c], corners[c]);
        }
        const std::optional<PlaceInCell> place = place_in_cell(corners, x);
        ASSERT_TRUE(place);
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(place->xi[a], xi[a], 1e-9);
        }
    }
    for (Point& corner : corners) {
        corner[0] *= -1; // the mirror image
    }
    EXPECT_FALSE(place_in_cell(corners, {-0.5, 0.4, 0.5}));
}

TEST(WorldInput, what_is_not_allowed_is_named) {
    World<double> world;
    add_box(world, {1, 1, 1}, {0, 0, 0});
    const auto said = [](auto&& call) -> std::string {
        try {
            call();
        } catch (const std::exception& e) {
            return e.what();
        }
        return "";
    };
    const auto contact = [&](BodyContact c) { return said([&] { world.set_contacts({&c, 1}); }); };
    EXPECT_EQ(contact({.first = 0, .second = 1}), "contact 0: body 1 is not there: the world has 1");
    EXPECT_EQ(contact({.friction = -1}), "contact 0: friction = -1.000000 is not allowed: it must be finite and >= 0");
    EXPECT_EQ(said([&] {
                  world.set_contacts(std::array{BodyContact{0, 0}, BodyContact{0, 0}});
              }),
              "contact 1: bodies 0 and 0 are named twice");
    EXPECT_EQ(said([&] {
                  world.attach({{0, {9, 0, 0}}, {}});
              }),
              "the point of an attachment, 9.000000 0.000000 0.000000 m, is in no cell and on no node of body 0");
    EXPECT_EQ(said([&] {
                  world.attach({{}, {}});
              }),
              "an attachment between two points in space holds nothing: one must be of a body");
    EXPECT_EQ(said([&] {
                  world.attach({{0, {0, 0, 0}}, {}, 0});
              }),
              "stiffness = 0.000000 of an attachment is not allowed: it must be > 0");
    EXPECT_EQ(said([&] { static_cast<void>(world.body(3)); }), "body 3 is not there: the world has 1");
    EXPECT_EQ(said([&] { world.detach(0); }), "attachment 0 is not there: the world has had 0");
    EXPECT_EQ(said([&] {
                  world.place(0, {.rotation = {2, 0, 0, 0, 1, 0, 0, 0, 1}});
              }),
              "body 0: its rotation must be a matrix of three orthonormal rows, to 1e-5");
    EXPECT_EQ(said([&] { world.step({0.01}, -1); }), "count = -1 is not allowed: it must be at least 0 steps");
    EXPECT_NE(said([&] { world.step({}, 1); }), "");
    Lattice another = Lattice::box(2, 1, 1, kEdge);
    EXPECT_EQ(said([&] {
                  world.split_parts(0, another,
                                    [](const Lattice& part) { return ExplicitDynamics<double>(part, kSoft); });
              }),
              "the lattice is not the one of body 0 as it is now");
    const Lattice other = Lattice::box(2, 1, 1, kEdge);
    EXPECT_NE(said([&] { world.add(ExplicitDynamics<double>(other, kSoft), Lattice::box(1, 1, 1, kEdge)); }), "");
    EXPECT_EQ(world.body_count(), 1u);
    Lattice cube = Lattice::box(1, 1, 1, kEdge);
    world.body(0).remove_cells(cube, std::array<std::uint32_t, 1>{0});
    EXPECT_EQ(said([&] { world.step({0.01}, 1); }), "cells of body 0 were removed through the body itself: in a world "
                                                    "its own remove_cells() does that");
}

} // namespace
} // namespace hybmss
