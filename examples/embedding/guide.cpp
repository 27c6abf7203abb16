// The pieces of code that docs/embedding.md, memory.md, motion.md and records.md show, in one program that runs as a
// test.

#include "hybmss/allocator.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/force_plan.hpp"
#include "hybmss/hybmss.h"
#include "hybmss/record.hpp"
#include "hybmss/task_runner.hpp"
#include "hybmss/version.hpp"
#include "hybmss/world.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace hybmss;

void check(bool good, const char* what) {
    if (!good) {
        throw std::runtime_error(what);
    }
}

void ownership() {
    // [ownership]
    std::vector<float> u, f;
    std::size_t nodes = 0;
    {
        const Lattice body = Lattice::box(8, 8, 8, 0.1); // needed while the plan is made, not after
        const ForcePlan<float> plan(body, Material{.young_modulus = 2e4, .poisson_ratio = 0.3});
        nodes = plan.node_count();
        u.assign(3 * nodes, 0.0f);
        f.assign(3 * nodes, 0.0f);
        plan.add_forces(VectorField<const float>::aos(u.data(), nodes), VectorField<float>::aos(f.data(), nodes));
    } // the plan frees what it held; u and f stay yours, and it has kept no pointer to them
    // [/ownership]
    check(f[0] == 0.0f, "no force at rest");
}

void layouts() {
    // [layouts]
    struct Particle { // an engine's own: 32 bytes, positions and forces side by side
        float displacement[3];
        float force[3];
        float mass;
        int flags;
    };
    const ForcePlan<float> plan(Lattice::box(4, 4, 4, 0.1), Material{});
    std::vector<Particle> particles(plan.node_count());
    particles[62].displacement[1] = 0.01f;

    constexpr std::ptrdiff_t kStride = sizeof(Particle) / sizeof(float); // in components
    const VectorField<const float> displacement =
        VectorField<const float>::aos(particles[0].displacement, particles.size(), kStride);
    const VectorField<float> force = VectorField<float>::aos(particles[0].force, particles.size(), kStride);
    plan.add_forces(displacement, force);
    // [/layouts]
    check(particles[62].force[1] < 0, "the node is pulled back");
}

void maps() {
    hybmss_body* body = nullptr;
    hybmss_plan* plan = nullptr;
    const std::int32_t cells[3] = {2, 2, 2};
    const hybmss_material material = hybmss_default_material();
    check(hybmss_lattice_create(cells, 0.1, nullptr, 0, &material, &body) == HYBMSS_OK, hybmss_last_error());
    check(hybmss_plan_create(body, HYBMSS_DOUBLE, nullptr, &plan) == HYBMSS_OK, hybmss_last_error());
    // [map]
    // Node n of the body is vertex map[n] of a mesh that has more vertices than that.
    std::vector<double> vertices(3 * 100), forces(3 * 100);
    std::vector<std::uint32_t> map;
    for (std::uint32_t node = 0; node < 27; ++node) {
        map.push_back(99 - 2 * node);
    }
    hybmss_const_field displacement = hybmss_const_double_field(vertices.data(), 100, 3);
    hybmss_field force = hybmss_double_field(forces.data(), 100, 3);
    displacement.map = force.map = map.data();
    const hybmss_status status = hybmss_plan_add_forces(plan, &displacement, &force);
    // [/map]
    check(status == HYBMSS_OK, hybmss_last_error());
    hybmss_plan_destroy(plan);
    hybmss_body_destroy(body);
}

// [runner]
struct Job { // stands for what an engine's scheduler knows a task by
    std::thread thread;
};
void* enqueue(void (*task)(void*), void* context, void*) {
    return new Job{std::thread(task, context)};
}
void finish(void* handle, void*) {
    Job* job = static_cast<Job*>(handle);
    job->thread.join();
    delete job;
}

void run_on_own_threads() {
    const TaskRunner runner{.threads = 2, .enqueue = &enqueue, .finish = &finish};
    PlanOptions options;
    options.task_runner = &runner;
    ExplicitDynamics<float> body(Lattice::box(20, 20, 20, 0.1), Material{}, options);
    body.step({.time_step = body.critical_time_step() / 2, .acceleration = {0, -9.81, 0}}, 10);
}
// [/runner]

// [allocator]
void* allocate(std::size_t bytes, std::size_t alignment, void* user) {
    *static_cast<std::size_t*>(user) += bytes;
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
}
void release(void* memory, std::size_t bytes, std::size_t, void* user) {
    *static_cast<std::size_t*>(user) -= bytes;
    std::free(memory);
}
// [/allocator]

void allocators() {
    std::size_t held = 0;
    set_allocator({&allocate, &release, &held});
    {
        const ForcePlan<float> plan(Lattice::box(8, 8, 8, 0.1), Material{});
        check(held > 0, "arrays come from the allocator");
    }
    check(held == 0, "and go back there");
    set_allocator({});
}

void determinism() {
    // [determinism]
    PlanOptions reproducible;
    reproducible.accuracy = Accuracy::exact; // nothing that differs between makes of processor or instruction sets
    // [/determinism]
    std::vector<double> results[2];
    for (const int threads : {1, 2}) {
        reproducible.threads = threads;
        ExplicitDynamics<double> body(Lattice::box(20, 20, 20, 0.1), Material{.poisson_ratio = 0.4}, reproducible);
        body.load(std::vector<NodalLoad>{{0, {1, 2, 3}}});
        body.step({.time_step = body.critical_time_step() / 2}, 20);
        std::vector<double>& u = results[threads - 1];
        u.resize(3 * body.node_count());
        body.get_displacements(VectorField<double>::aos(u.data(), body.node_count()));
    }
    check(results[0] == results[1], "the same bits");
}

void precision() {
    // [precision]
    const ForcePlan<float> plan(Lattice::box(4, 4, 4, 0.1), Material{});
    std::vector<double> position(3 * plan.node_count()), rest(position.size()); // an engine's world coordinates
    std::vector<float> u(position.size());
    for (std::size_t i = 0; i < u.size(); ++i) {
        u[i] = static_cast<float>(position[i] - rest[i]); // subtract in double, then round
    }
    // [/precision]
    check(u[0] == 0.0f, "at rest");
}

void world() {
    // [world]
    const Lattice slab = Lattice::box(10, 3, 10, 0.02), ball = Lattice::box(4, 4, 4, 0.02);
    const Material soft{.young_modulus = 1e5, .poisson_ratio = 0.45};
    World<float> world;
    const std::size_t low = world.add(ExplicitDynamics<float>(slab, soft), slab),
                      high = world.add(ExplicitDynamics<float>(ball, soft), ball, {0.06, 0.07, 0.06});
    world.set_contacts(std::array{BodyContact{.first = low, .second = high, .friction = 0.5},
                                  BodyContact{.first = high, .second = high}}); // it may fold onto itself
    world.body(low).set_obstacles(surface_nodes(slab), std::array{Obstacle{.shape = PlaneShape{}, .friction = 0.5}});

    // A pointer takes the middle of its top, and pulls it up by a spring: stable however stiff it is.
    const std::array<double, 3> top = {0.1, 0.15, 0.1};
    const std::size_t pointer = world.attach({.from = {high, top}, .to = {{}, top}, .stiffness = 500});
    const double step = 0.7 * world.critical_time_step();
    const long steps = 1 + static_cast<long>(1.0 / 60 / step);
    for (int frame = 0; frame < 60; ++frame) {
        world.move_anchor(pointer, {top[0], top[1] + 0.002 * frame, top[2]});
        world.step({.time_step = 1.0 / 60 / static_cast<double>(steps), .acceleration = {0, -9.81, 0}}, steps);
    }
    const std::array<double, 3> pull = world.attachment_force(pointer); // N, for a haptic device
    world.detach(pointer);                                              // and it falls
    world.step({.time_step = step, .acceleration = {0, -9.81, 0}, .mass_damping = 2}, 3000);
    const BodyContactReading touch = world.contact_readings()[0]; // forces now, depths, the impulse so far
    // [/world]
    check(pull[1] > 2 && touch.nodes > 0 && world.body(high).finite(), "the cube is lifted, and falls onto the slab");
}

void obstacles() {
    // [obstacles]
    const Lattice lattice = Lattice::box(8, 8, 8, 0.1);
    ExplicitDynamics<float> body(lattice, Material{.young_modulus = 1e5});
    const std::array obstacles = {
        Obstacle{.shape = PlaneShape{.normal = {0, 1, 0}}, .friction = 0.5},
        Obstacle{.shape = SphereShape{.radius = 0.3}, .pose = {.position = {0.4, 1.15, 0.4}}},
    };
    body.set_obstacles(surface_nodes(lattice), obstacles); // once: it lets go what friction holds

    const double frame = 1.0 / 60;
    // Obstacles do not shorten it.
    const int steps = 1 + static_cast<int>(frame / (0.7 * body.critical_time_step()));
    std::array poses = {obstacles[0].pose, obstacles[1].pose};
    poses[1].velocity = {0, -0.2, 0};
    const double ball_mass = 2000;           // the engine's own ball, in kg
    std::array<double, 3> given = {0, 0, 0}; // N s, by the ball to the body so far
    for (int i = 0; i < 60; ++i) {
        body.move_obstacles(poses); // where they are when the frame begins; within it each goes on by its velocities
        body.step({.time_step = frame / steps, .acceleration = {0, -9.81, 0}, .mass_damping = 2}, steps);
        const std::array<double, 3> impulse = body.obstacle_readings()[1].impulse; // since it was set
        for (std::size_t a = 0; a < 3; ++a) {
            poses[1].position[a] += frame * poses[1].velocity[a]; // as it went within the frame; then the blow
            poses[1].velocity[a] -= (impulse[a] - given[a]) / ball_mass;
        }
        given = impulse;
    }
    const ObstacleReading sphere = body.obstacle_readings()[1]; // forces on the body now, nodes that touch, depths
    // [/obstacles]
    check(sphere.nodes > 0 && given[1] < 0 && poses[1].velocity[1] > -0.2, "the ball is slowed down by the cube");
}

void pressure() {
    // [pressure]
    const Lattice lattice = Lattice::box(8, 8, 8, 0.1);
    ExplicitDynamics<float> body(lattice, Material{.young_modulus = 1e5});
    const std::vector<SurfaceFace> faces = surface_faces(lattice); // of the whole surface; or those of them you choose
    std::vector<double> pressures(faces.size(), 0);                // Pa, one a face
    body.press(faces, pressures);
    for (int i = 0; i < 200; ++i) {
        pressures.assign(faces.size(), 20.0 * i);
        body.set_pressures(pressures);
        body.step({.time_step = 0.7 * body.critical_time_step(), .mass_damping = 50}, 10);
    }
    const EffectEnergy energy = body.effect_energies()[0]; // what the body has done against it, J
    // [/pressure]
    check(energy.stored < 0 && body.finite(), "the block is squeezed");
}

// [record]
bool agrees_with(const Record& record) {
    const ForcePlan<float> plan(record.lattice, record.material); // here stands what you check: your own integration
    for (std::size_t state = 0; state < record.states.size(); ++state) {
        std::vector<float> u, f(3 * plan.node_count());
        for (const auto& [x, y, z] : record.states[state].displacements) {
            u.insert(u.end(), {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
        }
        plan.add_forces(VectorField<const float>::aos(u.data(), plan.node_count()),
                        VectorField<float>::aos(f.data(), plan.node_count()));
        const VectorField<const float> found = VectorField<const float>::aos(f.data(), plan.node_count());
        if (!compare_forces(record, state, found).within()) {
            return false;
        }
    }
    return true;
}
// [/record]

void records() {
    Record record;
    record.lattice = Lattice::box(2, 2, 2, 0.1);
    RecordedState rest;
    rest.displacements.assign(27, {0, 0, 0});
    rest.forces = rest.displacements;
    record.states = {rest};
    check(agrees_with(record), "at rest there are no forces");
    record.states[0].forces[5][1] = 1e-3;
    check(!agrees_with(record), "a wrong force is found");
}

void versions() {
    // [version]
    const std::string built_with = std::to_string(HYBMSS_VERSION_MAJOR) + "." + std::to_string(HYBMSS_VERSION_MINOR);
    const bool same_interface = std::string(hybmss_version()).starts_with(built_with + "."); // before 1.0
    // [/version]
    check(same_interface, "the library is of the headers' version");
}

} // namespace

int main() {
    try {
        ownership();
        layouts();
        maps();
        run_on_own_threads();
        allocators();
        determinism();
        precision();
        obstacles();
        pressure();
        world();
        records();
        versions();
    } catch (const std::exception& error) {
        std::fprintf(stderr, "guide: %s\n", error.what());
        return 1;
    }
    std::puts("the guide's code does what it says");
    return 0;
}
