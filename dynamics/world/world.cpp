#include "hybmss/world.hpp"

#include "dynamics/contact/contact.hpp"
#include "dynamics/explicit_dynamics_implementation.hpp"
#include "dynamics/shared_out.hpp"
#include "dynamics/world/body_contact.hpp"
#include "plan/bodies/step_factors.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss {
namespace {

[[noreturn]] void refuse(const std::string& what) {
    throw std::invalid_argument(what);
}

bool finite(const Point& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

std::vector<std::array<std::uint32_t, 8>> cells_of(const Network& network) {
    std::vector<std::array<std::uint32_t, 8>> cells;
    cells.reserve(network.cells.size());
    for (const Network::Cell& cell : network.cells) {
        std::array<std::uint32_t, 8>& corners = cells.emplace_back();
        for (std::size_t c = 0; c < 8; ++c) {
            corners[c] = static_cast<std::uint32_t>(cell.nodes[c]);
        }
    }
    return cells;
}

/// Steps at most from one look at where the bodies are to the next.
constexpr long kWorldStepsBetweenLooks = 16;
/// Steps from one look to the next, unless bodies are too fast.
constexpr double kFewSteps = 4;
/// What speeds may grow by until the next look.
constexpr double kGrowth = 1.5;

} // namespace

template <class T>
struct World<T>::Implementation {
    struct Body {
        std::optional<ExplicitDynamics<T>> own = {}; ///< none: its owner has it
        ExplicitDynamics<T>* lent = nullptr;         ///< then
        std::unique_ptr<WorldBody<T>> nodes = {};    ///< pairs and attachments know where it is
        std::optional<NodeNumbers> numbers = {};     ///< of a lattice
        long steps = -1, settings = -1, holds = -1;  ///< of the body, when it was looked at last
        long cuts = 0;                               ///< of the body, that the world knows of

        ExplicitDynamics<T>& dynamics() { return own ? *own : *lent; }
        const ExplicitDynamics<T>& dynamics() const { return own ? *own : *lent; }
    };
    struct Tie {
        Attachment given;
        BodyPoint<T> from, to;
        Point force = {0, 0, 0};
        bool there = true;
    };

    SharedOut threads;
    std::deque<Body> bodies;                         ///< where they are added they stay
    std::vector<std::vector<SharedObstacle>> shared; ///< each one in its bodies, in the order in which they were told
    std::vector<PairContact<T>> pairs;
    std::vector<std::vector<std::size_t>> colours; ///< pairs that are near, in lists in which no body comes twice
    std::vector<Tie> ties;
    std::size_t tied = 0;   ///< ties that are there
    long until_look = 0;    ///< steps of this length:
    double step_length = 0; ///< s
    long since_look = 0;    ///< steps of this length
    double before = 0;      ///< s since the last look, in steps of another length

    explicit Implementation(int count) : threads(count) {}

    /// s; the same however the steps were called for.
    double since() const { return before + static_cast<double>(since_look) * step_length; }

    typename ExplicitDynamics<T>::Implementation& inside(std::size_t body) const {
        return *bodies[body].dynamics().implementation_;
    }
    void require(std::size_t body) const {
        if (body >= bodies.size()) {
            throw std::out_of_range("body " + std::to_string(body) + " is not there: the world has " +
                                    std::to_string(bodies.size()));
        }
    }

    std::size_t add(Body given, std::vector<Point> rest, std::vector<std::array<std::uint32_t, 8>> cells) {
        auto nodes = std::make_unique<WorldBody<T>>();
        nodes->rest.swap(rest);
        nodes->cells = BodyCells(std::move(cells), nodes->rest);
        given.nodes = std::move(nodes);
        bodies.push_back(std::move(given));
        const std::size_t body = bodies.size() - 1;
        auto& i = inside(body);
        i.watched = true;
        bodies[body].cuts = i.cuts;
        WorldBody<T>& added = *bodies[body].nodes;
        added.length_unit = i.body->length_unit();
        for (std::size_t a = 0; a < 3; ++a) {
            added.displacement[a] = component(i.state.displacement, a);
            added.velocity[a] = component(i.state.velocity, a);
        }
        added.index.resize(added.rest.size());
        for (std::size_t n = 0; n < added.rest.size(); ++n) {
            added.index[n] = static_cast<std::uint32_t>(i.body->index_of(n));
        }
        weigh(body);
        return body;
    }
    std::size_t add(Body given, const Lattice& lattice, const Point& origin);
    void weigh(std::size_t body) {
        WorldBody<T>& nodes = *bodies[body].nodes;
        nodes.inverse_mass.clear();
        for (const double mass : inside(body).body->masses()) {
            nodes.inverse_mass.push_back(mass > 0 ? 1 / mass : 0);
        }
        nodes.weigh_gathered();
    }
    /// visit(pair) of all that the body is part of.
    template <class Visit>
    void disturb(std::size_t body, const Visit& visit) {
        for (PairContact<T>& pair : pairs) {
            if (pair.spec().first == body || pair.spec().second == body) {
                visit(pair);
            }
        }
        until_look = 0;
    }
    /// What has been done to bodies from outside since the last step.
    void take_notice() {
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            const auto& i = inside(b);
            Body& body = bodies[b];
            if (body.holds != i.holds) {
                std::vector<std::uint8_t>& held = body.nodes->held;
                held.assign(i.prescribed.empty() ? 0 : body.nodes->rest.size(), 0);
                for (const PrescribedComponent<T>& p : i.prescribed) {
                    held[p.node] |= static_cast<std::uint8_t>(1 << p.axis);
                }
                body.nodes->weigh_gathered();
            }
            if (body.settings != i.settings) {
                disturb(b, [](PairContact<T>& pair) { pair.forget(); });
            } else if (body.holds != i.holds || body.steps != i.steps) {
                disturb(b, [](PairContact<T>& pair) { pair.look_again(); });
            }
        }
    }

    Contact<T>& contact_of(const SharedObstacle& one) const;
    void require_same(std::span<const SharedObstacle> one) const;
    void share(bool shared_now) const;
    /// All that are shared, each after its bodies' own steps.
    void step_shared(const StepFactors& factors);
    BodyPoint<T> point_of(const Anchor& anchor) const;
    void look(double time_step);
    /// `motions`: none, or one a body; `done`: steps of the call so far.
    void step_bodies(const StepParameters& parameters, long count, std::span<const StepMotion> motions, long done);
    void touch(double time_step, double gain);
    void pull(Tie& tie, double time_step, double gain) const;
};

/// The node at the anchor's point, or the corners of the cell that it is in.
template <class T>
BodyPoint<T> World<T>::Implementation::point_of(const Anchor& anchor) const {
    BodyPoint<T> out;
    if (!finite(anchor.point)) {
        refuse("the point of an attachment is not finite");
    }
    if (!anchor.body) {
        return out;
    }
    if (*anchor.body >= bodies.size()) {
        refuse("body " + std::to_string(*anchor.body) + " of an attachment is not there: the world has " +
               std::to_string(bodies.size()));
    }
    WorldBody<T>& body = *bodies[*anchor.body].nodes;
    out.body = &body;
    const double tolerance = 1e-6;
    for (std::uint32_t n = 0; n < body.rest.size(); ++n) {
        if (body.inverse_mass[n] > 0 && length(plus(body.rest[n], -1, anchor.point)) <= tolerance * body.length_unit) {
            out.nodes[0] = n;
            out.weights[0] = 1;
            out.count = 1;
            return out;
        }
    }
    for (const auto& cell : body.cells.corners) {
        std::array<Point, 8> corners;
        for (std::size_t c = 0; c < 8; ++c) {
            corners[c] = body.rest[cell[c]];
        }
        Bounds box;
        for (const Point& corner : corners) {
            box.include(corner);
        }
        if (!box.grown(tolerance * body.length_unit).holds(anchor.point)) {
            continue;
        }
        const std::optional<PlaceInCell> place = place_in_cell(corners, anchor.point);
        if (place && *std::min_element(place->xi.begin(), place->xi.end()) >= -tolerance &&
            *std::max_element(place->xi.begin(), place->xi.end()) <= 1 + tolerance) {
            out.nodes = cell;
            out.weights = trilinear_weights(place->xi);
            out.count = 8;
            return out;
        }
    }
    refuse("the point of an attachment, " + std::to_string(anchor.point[0]) + " " + std::to_string(anchor.point[1]) +
           " " + std::to_string(anchor.point[2]) + " m, is in no cell and on no node of body " +
           std::to_string(*anchor.body));
}

/// Throws where it is not there or not free.
template <class T>
Contact<T>& World<T>::Implementation::contact_of(const SharedObstacle& one) const {
    auto* const contact = inside(one.body).template find<Contact<T>>();
    if (!contact || one.obstacle >= contact->obstacles().size() || !(contact->obstacles()[one.obstacle].mass > 0)) {
        refuse("obstacle " + std::to_string(one.obstacle) + " of body " + std::to_string(one.body) +
               " is not there or not free: it cannot be shared");
    }
    return *contact;
}

template <class T>
void World<T>::Implementation::require_same(std::span<const SharedObstacle> one) const {
    const Obstacle& first = contact_of(one[0]).obstacles()[one[0].obstacle];
    for (const SharedObstacle& other : one) {
        const Obstacle& obstacle = contact_of(other).obstacles()[other.obstacle];
        if (obstacle.shape != first.shape || obstacle.mass != first.mass || obstacle.inertia != first.inertia) {
            refuse("obstacle " + std::to_string(other.obstacle) + " of body " + std::to_string(other.body) +
                   " is shared with body " + std::to_string(one[0].body) +
                   ": it must have the same shape, mass and inertia there");
        }
    }
}

template <class T>
void World<T>::Implementation::share(bool shared_now) const {
    for (const auto& one : shared) {
        for (const SharedObstacle& part : one) {
            contact_of(part).share(part.obstacle, shared_now);
            if (shared_now) {
                contact_of(part).set_motion(part.obstacle, contact_of(one[0]).motion(one[0].obstacle));
            }
        }
    }
}

template <class T>
void World<T>::Implementation::step_shared(const StepFactors& factors) {
    std::vector<FreeTouch> touches;
    for (const auto& one : shared) {
        const Contact<T>& first = contact_of(one[0]);
        FreeObstacle free(first.obstacles()[one[0].obstacle], first.motion(one[0].obstacle), factors.time_step,
                          factors.acting, factors.acceleration);
        touches.clear();
        std::vector<std::size_t> ends;
        for (const SharedObstacle& part : one) {
            contact_of(part).find_touches(part.obstacle, free, inside(part.body).state, factors, touches);
            ends.push_back(touches.size());
        }
        free.solve(touches);
        std::size_t begin = 0;
        for (std::size_t p = 0; p < one.size(); ++p) {
            contact_of(one[p]).take_touches(one[p].obstacle, free, std::span(touches).subspan(begin, ends[p] - begin),
                                            inside(one[p].body).state, factors);
            begin = ends[p];
        }
    }
    for (const auto& one : shared) {
        for (const SharedObstacle& part : one) {
            bodies[part.body].nodes->gather(factors.time_step);
        }
    }
}

template <class T>
void World<T>::Implementation::look(double time_step) {
    std::vector<double> approach;
    approach.reserve(pairs.size());
    for (const PairContact<T>& pair : pairs) {
        approach.push_back(pair.approach());
    }
    threads.run(bodies.size(), [&](std::size_t b) { bodies[b].nodes->look(); });
    std::vector<std::size_t> stale;
    std::vector<bool> meets(bodies.size(), false);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        PairContact<T>& pair = pairs[p];
        const double was = since() > 0 ? approach[p] : 0;
        approach[p] = pair.approach();
        pair.spend(kGrowth * since() * std::max(was, approach[p]));
        const double way = kGrowth * time_step * approach[p];
        if (!(pair.reach() > kFewSteps * way)) { // so that not every pair asks for a look of its own
            stale.push_back(p);
            if (!(pair.gap() > pair.margin(way))) {
                meets[pair.spec().first] = meets[pair.spec().second] = true;
            }
        }
    }
    threads.run(bodies.size(), [&](std::size_t b) {
        if (meets[b]) {
            bodies[b].nodes->find_cell_boxes();
        }
    });
    threads.run(stale.size(), [&](std::size_t i) {
        PairContact<T>& pair = pairs[stale[i]];
        pair.find(pair.margin(kGrowth * time_step * approach[stale[i]]));
    });
    until_look = kWorldStepsBetweenLooks;
    colours.clear();
    std::vector<std::vector<bool>> taken; // by colour and body
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        const double way = kGrowth * time_step * approach[p];
        if (way > 0 && std::isfinite(way)) {
            const double steps = std::min(pairs[p].reach() / way, static_cast<double>(kWorldStepsBetweenLooks));
            until_look = std::min(until_look, std::max(1L, static_cast<long>(steps)));
        }
        if (!pairs[p].near()) {
            continue;
        }
        const std::size_t first = pairs[p].spec().first, second = pairs[p].spec().second;
        std::size_t colour = 0;
        while (colour < taken.size() && (taken[colour][first] || taken[colour][second])) {
            ++colour;
        }
        if (colour == taken.size()) {
            taken.emplace_back(bodies.size(), false);
            colours.emplace_back();
        }
        taken[colour][first] = taken[colour][second] = true;
        colours[colour].push_back(p);
    }
    since_look = 0;
    before = 0;
}

/// Each by one thread, or where one of them has most of the work, each by all that its plan chose.
template <class T>
void World<T>::Implementation::step_bodies(const StepParameters& parameters, long count,
                                           std::span<const StepMotion> motions, long done) {
    const auto step_one = [&](std::size_t b) {
        if (motions.empty()) {
            bodies[b].dynamics().step(parameters, count);
            bodies[b].nodes->gather(parameters.time_step);
            return;
        }
        StepMotion later;
        if (motions[b].nodes) {
            later.nodes = [&](long step) { return motions[b].nodes(done + step); };
        }
        if (motions[b].obstacles) {
            later.obstacles = [&](long step) { return motions[b].obstacles(done + step); };
        }
        bodies[b].dynamics().step(parameters, count, later);
        bodies[b].nodes->gather(parameters.time_step);
    };
    std::size_t largest = 0, all = 0;
    for (const Body& body : bodies) {
        largest = std::max(largest, body.nodes->rest.size());
        all += body.nodes->rest.size();
    }
    if (largest * static_cast<std::size_t>(threads.workers().threads()) > 2 * all || bodies.size() == 1) {
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            step_one(b);
        }
    } else {
        threads.run(bodies.size(), step_one);
    }
}

template <class T>
void World<T>::Implementation::touch(double time_step, double gain) {
    const double travels = kGrowth * (since() + time_step);
    for (const std::vector<std::size_t>& colour : colours) {
        threads.run(colour.size(), [&](std::size_t p) {
            PairContact<T>& pair = pairs[colour[p]];
            const double approach = pair.approach();
            pair.step(time_step, gain, travels * approach, kGrowth * time_step * approach);
        });
    }
    if (!colours.empty()) {
        threads.run(bodies.size(), [&](std::size_t b) { bodies[b].nodes->scatter(); });
    }
}

/// The impulse after which the spring's force is that of where the step ends, axis by axis.
template <class T>
void World<T>::Implementation::pull(Tie& tie, double time_step, double gain) const {
    Point from = tie.given.from.point, to = tie.given.to.point, yields = {0, 0, 0};
    if (tie.from.body) {
        from = tie.from.position();
        yields = plus(yields, 1, tie.from.mobility());
    }
    if (tie.to.body) {
        to = tie.to.position();
        yields = plus(yields, 1, tie.to.mobility());
    }
    if (tie.from.body && tie.from.body == tie.to.body) {
        yields = plus(yields, -2, tie.from.mobility_with(tie.to));
    }
    Point impulse = {0, 0, 0};
    for (std::size_t a = 0; a < 3; ++a) {
        const double softness = 1 / (tie.given.stiffness * gain) + time_step * yields[a];
        impulse[a] = softness > 0 ? (to[a] - from[a]) / softness : 0; // both ends are held
    }
    tie.force = plus({}, 1 / gain, impulse);
    if (tie.from.body) {
        tie.from.push(impulse, time_step);
    }
    if (tie.to.body) {
        tie.to.push(plus({}, -1, impulse), time_step);
    }
}

template <class T>
World<T>::World(int threads) : implementation_(std::make_unique<Implementation>(threads)) {}
template <class T>
World<T>::World(World&&) noexcept = default;
template <class T>
World<T>& World<T>::operator=(World&&) noexcept = default;
template <class T>
World<T>::~World() = default;

template <class T>
std::size_t World<T>::Implementation::add(Body given, const Lattice& lattice, const Point& origin) {
    if (!finite(origin)) {
        refuse("the origin of a body is not finite");
    }
    const std::size_t count = given.dynamics().node_count();
    given.numbers.emplace(lattice, count);
    std::vector<Point> rest(count);
    for (std::uint32_t n = 0; n < rest.size(); ++n) {
        rest[n] = plus(lattice.rest_position(given.numbers->grid_node(n)), 1, origin);
    }
    auto corners = cell_corners(lattice, *given.numbers);
    return add(std::move(given), std::move(rest), std::move(corners));
}

template <class T>
std::size_t World<T>::add(ExplicitDynamics<T> body, const Lattice& lattice, const std::array<double, 3>& origin) {
    return implementation_->add({.own = std::move(body)}, lattice, origin);
}
template <class T>
std::size_t World<T>::add(ExplicitDynamics<T>* body, const Lattice& lattice, const std::array<double, 3>& origin) {
    if (body == nullptr) {
        refuse("there is no body to add");
    }
    return implementation_->add({.lent = body}, lattice, origin);
}

template <class T>
std::size_t World<T>::add(ExplicitDynamics<T> body, const Network& network) {
    if (network.rest_positions.size() != body.node_count()) {
        refuse("the network has " + std::to_string(network.rest_positions.size()) + " nodes, the body made from it " +
               std::to_string(body.node_count()));
    }
    return implementation_->add({.own = std::move(body)}, network.rest_positions, cells_of(network));
}

template <class T>
std::size_t World<T>::body_count() const {
    return implementation_->bodies.size();
}
template <class T>
ExplicitDynamics<T>& World<T>::body(std::size_t body) {
    implementation_->require(body);
    return implementation_->bodies[body].dynamics();
}
template <class T>
const ExplicitDynamics<T>& World<T>::body(std::size_t body) const {
    implementation_->require(body);
    return implementation_->bodies[body].dynamics();
}

template <class T>
void World<T>::place(std::size_t body, const RigidPose& pose) {
    implementation_->require(body);
    const RigidPose there = rigid(pose, "body " + std::to_string(body));
    const std::vector<Point>& rest = implementation_->bodies[body].nodes->rest;
    std::vector<T> u, v;
    u.reserve(3 * rest.size());
    v.reserve(3 * rest.size());
    for (const Point& x : rest) {
        const Point arm = to_space(there.rotation, x);
        const Point velocity = plus(there.velocity, 1, cross(there.angular_velocity, arm));
        for (std::size_t a = 0; a < 3; ++a) {
            u.push_back(static_cast<T>(there.position[a] + arm[a] - x[a]));
            v.push_back(static_cast<T>(velocity[a]));
        }
    }
    ExplicitDynamics<T>& dynamics = implementation_->bodies[body].dynamics();
    dynamics.set_displacements(VectorField<const T>::aos(u.data(), rest.size()));
    dynamics.set_velocities(VectorField<const T>::aos(v.data(), rest.size()));
}

template <class T>
std::size_t World<T>::remove_cells(std::size_t body, Lattice& lattice, std::span<const std::uint32_t> cells) {
    Implementation& i = *implementation_;
    i.require(body);
    auto& cut = i.bodies[body];
    const std::size_t removed = cut.dynamics().remove_cells(lattice, cells);
    cut.cuts = i.inside(body).cuts;
    if (removed > 0) {
        cut.nodes->cells = BodyCells(cell_corners(lattice, *cut.numbers), cut.nodes->rest);
        i.weigh(body);
        i.disturb(body, [](PairContact<T>& pair) { pair.forget(); });
        for (std::size_t t = 0; t < i.ties.size(); ++t) {
            if (i.ties[t].there && !(i.ties[t].from.keep_mass() && i.ties[t].to.keep_mass())) {
                detach(t);
            }
        }
    }
    return removed;
}

namespace {

/// Of each cell the number of its part: cells that have a node in common, directly or by others, are of one. Numbered
/// by their first cells; returns how many.
std::size_t find_parts(const BodyCells& cells, std::vector<std::size_t>& part_of) {
    constexpr std::size_t kNoPart = std::numeric_limits<std::size_t>::max();
    part_of.assign(cells.corners.size(), kNoPart);
    std::size_t parts = 0;
    std::vector<std::size_t> found;
    for (std::size_t first = 0; first < part_of.size(); ++first) {
        if (part_of[first] != kNoPart) {
            continue;
        }
        part_of[first] = parts;
        found.assign(1, first);
        while (!found.empty()) {
            const std::size_t cell = found.back();
            found.pop_back();
            for (const std::uint32_t node : cells.corners[cell]) {
                for (std::uint32_t i = cells.first_cell_of[node]; i < cells.first_cell_of[node + 1]; ++i) {
                    if (std::size_t& part = part_of[cells.cells_of[i]]; part == kNoPart) {
                        part = parts;
                        found.push_back(cells.cells_of[i]);
                    }
                }
            }
        }
        ++parts;
    }
    return parts;
}

} // namespace

template <class T>
std::vector<BodyPart> World<T>::split_parts(std::size_t body, Lattice& lattice,
                                            const std::function<ExplicitDynamics<T>(const Lattice&)>& make) {
    Implementation& i = *implementation_;
    i.require(body);
    const std::string whose = "body " + std::to_string(body);
    if (!i.bodies[body].numbers) {
        refuse(whose + " is a network: only bodies of a lattice are split");
    }
    const NodeNumbers& numbers = *i.bodies[body].numbers;
    WorldBody<T>& whole = *i.bodies[body].nodes;
    std::vector<std::uint32_t> cells; // of the lattice, as whole.cells has them
    for (std::size_t c = 0; c < lattice.cell_scales().size(); ++c) {
        if (lattice.cell_scales()[c] > 0) {
            cells.push_back(static_cast<std::uint32_t>(c));
        }
    }
    if (cells.size() != whole.cells.corners.size() ||
        lattice.grid_node_count() <= numbers.grid_node(static_cast<std::uint32_t>(whole.rest.size() - 1)) ||
        cell_corners(lattice, numbers) != whole.cells.corners) {
        refuse("the lattice is not the one of " + whose + " as it is now");
    }
    std::vector<std::size_t> part_of;
    const std::size_t parts = find_parts(whole.cells, part_of);
    std::vector<std::size_t> sizes(parts, 0);
    for (const std::size_t part : part_of) {
        ++sizes[part];
    }
    const auto stays = static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());

    std::vector<ExplicitDynamics<T>> made; // before anything changes
    std::vector<BodyPart> split;
    std::vector<std::uint32_t> lost;
    for (std::size_t part = 0; part < parts; ++part) {
        if (part == stays) {
            continue;
        }
        std::vector<std::array<int, 3>> others;
        for (std::size_t c = 0; c < cells.size(); ++c) {
            if (part_of[c] == part) {
                lost.push_back(cells[c]);
            } else {
                const std::array<int, 3>& n = lattice.cells();
                const int at = static_cast<int>(cells[c]);
                others.push_back({at % n[0], at / n[0] % n[1], at / n[0] / n[1]});
            }
        }
        BodyPart& one = split.emplace_back(BodyPart{i.bodies.size() + split.size(), lattice});
        one.lattice.remove_cells(others);
        made.push_back(make(one.lattice));
        if (made.back().node_count() != one.lattice.nodes().size()) {
            refuse("a body of " + std::to_string(made.back().node_count()) + " nodes was made for a part of " + whose +
                   " that has " + std::to_string(one.lattice.nodes().size()));
        }
    }
    if (split.empty()) {
        return split;
    }
    const ExplicitDynamics<T>& before = i.bodies[body].dynamics();
    std::vector<T> places(3 * before.node_count()), speeds(places.size());
    before.get_displacements(VectorField<T>::aos(places.data(), before.node_count()));
    before.get_velocities(VectorField<T>::aos(speeds.data(), before.node_count()));
    const Point origin = plus(whole.rest[0], -1, lattice.rest_position(numbers.grid_node(0)));
    for (std::size_t p = 0; p < split.size(); ++p) {
        const std::vector<std::uint32_t> nodes = split[p].lattice.nodes();
        std::vector<T> u, v;
        std::vector<std::uint32_t> number(whole.rest.size(), 0), here(whole.rest.size(), 0);
        for (std::uint32_t n = 0; n < nodes.size(); ++n) {
            const std::uint32_t was = numbers.of(nodes[n]);
            number[was] = n;
            here[was] = 1;
            for (std::size_t a = 0; a < 3; ++a) {
                u.push_back(places[3 * was + a]);
                v.push_back(speeds[3 * was + a]);
            }
        }
        made[p].set_displacements(VectorField<const T>::aos(u.data(), nodes.size()));
        made[p].set_velocities(VectorField<const T>::aos(v.data(), nodes.size()));
        const std::size_t added = i.add({.own = std::move(made[p])}, split[p].lattice, origin);
        for (auto& tie : i.ties) {
            for (auto [point, anchor] : {std::pair{&tie.from, &tie.given.from}, std::pair{&tie.to, &tie.given.to}}) {
                if (point->body == &whole && here[point->nodes[0]]) {
                    point->body = i.bodies[added].nodes.get();
                    anchor->body = added;
                    for (std::size_t n = 0; n < point->count; ++n) {
                        point->nodes[n] = number[point->nodes[n]];
                    }
                }
            }
        }
    }
    remove_cells(body, lattice, lost);
    std::vector<BodyContact> as_before;
    for (const PairContact<T>& pair : i.pairs) {
        as_before.push_back(pair.spec());
    }
    const auto touch = [&](BodyContact contact, std::size_t first, std::size_t second) {
        contact.first = first;
        contact.second = second;
        i.pairs.emplace_back(contact, *i.bodies[first].nodes, *i.bodies[second].nodes);
    };
    for (const BodyContact& contact : as_before) {
        const bool first = contact.first == body, second = contact.second == body;
        for (std::size_t p = 0; (first || second) && p < split.size(); ++p) {
            const std::size_t part = split[p].body;
            touch(contact, first ? part : contact.first, second ? part : contact.second);
            for (std::size_t q = 0; first && second && q <= p; ++q) {
                touch(contact, q == 0 ? body : split[q - 1].body, part);
            }
        }
    }
    i.colours.clear();
    i.until_look = 0;
    return split;
}

template <class T>
void World<T>::set_contacts(std::span<const BodyContact> contacts) {
    Implementation& i = *implementation_;
    std::vector<PairContact<T>> pairs;
    std::set<std::pair<std::size_t, std::size_t>> named;
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        BodyContact contact = contacts[c];
        const std::string which = "contact " + std::to_string(c) + ": ";
        for (const std::size_t body : {contact.first, contact.second}) {
            if (body >= i.bodies.size()) {
                refuse(which + "body " + std::to_string(body) + " is not there: the world has " +
                       std::to_string(i.bodies.size()));
            }
        }
        if (!named.insert(std::minmax(contact.first, contact.second)).second) {
            refuse(which + "bodies " + std::to_string(contact.first) + " and " + std::to_string(contact.second) +
                   " are named twice");
        }
        const auto check = [&](const char* what, double value) {
            if (!(std::isfinite(value) && value >= 0)) {
                refuse(which + what + " = " + std::to_string(value) + " is not allowed: it must be finite and >= 0");
            }
        };
        check("friction", contact.friction);
        check("stiffness", contact.stiffness);
        check("friction_delay", contact.friction_delay);
        const double step = std::min(i.inside(contact.first).body->critical_time_step(),
                                     i.inside(contact.second).body->critical_time_step());
        contact.stiffness = contact.stiffness > 0 ? contact.stiffness : default_contact_stiffness(step);
        contact.friction_delay = contact.friction_delay > 0 ? contact.friction_delay : default_friction_delay(step);
        pairs.emplace_back(contact, *i.bodies[contact.first].nodes, *i.bodies[contact.second].nodes);
    }
    for (PairContact<T>& pair : i.pairs) {
        pair.forget();
    }
    i.pairs = std::move(pairs);
    i.colours.clear();
    i.until_look = 0;
}

template <class T>
void World<T>::set_shared_obstacles(std::span<const SharedObstacle> obstacles) {
    Implementation& i = *implementation_;
    std::map<std::size_t, std::vector<SharedObstacle>> ones;
    std::set<std::pair<std::size_t, std::size_t>> named;
    for (const SharedObstacle& obstacle : obstacles) {
        i.require(obstacle.body);
        if (!named.insert({obstacle.body, obstacle.obstacle}).second) {
            refuse("obstacle " + std::to_string(obstacle.obstacle) + " of body " + std::to_string(obstacle.body) +
                   " is named twice");
        }
        ones[obstacle.one].push_back(obstacle);
    }
    std::vector<std::vector<SharedObstacle>> shared;
    for (auto& [number, one] : ones) {
        i.require_same(one);
        shared.push_back(std::move(one));
    }
    i.shared = std::move(shared);
}

template <class T>
std::vector<BodyContactReading> World<T>::contact_readings() const {
    std::vector<BodyContactReading> readings;
    readings.reserve(implementation_->pairs.size());
    for (const PairContact<T>& pair : implementation_->pairs) {
        readings.push_back(pair.reading());
    }
    return readings;
}

template <class T>
std::size_t World<T>::attach(const Attachment& attachment) {
    Implementation& i = *implementation_;
    if (!(attachment.stiffness > 0)) {
        refuse("stiffness = " + std::to_string(attachment.stiffness) +
               " of an attachment is not allowed: it must be > 0");
    }
    if (!attachment.from.body && !attachment.to.body) {
        refuse("an attachment between two points in space holds nothing: one must be of a body");
    }
    i.ties.push_back({attachment, i.point_of(attachment.from), i.point_of(attachment.to)});
    ++i.tied;
    return i.ties.size() - 1;
}

namespace {

template <class Ties>
auto& tie_of(Ties& ties, std::size_t attachment) {
    if (attachment >= ties.size()) {
        throw std::out_of_range("attachment " + std::to_string(attachment) + " is not there: the world has had " +
                                std::to_string(ties.size()));
    }
    return ties[attachment];
}

} // namespace

template <class T>
void World<T>::move_anchor(std::size_t attachment, const std::array<double, 3>& point) {
    auto& tie = tie_of(implementation_->ties, attachment);
    if (!finite(point)) {
        refuse("the point of an attachment is not finite");
    }
    if (tie.from.body && tie.to.body) {
        refuse("attachment " + std::to_string(attachment) + " has no end in space");
    }
    (tie.from.body ? tie.given.to : tie.given.from).point = point;
}
template <class T>
std::array<double, 3> World<T>::attachment_force(std::size_t attachment) const {
    return tie_of(implementation_->ties, attachment).force;
}
template <class T>
bool World<T>::attached(std::size_t attachment) const {
    return tie_of(implementation_->ties, attachment).there;
}
template <class T>
void World<T>::detach(std::size_t attachment) {
    auto& tie = tie_of(implementation_->ties, attachment);
    implementation_->tied -= tie.there;
    tie.there = false;
    tie.force = {0, 0, 0};
}

template <class T>
void World<T>::step(const StepParameters& parameters, long count) {
    step(parameters, count, {});
}

template <class T>
void World<T>::step(const StepParameters& parameters, long count, std::span<const StepMotion> motions) {
    Implementation& i = *implementation_;
    if (!motions.empty() && motions.size() != i.bodies.size()) {
        refuse(std::to_string(motions.size()) + " motions are given for " + std::to_string(i.bodies.size()) +
               " bodies: there must be one a body, or none");
    }
    if (count < 0) {
        refuse("count = " + std::to_string(count) + " is not allowed: it must be at least 0 steps");
    }
    const StepFactors factors = step_factors(
        parameters, parameters.integrator == Integrator::leapfrog ? std::optional(parameters) : std::nullopt);
    for (std::size_t b = 0; b < i.bodies.size(); ++b) { // before anything changes, for what it throws
        static_cast<void>(step_constants<T>(factors, i.inside(b).body->length_unit()));
        if (i.inside(b).cuts != i.bodies[b].cuts) {
            refuse("cells of body " + std::to_string(b) +
                   " were removed through the body itself: in a world its own remove_cells() does that");
        }
    }
    static_cast<void>(step_constants<T>(factors, 1));
    for (const auto& one : i.shared) {
        i.require_same(one);
    }
    if (!i.shared.empty() && parameters.integrator == Integrator::leapfrog) {
        refuse("obstacle " + std::to_string(i.shared[0][0].obstacle) + " of body " +
               std::to_string(i.shared[0][0].body) +
               " is shared: free obstacles of several bodies move by symplectic Euler, not by leapfrog");
    }
    i.take_notice();
    struct Sharing { // for these steps alone: a body that is lent may be stepped by its owner
        const Implementation& world;
        explicit Sharing(const Implementation& stepped) : world(stepped) { world.share(true); }
        ~Sharing() { world.share(false); }
        Sharing(const Sharing&) = delete;
        Sharing& operator=(const Sharing&) = delete;
    } const sharing(i);
    const double time_step = parameters.time_step, gain = factors.late_force;
    if (time_step != i.step_length) {
        i.before = i.since();
        i.since_look = 0;
        i.step_length = time_step;
        i.until_look = 0;
    }
    for (long done = 0; done < count;) {
        if (i.until_look == 0 && !i.pairs.empty()) {
            i.look(time_step);
        }
        const bool alone = i.colours.empty() && i.tied == 0 && i.shared.empty();
        const long steps = !alone ? 1 : i.pairs.empty() ? count - done : std::min(count - done, i.until_look);
        i.step_bodies(parameters, steps, motions, done);
        i.step_shared(factors);
        i.touch(time_step, gain);
        for (auto& tie : i.ties) {
            if (tie.there) {
                i.pull(tie, time_step, gain);
            }
        }
        done += steps;
        i.until_look = std::max(0L, i.until_look - steps);
        i.since_look += steps;
    }
    for (std::size_t b = 0; b < i.bodies.size(); ++b) {
        i.bodies[b].steps = i.inside(b).steps;
        i.bodies[b].settings = i.inside(b).settings;
        i.bodies[b].holds = i.inside(b).holds;
    }
}

template <class T>
double World<T>::critical_time_step() const {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& body : implementation_->bodies) {
        least = std::min(least, body.dynamics().critical_time_step());
    }
    return least;
}

template class World<float>;
template class World<double>;

} // namespace hybmss
