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
PairContact<T>::PairContact(const BodyContact& spec, WorldBody<T>& first, WorldBody<T>& second)
    : spec_(spec), sides_{Side{&first, &second, spec.first == spec.second ? 0.0 : 1.0, {}, {}},
                          Side{&second, &first, -1, {}, {}}} {}

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
        for (Node& node : side.nodes) {
            node.age = kSame;
        }
    }
}

template <class T>
void PairContact<T>::forget() {
    reach_ = 0;
    for (Side& side : sides_) {
        for (Node& node : side.nodes) {
            node = Node{node.node, node.begin, node.end, kNone, node.clear};
        }
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
    travelled_ = 0;
    if (gap() > margin) {
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
    std::vector<Node> before;
    before.swap(side.nodes);
    side.candidates.clear();
    if (boxes.empty()) {
        return;
    }
    Bounds all;
    for (const Bounds& box : boxes) {
        all.include(box.low);
        all.include(box.high);
    }
    const Buckets buckets(all, 2 * cells.edge + 2 * margin, boxes);
    // A body's node does not meet the cells around it, nor those that have a node in common with them.
    const bool itself = side.body == side.other;
    std::vector<std::uint32_t> own(itself ? body.rest.size() : 0, kNone);
    auto known = before.begin();
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
        while (known != before.end() && known->node < node) {
            ++known;
        }
        Node& entry = side.nodes.emplace_back(known != before.end() && known->node == node ? *known : Node{node, 0, 0});
        entry.begin = begin;
        entry.end = end;
        entry.clear = 0;
    }
}

/// The cell that a node is in, or else the nearest that it is hardly beside.
template <class T>
auto PairContact<T>::cell_at(const Side& side, Node& node, const Point& x, double travelled) const -> Found {
    const WorldBody<T>& other = *side.other;
    const double near = kBeside * other.cells.edge;
    Found found;
    double beside = kBeside, clear = std::numeric_limits<double>::infinity();
    const auto look = [&](std::uint32_t cell) {
        const std::array<Point, 8> corners = corners_of(other, cell);
        const double distance = distance_to(bounds_of(corners), x) - near;
        clear = std::min(clear, travelled + distance);
        if (distance > 0) {
            return;
        }
        if (const std::optional<PlaceInCell> place = place_in_cell(corners, x)) {
            const Point& xi = place->xi;
            const double out = std::max({-xi[0], xi[0] - 1, -xi[1], xi[1] - 1, -xi[2], xi[2] - 1});
            if (out < beside) {
                beside = out;
                found = {cell, *place};
            }
        }
    };
    if (node.cell != kNone) {
        look(node.cell);
    }
    for (std::uint32_t i = node.begin; i < node.end && beside > 0; ++i) {
        const Candidate& candidate = side.candidates[i];
        if (candidate.distance - near > travelled) {
            clear = std::min(clear, candidate.distance - near);
        } else if (candidate.cell != node.cell) {
            look(candidate.cell);
        }
    }
    node.clear = static_cast<float>(clear);
    return found;
}

template <class T>
void PairContact<T>::take_place(const Side& side, Node& node, const std::array<double, 8>& weights) const {
    node.rest = node.mobility = {0, 0, 0};
    for (std::size_t c = 0; c < 9; ++c) {
        const bool own = c == 8;
        const WorldBody<T>& body = own ? *side.body : *side.other;
        const std::uint32_t n = own ? node.node : body.cells.corners[node.cell][c];
        const double weight = own ? -1 : weights[c];
        node.index[c] = body.index[n];
        node.held[c] = body.held.empty() ? 0 : body.held[n];
        node.weights[c] = static_cast<T>(weight);
        node.gains[c] = static_cast<T>(weight * body.inverse_mass[n] / body.length_unit);
        node.rest = plus(node.rest, -weight, body.rest[n]);
        for (std::size_t a = 0; a < 3; ++a) {
            node.mobility[a] += weight * weight * body.mobility(n, a);
        }
    }
}

// Inlined, as push() is: it is what nodes that touch take most of their time for.
template <class T>
[[gnu::always_inline]] inline Point PairContact<T>::offset(const Side& side, const Node& node) const {
    const WorldBody<T>&body = *side.body, &other = *side.other;
    Point out;
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<T>&u = other.displacement[a], &own = body.displacement[a];
        double there = 0;
        for (std::size_t c = 0; c < 8; ++c) {
            there += static_cast<double>(node.weights[c]) *
                     static_cast<double>(u.first[static_cast<std::ptrdiff_t>(node.index[c]) * u.stride]);
        }
        out[a] =
            node.rest[a] - other.length_unit * there +
            body.length_unit * static_cast<double>(own.first[static_cast<std::ptrdiff_t>(node.index[8]) * own.stride]);
    }
    return out;
}

namespace {

/// Changes the motion of some nodes of a body, by what they gain of speed along an axis by an impulse.
template <class T>
[[gnu::always_inline]] inline void push(const WorldBody<T>& body, std::span<const std::uint32_t> index,
                                        std::span<const T> gains, std::span<const std::uint8_t> held,
                                        const Point& impulse, double time_step) {
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<T>&u = body.displacement[a], &v = body.velocity[a];
        const T given = static_cast<T>(impulse[a]), moved = static_cast<T>(time_step * impulse[a]);
        for (std::size_t c = 0; c < index.size(); ++c) {
            const T gain = held[c] >> a & 1 ? T(0) : gains[c];
            v.first[static_cast<std::ptrdiff_t>(index[c]) * v.stride] -= gain * given;
            u.first[static_cast<std::ptrdiff_t>(index[c]) * u.stride] -= gain * moved;
        }
    }
}

} // namespace

/// Out by the face that it came in by: of a node that touches already, as it was; of one that does not, what it has
/// passed in this step, the faster the better. Else by the nearest.
template <class T>
bool PairContact<T>::locate(const Side& side, Node& node, const Point& x, double time_step, double travelled) const {
    const BodyCells& cells = side.other->cells;
    const auto [cell, place] = cell_at(side, node, x, travelled);
    node.cell = cell;
    double most = 0, least = std::numeric_limits<double>::infinity(), speed = 0;
    if (cell != kNone) {
        const BodyPoint<T> there{side.other, cells.corners[cell], trilinear_weights(place.xi), 8};
        const Point velocity = plus(side.body->speed(node.node), -1, there.speed()), before = node.normal;
        for (std::size_t face = 0; face < 6; ++face) {
            const std::uint8_t layers = cells.layers[cell][face];
            if (layers == BodyCells::kDeep) {
                continue;
            }
            const std::size_t a = face / 2;
            const Point slope = {place.gradient[3 * a], place.gradient[3 * a + 1], place.gradient[3 * a + 2]};
            const double per_m = length(slope), sign = face & 1 ? 1 : -1;
            const double depth = (layers + (face & 1 ? 1 - place.xi[a] : place.xi[a])) / per_m;
            const Point normal = plus({}, sign / per_m, slope);
            const double inwards = -dot(normal, velocity), kept = dot(normal, before);
            double by_it = 0; // how much says that it came in there
            if (depth < 0) {  // it is outside
                by_it = std::numeric_limits<double>::infinity();
            } else if (depth < cells.edge) {
                by_it = node.touches ? (kept > kTurned ? kept : 0) : (depth <= time_step * inwards ? inwards : 0);
            }
            if (by_it > most || (by_it == most && depth < least)) {
                most = by_it;
                least = depth;
                speed = inwards;
                node.normal = normal;
            }
        }
        take_place(side, node, there.weights);
    }
    if (!(least < std::numeric_limits<double>::infinity())) {
        node = Node{node.node, node.begin, node.end, kNone, node.clear};
        return false;
    }
    node.age = 0;
    node.depth = least;
    // What it can have come in by since the last step, and the error of the linear depth.
    const double can_be = node.pressed + time_step * std::max(speed, 0.0) + kDrift * cells.edge;
    node.forgiven = std::max(least - can_be, 0.0);
    return true;
}

template <class T>
void PairContact<T>::step(Side& side, double time_step, double gain, double travelled) {
    const double drift = kDrift * side.other->cells.edge;
    const double follows = time_step / (spec_.friction_delay + time_step);
    for (Node& node : side.nodes) {
        if (node.cell == kNone && node.clear > travelled) {
            continue;
        }
        Point off = node.cell == kNone ? Point{0, 0, 0} : offset(side, node);
        if (node.cell == kNone || ++node.age > kSame || dot(off, off) > drift * drift) {
            node.slip = plus(node.slip, 1, off);
            if (!locate(side, node, side.body->position(node.node), time_step, travelled)) {
                continue;
            }
            off = offset(side, node);
        }
        const Point& n = node.normal;
        const double whole = node.depth - dot(n, off), depth = whole - node.forgiven;
        node.forgiven -= node.forgiven * follows;
        // Of an impulse along a direction, what is gained of speed along it.
        const auto along = [&node](const Point& d) {
            return d[0] * d[0] * node.mobility[0] + d[1] * d[1] * node.mobility[1] + d[2] * d[2] * node.mobility[2];
        };
        const double yields = along(n);
        node.touches = whole > 0 && yields > 0;
        node.pressed = std::max(depth, 0.0);
        if (!(node.touches && depth > 0)) {
            node.push = 0;
            node.slip = plus({}, -1, off); // so that it begins anew
            continue;
        }
        const double stiffness = spec_.stiffness / yields; // N/m
        const double press = stiffness * depth / (1 + stiffness * time_step * gain * yields);
        Point force = plus({}, press, n);
        if (spec_.friction > 0) {
            node.push += (press - node.push) * (node.push > 0 ? follows : 1);
            Point slip = plus(node.slip, 1, off);
            slip = plus(slip, -dot(slip, n), n);
            if (const double way = length(slip); way > 0) {
                const Point back = plus({}, -1 / way, slip);
                const double yields_along = time_step * gain * along(back);
                const double most = spec_.friction * node.push;
                double hold = stiffness * way / (1 + stiffness * yields_along);
                if (hold > most) { // it slides: the spring is let out
                    hold = most;
                    slip = plus({}, -(most / stiffness + hold * yields_along), back);
                }
                force = plus(force, hold, back);
            }
            node.slip = plus(slip, -1, off);
        }
        const Point impulse = plus({}, gain, force);
        const std::span<const std::uint32_t> index = node.index;
        const std::span<const T> gains = node.gains;
        const std::span<const std::uint8_t> held = node.held;
        push(*side.other, index.first(8), gains.first(8), held.first(8), impulse, time_step);
        push(*side.body, index.last(1), gains.last(1), held.last(1), impulse, time_step);
        const double left = whole - time_step * gain * press * yields;
        reading_.nodes += 1;
        reading_.depth = std::max(reading_.depth, left);
        reading_.greatest_depth = std::max(reading_.greatest_depth, left);
        reading_.impulse = plus(reading_.impulse, side.sign, impulse);
        reading_.force = plus(reading_.force, side.sign, force);
    }
}

template <class T>
void PairContact<T>::step(double time_step, double gain, double since) {
    clear_reading();
    for (Side& side : sides_) {
        step(side, time_step, gain, travelled_ + since);
    }
}

template class PairContact<float>;
template class PairContact<double>;
template struct WorldBody<float>;
template struct WorldBody<double>;

} // namespace hybmss
