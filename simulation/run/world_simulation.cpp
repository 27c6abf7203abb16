#include "hybmss/simulation/world_simulation.hpp"

#include "layouts/messages.hpp"
#include "simulation/run/run_in_time.hpp"
#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>
#include <variant>

namespace hybmss {

struct WorldSimulation::Implementation {
    WorldScene scene;
    std::vector<Simulation> bodies;
    double time_step = 0;
    std::variant<World<float>, World<double>> world;
    std::vector<NamedContactReading> touching;  ///< without readings, in the world's order
    std::vector<std::vector<std::size_t>> ties; ///< of each attachment, the world's numbers
    std::vector<std::vector<Vector3>> before;   ///< m/s, of each body before the last step; where that is looked at
    bool broken = false;                        ///< the bodies have been made anew, and the world does not know
    long steps = 0, outputs = 0, written = -1;  // of the run at hand
    bool continued = false;

    Implementation(WorldScene given, const SimulationOptions& options);

    std::size_t find(const std::string& name) const {
        const auto found = std::find_if(scene.bodies.begin(), scene.bodies.end(),
                                        [&](const NamedScene& body) { return body.name == name; });
        return static_cast<std::size_t>(found - scene.bodies.begin());
    }
    Simulation::Implementation& inside(std::size_t body) const { return *bodies[body].implementation_; }
    const Scene& settings() const { return scene.bodies[0].scene; }
    SceneError error(const std::string& path, const std::string& reason) const {
        Scene shared;
        shared.source = scene.source;
        return scene_error(shared, path, reason);
    }
    double critical_time_step() const {
        return std::visit([](const auto& w) { return w.critical_time_step(); }, world);
    }

    void make_bodies(const SimulationOptions& options);
    void set_contacts();
    void share_obstacles();
    void attach(std::size_t attachment);
    std::vector<AttachmentReading> read_attachments() const;

    // What run_in_time() asks for.
    double time() const { return inside(0).time(); }
    long steps_between_checks() const { return inside(0).steps_between_checks(); }
    bool changing() const;
    std::string step(long count);
    std::vector<Energies> energies() const;
    static Energies total(const std::vector<Energies>& energies);
    std::string blow_up(const std::vector<Energies>& energies) const;
    Settlement settlement_of(std::size_t body, const Energies& energies) const;
    Settlement settlement(const std::vector<Energies>& energies) const;
    std::vector<Simulation::Implementation::State> present() const;
    void restore(const std::vector<Simulation::Implementation::State>& states);
};

WorldSimulation::Implementation::Implementation(WorldScene given, const SimulationOptions& options)
    : scene(within_ranges(std::move(given))) {
    make_bodies(options);
    if (options.precision == Precision::float32) {
        world.emplace<World<float>>(options.plan.threads);
    } else {
        world.emplace<World<double>>(options.plan.threads);
    }
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        std::visit(
            [&]<class T>(World<T>& w) {
                w.add(&std::get<ExplicitDynamics<T>>(inside(b).dynamics), inside(b).lattice,
                      inside(b).scene.body.origin);
            },
            world);
        inside(b).remove_from_dynamics = [this, b](Lattice& lattice, std::span<const std::uint32_t> cells) {
            std::visit([&](auto& w) { w.remove_cells(b, lattice, cells); }, world);
        };
    }
    set_contacts();
    share_obstacles();
    for (std::size_t a = 0; a < scene.attachments.size(); ++a) {
        attach(a);
    }
}

/// All by the step of the one that takes the shortest.
void WorldSimulation::Implementation::make_bodies(const SimulationOptions& options) {
    time_step = std::numeric_limits<double>::infinity();
    for (const NamedScene& body : scene.bodies) {
        bodies.emplace_back(body.scene, options);
        time_step = std::min(time_step, bodies.back().time_step());
    }
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (bodies[b].time_step() != time_step) {
            Scene faster = scene.bodies[b].scene;
            faster.solver.time_step = time_step;
            bodies[b] = Simulation(std::move(faster), options);
        }
    }
}

void WorldSimulation::Implementation::set_contacts() {
    std::vector<BodyContact> pairs;
    std::set<std::pair<std::size_t, std::size_t>> named;
    for (std::size_t c = 0; c < scene.contacts.size(); ++c) {
        const SceneContact& contact = scene.contacts[c];
        for (std::size_t i = 0; i < contact.between.size(); ++i) {
            for (std::size_t j = contact.self ? i : i + 1; j < contact.between.size(); ++j) {
                const std::size_t first = find(contact.between[i]), second = find(contact.between[j]);
                if (!named.insert(std::minmax(first, second)).second) {
                    throw error("contact[" + std::to_string(c) + "].between", "another [[contact]] tells already how " +
                                                                                  contact.between[i] + " and " +
                                                                                  contact.between[j] + " touch");
                }
                pairs.push_back(
                    {.first = first, .second = second, .friction = contact.friction, .stiffness = contact.stiffness});
                touching.push_back({contact.between[i], contact.between[j], {}});
            }
        }
    }
    std::visit([&](auto& w) { w.set_contacts(pairs); }, world);
}

void WorldSimulation::Implementation::share_obstacles() {
    std::vector<SharedObstacle> shared;
    std::vector<std::string> names;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const std::vector<SceneObstacle>& obstacles = scene.bodies[b].scene.obstacles;
        for (std::size_t o = 0; o < obstacles.size(); ++o) {
            if (obstacles[o].mass > 0) {
                const auto found = std::find(names.begin(), names.end(), obstacles[o].name);
                shared.push_back({b, o, static_cast<std::size_t>(found - names.begin())});
                if (found == names.end()) {
                    names.push_back(obstacles[o].name);
                }
            }
        }
    }
    std::erase_if(shared, [all = shared](const SharedObstacle& one) {
        return std::count_if(all.begin(), all.end(), [&](const auto& other) { return other.one == one.one; }) == 1;
    });
    std::visit([&](auto& w) { w.set_shared_obstacles(shared); }, world);
}

void WorldSimulation::Implementation::attach(std::size_t attachment) {
    const SceneAttachment& given = scene.attachments[attachment];
    const std::string path = "attach[" + std::to_string(attachment) + "].";
    const std::size_t from = find(given.from.body), to = find(given.to.body);
    const Simulation::Implementation& body = inside(from);
    const std::vector<std::uint32_t> nodes = select_nodes(body.rest, body.scene.body.cell_size, given.from.where);
    if (nodes.empty()) {
        throw error(path + "from.where", "no node of " + given.from.body + " lies in it");
    }
    const std::vector<Vector3> begin = positions(body.rest, body.turned);
    std::vector<std::size_t>& numbers = ties.emplace_back();
    for (const std::uint32_t n : nodes) {
        Attachment tie;
        tie.stiffness = given.stiffness / static_cast<double>(nodes.size());
        tie.from = {from, body.rest[n]};
        tie.to.point = given.to.point.value_or(begin[n]);
        if (to < bodies.size()) {
            tie.to = {to, at_rest(inside(to).scene.body, begin[n])};
        }
        try {
            numbers.push_back(std::visit([&](auto& w) { return w.attach(tie); }, world));
        } catch (const std::invalid_argument&) {
            throw error(path + "to.body",
                        printed("node %u of %s begins at (%g, %g, %g) m, where %s has no cell", n,
                                given.from.body.c_str(), begin[n][0], begin[n][1], begin[n][2], given.to.body.c_str()));
        }
    }
}

std::vector<AttachmentReading> WorldSimulation::Implementation::read_attachments() const {
    std::vector<AttachmentReading> readings;
    for (std::size_t a = 0; a < ties.size(); ++a) {
        AttachmentReading& reading = readings.emplace_back();
        reading.from = scene.attachments[a].from.body;
        reading.to = scene.attachments[a].to.body;
        for (const std::size_t tie : ties[a]) {
            const Vector3 force = std::visit([&](const auto& w) { return w.attachment_force(tie); }, world);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                reading.force[axis] += force[axis];
            }
            reading.ties += std::visit([&](const auto& w) { return w.attached(tie); }, world);
        }
    }
    return readings;
}

bool WorldSimulation::Implementation::changing() const {
    return std::any_of(bodies.begin(), bodies.end(), [](const auto& body) { return body.implementation_->changing(); });
}

std::string WorldSimulation::Implementation::step(long count) {
    if (broken) {
        return "the world has diverged before";
    }
    const bool watched = settings().solver.tolerance.has_value();
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        inside(b).cut_now();
    }
    for (const long end = steps + count; steps < end;) {
        const bool last = watched && steps + 1 == end;
        long taken = watched && !last ? end - 1 - steps : end - steps;
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            taken = std::min(taken, inside(b).stretch(end));
        }
        before.clear();
        std::vector<StepMotion> motions;
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            if (last) {
                before.push_back(bodies[b].velocities());
            }
            motions.push_back(inside(b).begin_stretch());
        }
        std::visit([&](auto& w) { w.step(inside(0).step_parameters(), taken, motions); }, world);
        steps += taken;
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            inside(b).end_stretch(taken);
        }
    }
    return "";
}

std::vector<Energies> WorldSimulation::Implementation::energies() const {
    std::vector<Energies> all;
    for (const Simulation& body : bodies) {
        all.push_back(body.energies());
    }
    return all;
}

Energies WorldSimulation::Implementation::total(const std::vector<Energies>& energies) {
    Energies sum;
    for (const Energies& one : energies) {
        sum.springs += one.springs;
        sum.volume += one.volume;
        sum.kinetic += one.kinetic;
        sum.removed += one.removed;
        sum.external += one.external;
        sum.effects.insert(sum.effects.end(), one.effects.begin(), one.effects.end());
    }
    return sum;
}

std::string WorldSimulation::Implementation::blow_up(const std::vector<Energies>& energies) const {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (const std::string failure = inside(b).blow_up(energies[b]); !failure.empty()) {
            return "body " + scene.bodies[b].name + " " + failure;
        }
    }
    return "";
}

Settlement WorldSimulation::Implementation::settlement_of(std::size_t b, const Energies& energies) const {
    const Simulation::Implementation& body = inside(b);
    Settlement s = body.settlement(energies);
    if (before.empty()) {
        s.settled = false;
        return s;
    }
    const std::vector<Vector3> forces = forces_of(body.dynamics), now = velocities_of(body.dynamics);
    const std::span<const double> masses = body.masses();
    const double E = body.scene.material.young_modulus, h = body.lattice.cell_size();
    double unbalanced = 0, scale = 1e-9 * E * h * h;
    const std::span<const PrescribedNode> held = body.supports.present();
    std::size_t next = 0;
    for (std::size_t n = 0; n < now.size(); ++n) {
        const bool is_held = next < held.size() && held[next].node == n;
        const unsigned axes = is_held ? held[next].axes : 0u;
        next += is_held;
        for (std::size_t a = 0; a < 3; ++a) {
            scale = std::max({scale, std::abs(forces[n][a]), masses[n] * std::abs(body.gravity[a])});
            if (!(axes >> a & 1)) {
                unbalanced = std::max(unbalanced, masses[n] * std::abs(now[n][a] - before[b][n][a]) / time_step);
            }
        }
    }
    const double tolerance = settings().solver.tolerance.value_or(0);
    s.residual = unbalanced / scale;
    s.settled = !changing() && s.residual <= tolerance && s.kinetic_ratio <= tolerance;
    return s;
}

Settlement WorldSimulation::Implementation::settlement(const std::vector<Energies>& energies) const {
    Settlement worst;
    worst.settled = true;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const Settlement s = settlement_of(b, energies[b]);
        worst.residual = std::max(worst.residual, s.residual);
        worst.kinetic_ratio = std::max(worst.kinetic_ratio, s.kinetic_ratio);
        worst.settled = worst.settled && s.settled;
    }
    return worst;
}

std::vector<Simulation::Implementation::State> WorldSimulation::Implementation::present() const {
    std::vector<Simulation::Implementation::State> states;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        states.push_back(inside(b).present());
    }
    return states;
}

void WorldSimulation::Implementation::restore(const std::vector<Simulation::Implementation::State>& states) {
    broken = true;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        inside(b).remove_from_dynamics = nullptr;
        inside(b).restore(states[b]);
    }
    steps = states[0].steps;
    before.clear();
}

WorldSimulation::WorldSimulation(WorldScene scene, const SimulationOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(scene), options)) {}
WorldSimulation::WorldSimulation(WorldSimulation&&) noexcept = default;
WorldSimulation& WorldSimulation::operator=(WorldSimulation&&) noexcept = default;
WorldSimulation::~WorldSimulation() = default;

const WorldScene& WorldSimulation::scene() const {
    return implementation_->scene;
}
std::size_t WorldSimulation::body_count() const {
    return implementation_->bodies.size();
}
const std::string& WorldSimulation::name(std::size_t body) const {
    return implementation_->scene.bodies.at(body).name;
}
const Simulation& WorldSimulation::body(std::size_t body) const {
    return implementation_->bodies.at(body);
}
long WorldSimulation::steps() const {
    return implementation_->steps;
}
double WorldSimulation::time() const {
    return implementation_->time();
}
double WorldSimulation::time_step() const {
    return implementation_->time_step;
}
double WorldSimulation::critical_time_step() const {
    return implementation_->critical_time_step();
}

void WorldSimulation::step(long count) {
    Implementation& world = *implementation_;
    const long end = world.steps + count, between = world.steps_between_checks();
    while (world.steps < end) {
        const long check = (world.steps / between + 1) * between;
        std::string failure = world.step(std::min(end, check) - world.steps);
        if (failure.empty() && world.steps == check) {
            failure = world.blow_up(world.energies());
        }
        if (!failure.empty()) {
            throw std::runtime_error(failure);
        }
    }
}

WorldSummary WorldSimulation::run(const RunCallbacks& callbacks) {
    const auto elapsed = [start = std::chrono::steady_clock::now()] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    Implementation& world = *implementation_;
    WorldSummary summary;
    summary.failure = run_in_time(world, world.settings(), callbacks, elapsed, summary.interrupted);
    summary.settlement = world.settlement(world.energies());
    summary.converged = summary.settlement.settled && summary.failure.empty();
    if (world.settings().solver.tolerance && !summary.converged && summary.failure.empty()) {
        summary.failure =
            printed("not settled after duration = %.6g s: residual %.3g, kinetic ratio %.3g, tolerance %.3g",
                    world.settings().solver.duration, summary.settlement.residual, summary.settlement.kinetic_ratio,
                    *world.settings().solver.tolerance);
    }
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
        Summary& body = summary.bodies.emplace_back(world.inside(b).summary(""));
        body.settlement = world.settlement_of(b, body.energies);
        body.converged = summary.converged;
        body.failure = summary.failure;
        body.interrupted = summary.interrupted;
        body.volume = world.bodies[b].volume_change();
        body.plan = world.bodies[b].describe();
        body.wall_seconds = elapsed();
    }
    summary.contacts = contacts();
    summary.attachments = attachments();
    summary.steps = world.steps;
    summary.time = time();
    summary.time_step = time_step();
    summary.critical_time_step = critical_time_step();
    summary.wall_seconds = elapsed();
    return summary;
}

std::size_t WorldSimulation::attach(const Attachment& attachment) {
    return std::visit([&](auto& w) { return w.attach(attachment); }, implementation_->world);
}
void WorldSimulation::move_anchor(std::size_t attachment, const std::array<double, 3>& point) {
    std::visit([&](auto& w) { w.move_anchor(attachment, point); }, implementation_->world);
}
void WorldSimulation::detach(std::size_t attachment) {
    std::visit([&](auto& w) { w.detach(attachment); }, implementation_->world);
}

std::vector<NamedContactReading> WorldSimulation::contacts() const {
    std::vector<NamedContactReading> named = implementation_->touching;
    const std::vector<BodyContactReading> readings =
        std::visit([](const auto& w) { return w.contact_readings(); }, implementation_->world);
    for (std::size_t c = 0; c < named.size(); ++c) {
        named[c].reading = readings[c];
    }
    return named;
}
std::vector<AttachmentReading> WorldSimulation::attachments() const {
    return implementation_->read_attachments();
}

} // namespace hybmss
