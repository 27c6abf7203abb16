#include "dynamics/world/body_contact.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

template <class T>
std::array<Point, 8> corners_of(const WorldBody<T>& body, std::uint32_t cell) {
    std::array<Point, 8> corners;
    for (std::size_t c = 0; c < 8; ++c) {
        corners[c] = body.position(body.cells.corners[cell][c]);
    }
    return corners;
}

Bounds bounds_of(const std::array<Point, 8>& corners) {
    Bounds box;
    for (const Point& x : corners) {
        box.include(x);
    }
    return box;
}

/// m by which a point is beside a box along an axis, at most; below zero inside.
double distance_to(const Bounds& box, const Point& x) {
    Bounds point;
    point.include(x);
    return box.gap(point);
}

/// Boxes by where they are, in a grid of buckets over a region.
class Buckets {
public:
    Buckets(const Bounds& region, double size, const std::vector<Bounds>& boxes) : low_(region.low) {
        // No more buckets than boxes can fill, and no more boxes in buckets than memory should have.
        const double most = 8 * static_cast<double>(boxes.size()) + 64;
        for (double count = 0, entries = 0; count == 0 || count > most || entries > 8 * most; size *= 2) {
            count = 1;
            for (std::size_t a = 0; a < 3; ++a) {
                const double along = std::floor((region.high[a] - region.low[a]) / size) + 1;
                count *= along;
                counts_[a] = static_cast<std::size_t>(std::min(along, most));
            }
            size_ = size;
            entries = 0;
            for (const Bounds& box : boxes) {
                double one = 1;
                for (std::size_t a = 0; a < 3; ++a) {
                    one *= static_cast<double>(place(box.high[a], a) - place(box.low[a], a) + 1);
                }
                entries += one;
            }
        }
        first_.assign(counts_[0] * counts_[1] * counts_[2] + 1, 0);
        for (const Bounds& box : boxes) {
            for_each_bucket(box, [&](std::size_t bucket) { ++first_[bucket + 1]; });
        }
        for (std::size_t b = 1; b < first_.size(); ++b) {
            first_[b] += first_[b - 1];
        }
        boxes_.resize(first_.back());
        std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
        for (std::uint32_t i = 0; i < boxes.size(); ++i) {
            for_each_bucket(boxes[i], [&](std::size_t bucket) { boxes_[next[bucket]++] = i; });
        }
    }
    /// The boxes, ascending, that a point of the region may be in.
    std::span<const std::uint32_t> at(const Point& x) const {
        const std::size_t bucket = place(x[0], 0) + counts_[0] * (place(x[1], 1) + counts_[1] * place(x[2], 2));
        return std::span(boxes_).subspan(first_[bucket], first_[bucket + 1] - first_[bucket]);
    }

private:
    std::size_t place(double x, std::size_t axis) const {
        const double at = (x - low_[axis]) / size_;
        return at > 0 ? std::min(static_cast<std::size_t>(at), counts_[axis] - 1) : 0;
    }
    template <class Visit>
    void for_each_bucket(const Bounds& box, const Visit& visit) const {
        for (std::size_t k = place(box.low[2], 2), ke = place(box.high[2], 2); k <= ke; ++k) {
            for (std::size_t j = place(box.low[1], 1), je = place(box.high[1], 1); j <= je; ++j) {
                for (std::size_t i = place(box.low[0], 0), ie = place(box.high[0], 0); i <= ie; ++i) {
                    visit(i + counts_[0] * (j + counts_[1] * k));
                }
            }
        }
    }

    Point low_;
    double size_ = 1;
    std::array<std::size_t, 3> counts_ = {1, 1, 1};
    std::vector<std::size_t> first_;
    std::vector<std::uint32_t> boxes_;
};

} // namespace

template <class T>
void WorldBody<T>::look() {
    box = speeds = {};
    places.clear();
    for (const std::uint32_t node : cells.surface) {
        places.push_back(position(node));
        box.include(places.back());
        speeds.include(speed(node));
    }
    cell_boxes.clear();
}

template <class T>
void WorldBody<T>::find_cell_boxes() {
    cell_boxes.reserve(cells.outer.size());
    for (const std::uint32_t cell : cells.outer) {
        cell_boxes.push_back(bounds_of(corners_of(*this, cell)));
    }
}

template <class T>
std::uint32_t WorldBody<T>::use(std::uint32_t node) {
    Gathered<T>& g = gathered;
    if (g.where.empty()) {
        g.where.assign(rest.size(), kNone);
    }
    std::uint32_t& where = g.where[node];
    if (where == kNone) {
        if (g.free.empty()) {
            g.free.push_back(static_cast<std::uint32_t>(g.nodes.size()));
            g.nodes.emplace_back();
            g.from.emplace_back();
            g.number.push_back(0);
            g.users.push_back(0);
        }
        const std::uint32_t taken = g.free.back();
        g.free.pop_back();
        g.nodes[taken] = {{}, {}, Quad<T>(mobility(node))};
        g.from[taken] = read(displacement, node);
        g.number[taken] = node;
        where = taken;
    }
    ++g.users[where];
    return where;
}

template <class T>
void WorldBody<T>::gather(double time_step) {
    gathered_step = time_step;
    for (std::size_t i = 0; i < gathered.nodes.size(); ++i) {
        if (gathered.users[i] > 0) {
            const std::uint32_t node = gathered.number[i];
            const Point moved = plus(read(displacement, node), -1, gathered.from[i]);
            gathered.nodes[i].moved = Quad<T>(plus({}, length_unit, moved));
        }
    }
}

template <class T>
void WorldBody<T>::weigh_gathered() {
    for (std::size_t i = 0; i < gathered.nodes.size(); ++i) {
        gathered.nodes[i].mobility = Quad<T>(mobility(gathered.number[i]));
    }
}

template <class T>
void WorldBody<T>::scatter() {
    for (std::uint32_t i = 0; i < gathered.nodes.size(); ++i) {
        Quad<T>& gained = gathered.nodes[i].gain;
        const std::uint32_t node = gathered.number[i];
        if (const Point gain = gained.point(); gain[0] != 0 || gain[1] != 0 || gain[2] != 0) {
            gained = {};
            if (inverse_mass[node] > 0) {
                work += dot(gain, plus(speed(node), 0.5, gain)) / inverse_mass[node];
            }
            add(node, gain, gathered_step);
        }
        if (gathered.users[i] == 0 && gathered.where[node] == i) {
            gathered.where[node] = kNone;
            gathered.free.push_back(i);
        }
    }
}

template <class T>
PairContact<T>::PairContact(const BodyContact& spec, WorldBody<T>& first, WorldBody<T>& second)
    : spec_(spec), sides_{Side{&first, &second, spec.first == spec.second ? 0.0 : 1.0}, Side{&second, &first, -1}} {}

template <class T>
double PairContact<T>::approach() const {
    const Bounds &p = sides_[0].body->speeds, &q = sides_[0].other->speeds;
    Point most;
    for (std::size_t a = 0; a < 3; ++a) {
        most[a] = std::max(p.high[a] - q.low[a], q.high[a] - p.low[a]);
    }
    return length(most);
}

template <class T>
void PairContact<T>::look_again() {
    reach_ = 0;
    for (Side& side : sides_) {
        for (Touch& touch : side.touching) {
            touch.found_at = -std::numeric_limits<float>::infinity();
        }
    }
}

template <class T>
void PairContact<T>::let_go(Side& side, const Touch& touch) const {
    for (std::size_t c = 0; c < touch.corner_count; ++c) {
        side.other->let_go(touch.corners[c]);
    }
    side.body->let_go(touch.node);
}

template <class T>
void PairContact<T>::forget() {
    reach_ = 0;
    for (Side& side : sides_) {
        for (const Touch& touch : side.touching) {
            let_go(side, touch);
        }
        side.touching.clear();
    }
}

template <class T>
double PairContact<T>::gap() const {
    return spec_.first == spec_.second ? -1 : sides_[0].body->box.gap(sides_[1].body->box);
}

/// Less than a cell, if the bodies are not so fast: what may be met grows with its cube.
template <class T>
double PairContact<T>::margin(double way) const {
    constexpr double kSteps = 8;
    const double edge = std::max(sides_[0].other->cells.edge, sides_[1].other->cells.edge);
    return std::max(std::clamp(kSteps * way, edge / 4, edge), std::min(2 * way, 2 * edge));
}

template <class T>
void PairContact<T>::find(double margin) {
    // A touch tells from now on how far the bodies have travelled since it was found.
    for (Side& side : sides_) {
        for (Touch& touch : side.touching) {
            touch.found_at -= static_cast<float>(travelled_);
        }
    }
    travelled_ = 0;
    if (gap() > margin) {
        forget();
        for (Side& side : sides_) {
            side.nodes.clear();
        }
        reach_ = gap();
    } else {
        reach_ = margin;
        find(sides_[0], margin);
        if (spec_.first != spec_.second) {
            find(sides_[1], margin);
        }
    }
    if (!near()) { // no step comes here
        clear_reading();
    }
}

template <class T>
void PairContact<T>::clear_reading() {
    reading_.force = {0, 0, 0};
    reading_.nodes = 0;
    reading_.depth = 0;
}

template <class T>
void PairContact<T>::find(Side& side, double margin) const {
    const WorldBody<T>&body = *side.body, &other = *side.other;
    const BodyCells& cells = other.cells;
    std::vector<std::uint32_t> met; // of the outer cells
    std::vector<Bounds> boxes;      // theirs, grown
    for (std::uint32_t i = 0; i < cells.outer.size(); ++i) {
        if (other.cell_boxes[i].gap(body.box) <= margin && other.cell_boxes[i].finite()) {
            met.push_back(i);
            boxes.push_back(other.cell_boxes[i].grown(margin));
        }
    }
    std::vector<Near> before;
    before.swap(side.nodes);
    std::vector<Touch> touching;
    touching.swap(side.touching);
    std::sort(touching.begin(), touching.end(), [](const Touch& a, const Touch& b) { return a.near < b.near; });
    side.candidates.clear();
    side.clear = 0;
    auto touch = touching.begin();
    // Touches of nodes before this one are over: they are near nothing any more.
    const auto let_go_before = [&](std::uint32_t node) {
        for (; touch != touching.end() && before[touch->near].node < node; ++touch) {
            let_go(side, *touch);
        }
    };
    Bounds all;
    for (const Bounds& box : boxes) {
        all.include(box.low);
        all.include(box.high);
    }
    if (!boxes.empty()) {
        const Buckets buckets(all, 2 * cells.edge + 2 * margin, boxes);
        // A body's node does not meet the cells around it, nor those that have a node in common with them.
        const bool itself = side.body == side.other;
        std::vector<std::uint32_t> own(itself ? body.rest.size() : 0, kNone);
        for (std::size_t s = 0; s < body.places.size(); ++s) {
            const std::uint32_t node = body.cells.surface[s];
            const Point& x = body.places[s];
            if (!all.holds(x) || body.inverse_mass[node] == 0) {
                continue;
            }
            if (itself) {
                for (std::uint32_t i = cells.first_cell_of[node]; i < cells.first_cell_of[node + 1]; ++i) {
                    for (const std::uint32_t neighbour : cells.corners[cells.cells_of[i]]) {
                        own[neighbour] = node;
                    }
                }
            }
            const auto begin = static_cast<std::uint32_t>(side.candidates.size());
            for (const std::uint32_t i : buckets.at(x)) {
                const std::uint32_t cell = cells.outer[met[i]];
                const auto& corners = cells.corners[cell];
                if (boxes[i].holds(x) && !(itself && std::any_of(corners.begin(), corners.end(),
                                                                 [&](std::uint32_t c) { return own[c] == node; }))) {
                    const auto distance = static_cast<float>(distance_to(other.cell_boxes[met[i]], x));
                    side.candidates.push_back({cell, distance});
                }
            }
            const auto end = static_cast<std::uint32_t>(side.candidates.size());
            if (begin == end) {
                continue;
            }
            let_go_before(node);
            Near& near = side.nodes.emplace_back(Near{node, begin, end, 0});
            if (touch != touching.end() && before[touch->near].node == node) {
                touch->near = static_cast<std::uint32_t>(side.nodes.size() - 1);
                near.clear = std::numeric_limits<float>::infinity();
                side.touching.push_back(*touch++);
            }
        }
    }
    let_go_before(kNone);
}

/// The cell that a node is in, or else the nearest that it is hardly beside.
template <class T>
auto PairContact<T>::cell_at(const Side& side, Near& node, std::uint32_t last, const Point& x, double travelled) const
    -> Found {
    const WorldBody<T>& other = *side.other;
    const double edge = other.cells.edge, near = kBeside * edge;
    Found found;
    double beside = kBeside, clear = std::numeric_limits<double>::infinity();
    const auto look = [&](std::uint32_t cell) {
        const std::array<Point, 8> corners = corners_of(other, cell);
        const double distance = distance_to(bounds_of(corners), x) - near;
        if (distance > 0) {
            clear = std::min(clear, travelled + distance);
            return;
        }
        double way = kDrift * edge; // before it is worth while to look again
        if (const std::optional<PlaceInCell> place = place_in_cell(corners, x)) {
            const Point& xi = place->xi;
            const double out = std::max({-xi[0], xi[0] - 1, -xi[1], xi[1] - 1, -xi[2], xi[2] - 1});
            if (out < beside) {
                beside = out;
                found = {cell, *place};
            }
            way = std::max(way, 0.5 * (out - kBeside) * edge);
        }
        clear = std::min(clear, travelled + way);
    };
    if (last != kNone) {
        look(last);
    }
    for (std::uint32_t i = node.begin; i < node.end && beside > 0; ++i) {
        const Candidate& candidate = side.candidates[i];
        if (candidate.distance - near > travelled) {
            clear = std::min(clear, candidate.distance - near);
        } else if (candidate.cell != last) {
            look(candidate.cell);
        }
    }
    node.clear = static_cast<float>(clear);
    return found;
}

namespace {

// Inlined: it is what nodes that touch take most of their time for.
template <class T>
[[gnu::always_inline]] inline Quad<T> sum(const Quad<T>& a, T factor, const Quad<T>& b) {
    Quad<T> out;
    for (std::size_t i = 0; i < Quad<T>::kParts; ++i) {
        out.part[i] = a.part[i] + factor * b.part[i];
    }
    return out;
}
template <class T>
[[gnu::always_inline]] inline Quad<T> product(const Quad<T>& a, const Quad<T>& b) {
    Quad<T> out;
    for (std::size_t i = 0; i < Quad<T>::kParts; ++i) {
        out.part[i] = a.part[i] * b.part[i];
    }
    return out;
}
template <class T>
[[gnu::always_inline]] inline T dot(const Quad<T>& a, const Quad<T>& b) {
    const Quad<T> all = product(a, b);
    return all[0] + all[1] + all[2];
}

/// m by which a node has moved from a point of a cell.
template <class Touch, class T>
[[gnu::always_inline]] inline Quad<T> moved(const Touch& touch, const Gathered<T>& body, const Gathered<T>& other,
                                            T time_step) {
    const auto& own = body.nodes[touch.node];
    Quad<T> way = own.moved, gain = own.gain;
    const auto less = [&](std::size_t c) __attribute__((always_inline)) {
        const auto& corner = other.nodes[touch.corners[c]];
        way = sum(way, -touch.weights[c], corner.moved);
        gain = sum(gain, -touch.weights[c], corner.gain);
    };
    for (std::size_t c = 0; c < 4; ++c) { // so many that the loop is unrolled
        less(c);
    }
    for (std::size_t c = 4; c < touch.corner_count; ++c) {
        less(c);
    }
    return sum(way, time_step, gain);
}

} // namespace

/// Out by the face that it came in by: of a node that touches already, as it was; of one that does not, what it has
/// passed in this step, the faster the better. Else by the nearest.
template <class T>
bool PairContact<T>::locate(Side& side, Touch& touch, double time_step, double travelled) const {
    const BodyCells& cells = side.other->cells;
    Near& near = side.nodes[touch.near];
    const Point x = side.body->position(near.node);
    const bool known = touch.cell != kNone;
    const auto [cell, place] = cell_at(side, near, touch.cell, x, travelled);
    double most = 0, least = std::numeric_limits<double>::infinity();
    std::size_t out = 0;
    const Point before = touch.normal.point();
    Point normal = before;
    const auto velocity = [&, cell = cell, &place = place] {
        const BodyPoint<T> there{side.other, cells.corners[cell], trilinear_weights(place.xi), 8};
        return plus(side.body->speed(near.node), -1, there.speed());
    };
    if (cell != kNone) {
        const Point comes = touch.touches ? Point{0, 0, 0} : velocity();
        for (std::size_t face = 0; face < 6; ++face) {
            const std::uint8_t layers = cells.layers[cell][face];
            if (layers == BodyCells::kDeep) {
                continue;
            }
            const std::size_t a = face / 2;
            const Point slope = place.slope(a);
            const double per_m = length(slope), sign = face & 1 ? 1 : -1;
            const double depth = (layers + (face & 1 ? 1 - place.xi[a] : place.xi[a])) / per_m;
            const Point way_out = plus({}, sign / per_m, slope);
            double by_it = 0; // how much says that it came in there
            if (depth < 0) {  // it is outside
                by_it = std::numeric_limits<double>::infinity();
            } else if (depth < cells.edge) {
                const double inwards = -dot(way_out, comes), kept = dot(way_out, before);
                by_it = touch.touches ? (kept > kTurned ? kept : 0) : (depth <= time_step * inwards ? inwards : 0);
            }
            if (by_it > most || (by_it == most && depth < least)) {
                most = by_it;
                least = depth;
                normal = way_out;
                out = face;
            }
        }
    }
    if (known) {
        let_go(side, touch);
    }
    if (!(least < std::numeric_limits<double>::infinity())) {
        return false;
    }
    near.clear = std::numeric_limits<float>::infinity();
    touch.cell = cell;
    touch.found_at = static_cast<float>(travelled);
    touch.normal = Quad<T>(normal);
    touch.depth = static_cast<T>(least);
    // What it can have come in by since the last step, and the error of the linear depth.
    double can_be = static_cast<double>(touch.pressed) + kDrift * cells.edge;
    if (least > can_be) {
        can_be += time_step * std::max(-dot(normal, velocity()), 0.0);
    }
    touch.forgiven = static_cast<T>(std::max(least - can_be, 0.0));

    std::array<double, 8> weights = trilinear_weights(place.xi);
    std::array<std::size_t, 8> corners = {0, 1, 2, 3, 4, 5, 6, 7};
    touch.corner_count = 8;
    if (cells.layers[cell][out] == 0 && least < kDrift * cells.edge) {
        // The point of the face that lies on the way out: so the force makes no moment.
        const std::size_t axis = out / 2, b = axis == 0 ? 1 : 0, c = axis == 2 ? 1 : 2;
        const Point way = plus({}, least, normal);
        const double along_b = std::clamp(place.xi[b] + dot(place.slope(b), way), 0.0, 1.0),
                     along_c = std::clamp(place.xi[c] + dot(place.slope(c), way), 0.0, 1.0);
        touch.corner_count = 4;
        for (std::size_t i = 0; i < 4; ++i) {
            corners[i] = (out & 1) << axis | (i & 1) << b | (i >> 1) << c;
            weights[i] = (i & 1 ? along_b : 1 - along_b) * (i >> 1 ? along_c : 1 - along_c);
        }
    }
    Point mobility = side.body->mobility(near.node);
    for (std::size_t i = 0; i < touch.corner_count; ++i) {
        const std::uint32_t n = cells.corners[cell][corners[i]];
        touch.corners[i] = side.other->use(n);
        touch.weights[i] = static_cast<T>(weights[i]);
        mobility = plus(mobility, weights[i] * weights[i], side.other->mobility(n));
    }
    touch.node = side.body->use(near.node);
    touch.start = moved(touch, side.body->gathered, side.other->gathered, static_cast<T>(time_step));
    touch.mobility = Quad<T>(mobility);
    const double yields =
        normal[0] * normal[0] * mobility[0] + normal[1] * normal[1] * mobility[1] + normal[2] * normal[2] * mobility[2];
    touch.stiffness = static_cast<T>(yields > 0 ? spec_.stiffness / yields : 0);
    return true;
}

template <class T>
void PairContact<T>::meet(Side& side, double time_step, double travelled) {
    double clear = std::numeric_limits<double>::infinity();
    for (std::uint32_t n = 0; n < side.nodes.size(); ++n) {
        if (!(static_cast<double>(side.nodes[n].clear) > travelled)) {
            Touch touch{};
            touch.near = n;
            touch.cell = kNone;
            if (locate(side, touch, time_step, travelled)) {
                side.touching.push_back(touch);
            }
        }
        clear = std::min(clear, static_cast<double>(side.nodes[n].clear));
    }
    side.clear = clear;
}

template <class T>
void PairContact<T>::step(Side& side, double time_step, double gain, double travelled, double way) {
    if (!(side.clear > travelled)) {
        meet(side, time_step, travelled);
    }
    const double edge = side.other->cells.edge;
    const auto drift = static_cast<T>(kDrift * edge), dt = static_cast<T>(time_step), acts = static_cast<T>(gain);
    const auto patience = static_cast<float>(travelled - std::max(kTravels * edge, kSame * way));
    const auto follows = static_cast<T>(time_step / (spec_.friction_delay + time_step));
    const auto yields_to = static_cast<T>(spec_.stiffness * time_step * gain); // of the depth, by what is left of it
    const auto friction = static_cast<T>(spec_.friction);
    Quad<T> whole_force;
    T deepest = 0;
    std::size_t count = 0, over = 0;
    // Nodes next to each other act on the same corners: those between wait less for each other than they would in turn.
    constexpr std::size_t kStride = 3;
    for (std::size_t first = 0; first < kStride; ++first) {
        for (std::size_t t = first; t < side.touching.size(); t += kStride) {
            Touch& touch = side.touching[t];
            Quad<T> off = sum(moved(touch, side.body->gathered, side.other->gathered, dt), T(-1), touch.start);
            if (touch.found_at < patience || dot(off, off) > drift * drift) {
                touch.slip = sum(touch.slip, T(1), off);
                if (!locate(side, touch, time_step, travelled)) {
                    touch.cell = kNone;
                    ++over;
                    continue;
                }
                off = {}; // it is where it was found
            }
            const T whole = touch.depth - dot(touch.normal, off), depth = whole - touch.forgiven;
            touch.forgiven -= touch.forgiven * follows;
            touch.touches = whole > 0 && touch.stiffness > 0;
            touch.pressed = std::max(depth, T(0));
            if (!(touch.touches && depth > 0)) {
                touch.push = touch.left = 0;
                touch.slip = sum({}, T(-1), off); // so that it begins anew
                continue;
            }
            const T press = touch.stiffness * depth / (1 + yields_to);
            Quad<T> force = sum({}, press, touch.normal);
            if (friction > 0) {
                touch.push += (press - touch.push) * (touch.push > 0 ? follows : 1);
                Quad<T> slip = sum(touch.slip, T(1), off);
                slip = sum(slip, -dot(slip, touch.normal), touch.normal);
                if (const T square = dot(slip, slip); square > 0) {
                    const T way_back = std::sqrt(square);
                    const Quad<T> back = sum({}, -1 / way_back, slip);
                    const T yields = dt * acts * dot(product(back, back), touch.mobility);
                    const T most = friction * touch.push;
                    T pull = touch.stiffness * way_back / (1 + touch.stiffness * yields);
                    if (pull > most) { // it slides: the spring is let out
                        pull = most;
                        slip = sum({}, -(most / touch.stiffness + pull * yields), back);
                    }
                    force = sum(force, pull, back);
                }
                touch.slip = sum(slip, T(-1), off);
            }
            const Quad<T> impulse = sum({}, acts, force);
            const auto push = [&](std::size_t c) __attribute__((always_inline)) {
                auto& corner = side.other->gathered.nodes[touch.corners[c]];
                corner.gain = sum(corner.gain, -touch.weights[c], product(impulse, corner.mobility));
            };
            for (std::size_t c = 0; c < 4; ++c) {
                push(c);
            }
            for (std::size_t c = 4; c < touch.corner_count; ++c) {
                push(c);
            }
            auto& node = side.body->gathered.nodes[touch.node];
            node.gain = sum(node.gain, T(1), product(impulse, node.mobility));
            touch.left = whole - depth * yields_to / (1 + yields_to);
            ++count;
            deepest = std::max(deepest, touch.left);
            whole_force = sum(whole_force, T(1), force);
        }
    }
    if (over > 0) {
        std::erase_if(side.touching, [](const Touch& touch) { return touch.cell == kNone; });
        side.clear = 0; // of a node that left
    }
    reading_.nodes += count;
    reading_.depth = std::max(reading_.depth, static_cast<double>(deepest));
    reading_.force = plus(reading_.force, side.sign, whole_force.point());
}

template <class T>
void PairContact<T>::step(double time_step, double gain, double since, double way) {
    clear_reading();
    for (Side& side : sides_) {
        step(side, time_step, gain, travelled_ + since, way);
    }
    reading_.greatest_depth = std::max(reading_.greatest_depth, reading_.depth);
    reading_.impulse = plus(reading_.impulse, gain, reading_.force);
}

template class PairContact<float>;
template class PairContact<double>;
template struct WorldBody<float>;
template struct WorldBody<double>;

} // namespace hybmss
