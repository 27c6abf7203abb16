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
        // No more buckets than boxes can fill.
        const double most = 8 * static_cast<double>(boxes.size()) + 64;
        for (double count = std::numeric_limits<double>::infinity(); count > most; size *= 2) {
            count = 1;
            for (std::size_t a = 0; a < 3; ++a) {
                const double along = std::floor((region.high[a] - region.low[a]) / size) + 1;
                count *= along;
                counts_[a] = static_cast<std::size_t>(std::min(along, most));
            }
            size_ = size;
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
    for (const std::uint32_t node : cells.surface) {
        box.include(position(node));
        speeds.include(speed(node));
    }
}

template <class T>
PairContact<T>::PairContact(const BodyContact& spec, WorldBody<T>& first, WorldBody<T>& second)
    : spec_(spec), sides_{Side{&first, &second, 1, {}, {}}, Side{&second, &first, -1, {}, {}}} {}

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
void PairContact<T>::forget() {
    reach_ = 0;
    for (Side& side : sides_) {
        for (Node& node : side.nodes) {
            node = Node{node.node, node.begin, node.end};
        }
    }
}

template <class T>
void PairContact<T>::find(double way) {
    const bool itself = spec_.first == spec_.second;
    const double gap = itself ? -1 : sides_[0].body->box.gap(sides_[1].body->box);
    const double margin = std::max(way, std::max(sides_[0].other->cells.edge, sides_[1].other->cells.edge) / 2);
    if (gap > margin) {
        for (Side& side : sides_) {
            side.nodes.clear();
        }
        reach_ = gap;
        return;
    }
    reach_ = margin;
    find(sides_[0], margin);
    if (!itself) {
        find(sides_[1], margin);
    }
}

template <class T>
void PairContact<T>::find(Side& side, double reach) const {
    const BodyCells& cells = side.other->cells;
    const Bounds region = side.body->box.grown(reach);
    std::vector<std::uint32_t> met;
    std::vector<Bounds> boxes;
    for (std::uint32_t cell = 0; cell < cells.corners.size(); ++cell) {
        const Bounds box = bounds_of(corners_of(*side.other, cell)).grown(reach);
        if (box.gap(region) <= 0 && box.finite()) {
            met.push_back(cell);
            boxes.push_back(box);
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
    const Buckets buckets(all, 2 * cells.edge + 2 * reach, boxes);
    // A body's node does not meet the cells around it, nor those that have a node in common with them.
    const bool itself = side.body == side.other;
    std::vector<std::uint32_t> own(itself ? side.body->rest.size() : 0, kNone);
    auto known = before.begin();
    for (const std::uint32_t node : side.body->cells.surface) {
        const Point x = side.body->position(node);
        if (!all.holds(x) || side.body->inverse_mass[node] == 0) {
            continue;
        }
        const auto begin = static_cast<std::uint32_t>(side.candidates.size());
        if (itself) {
            for (std::uint32_t i = cells.first_cell_of[node]; i < cells.first_cell_of[node + 1]; ++i) {
                for (const std::uint32_t neighbour : cells.corners[cells.cells_of[i]]) {
                    own[neighbour] = node;
                }
            }
        }
        for (const std::uint32_t i : buckets.at(x)) {
            const auto& corners = cells.corners[met[i]];
            if (boxes[i].holds(x) && !(itself && std::any_of(corners.begin(), corners.end(),
                                                             [&](std::uint32_t c) { return own[c] == node; }))) {
                side.candidates.push_back(met[i]);
            }
        }
        const auto end = static_cast<std::uint32_t>(side.candidates.size());
        if (begin == end) {
            continue;
        }
        while (known != before.end() && known->node < node) {
            ++known;
        }
        Node& entry = side.nodes.emplace_back();
        if (known != before.end() && known->node == node) {
            entry = *known;
        } else {
            entry.node = node;
        }
        entry.begin = begin;
        entry.end = end;
        if (entry.cell == kNone) {
            entry.age = 0; // cells may have come that were not there
        }
    }
}

template <class T>
bool PairContact<T>::locate(const Side& side, Node& node, const Point& x, double time_step) const {
    const WorldBody<T>& other = *side.other;
    std::optional<PlaceInCell> best;
    double beside = kBeside, nearest = std::numeric_limits<double>::infinity();
    std::uint32_t cell = kNone;
    const auto look = [&](std::uint32_t candidate) {
        const std::array<Point, 8> corners = corners_of(other, candidate);
        const double distance = distance_to(bounds_of(corners), x);
        nearest = std::min(nearest, distance);
        if (distance > kBeside * other.cells.edge) {
            return;
        }
        if (const std::optional<PlaceInCell> place = place_in_cell(corners, x)) {
            const Point& xi = place->xi;
            const double out = std::max({-xi[0], xi[0] - 1, -xi[1], xi[1] - 1, -xi[2], xi[2] - 1});
            if (out < beside) {
                beside = out;
                best = place;
                cell = candidate;
            }
        }
    };
    if (node.cell != kNone) {
        look(node.cell);
    }
    for (std::uint32_t i = node.begin; i < node.end && beside > 0; ++i) {
        if (side.candidates[i] != node.cell) {
            look(side.candidates[i]);
        }
    }
    // Out by the face that it came in by: of one that touches already, as it was; of one that does not, what it has
    // passed in this step, the faster the better. Else by the nearest.
    double least = std::numeric_limits<double>::infinity();
    if (best) {
        const Point normal_before = node.normal;
        const Point velocity =
            plus(side.body->speed(node.node), -1,
                 BodyPoint<T>{side.other, other.cells.corners[cell], trilinear_weights(best->xi), 8}.speed());
        double most = 0;
        for (std::size_t face = 0; face < 6; ++face) {
            const std::uint8_t layers = other.cells.layers[cell][face];
            if (layers == BodyCells::kDeep) {
                continue;
            }
            const std::size_t a = face / 2;
            const Point slope = {best->gradient[3 * a], best->gradient[3 * a + 1], best->gradient[3 * a + 2]};
            const double per_m = length(slope), sign = face & 1 ? 1 : -1;
            const double depth = (layers + (face & 1 ? 1 - best->xi[a] : best->xi[a])) / per_m;
            const Point normal = plus({}, sign / per_m, slope);
            const double inwards = -dot(normal, velocity), kept = dot(normal, normal_before);
            double by_it = 0; // how much says that it came in there
            if (depth < 0) {  // it is outside
                by_it = std::numeric_limits<double>::infinity();
            } else if (depth < other.cells.edge) {
                by_it = node.touches ? (kept > kTurned ? kept : 0) : (depth <= time_step * inwards ? inwards : 0);
            }
            if (by_it > most || (by_it == most && depth < least)) {
                most = by_it;
                least = depth;
                node.normal = normal;
            }
        }
    }
    if (!(least < std::numeric_limits<double>::infinity())) {
        node = Node{node.node, node.begin, node.end};
        const double way = approach() * time_step; // it may double meanwhile
        node.age = nearest > 0 && way > 0 ? std::min(kAsleep, static_cast<int>(std::min(nearest / (2 * way), 1e3)))
                                          : (nearest > 0 ? kAsleep : 0);
        return false;
    }
    node.cell = cell;
    node.age = 0;
    node.depth = least;
    node.weights = trilinear_weights(best->xi);
    return true;
}

template <class T>
void PairContact<T>::step(Side& side, double time_step, double gain) {
    const double drift = kDrift * side.other->cells.edge;
    const double follows = time_step / (spec_.friction_delay + time_step);
    for (Node& node : side.nodes) {
        if (node.cell == kNone && node.age > 0) {
            --node.age;
            continue;
        }
        const Point x = side.body->position(node.node);
        BodyPoint<T> there{side.other, {}, {}, 8};
        Point offset = {0, 0, 0}; // from the point of the cell where it was found
        const auto take_place = [&] {
            there.nodes = side.other->cells.corners[node.cell];
            there.weights = node.weights;
            offset = plus(x, -1, there.position());
        };
        if (node.cell != kNone) {
            take_place();
        }
        if (node.cell == kNone || ++node.age > kSame || dot(offset, offset) > drift * drift) {
            node.slip = plus(node.slip, 1, offset);
            if (!locate(side, node, x, time_step)) {
                continue;
            }
            take_place();
        }
        const Point& n = node.normal;
        const double depth = node.depth - dot(n, offset);
        Point mobility = there.mobility();
        for (std::size_t a = 0; a < 3; ++a) {
            mobility[a] += side.body->mobility(node.node, a);
        }
        // Of an impulse along a direction, what is gained of speed along it.
        const auto along = [&](const Point& d) {
            return d[0] * d[0] * mobility[0] + d[1] * d[1] * mobility[1] + d[2] * d[2] * mobility[2];
        };
        const double yields = along(n);
        if (!(depth > 0 && yields > 0)) {
            node.touches = false;
            node.push = 0;
            node.slip = plus({}, -1, offset); // so that it begins anew
            continue;
        }
        node.touches = true;
        const double stiffness = spec_.stiffness / yields; // N/m
        const double push = stiffness * depth / (1 + stiffness * time_step * gain * yields);
        Point force = plus({}, push, n);
        if (spec_.friction > 0) {
            node.push += (push - node.push) * (node.push > 0 ? follows : 1);
            Point slip = plus(node.slip, 1, offset);
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
            node.slip = plus(slip, -1, offset);
        }
        const Point impulse = plus({}, gain, force);
        side.body->push(node.node, impulse, time_step);
        there.push(plus({}, -1, impulse), time_step);
        const double left = depth - time_step * gain * push * yields;
        reading_.nodes += 1;
        reading_.depth = std::max(reading_.depth, left);
        reading_.greatest_depth = std::max(reading_.greatest_depth, left);
        reading_.impulse = plus(reading_.impulse, side.sign, impulse);
        reading_.force = plus(reading_.force, side.sign, force);
    }
}

template <class T>
void PairContact<T>::step(double time_step, double gain) {
    reading_.force = {0, 0, 0};
    reading_.nodes = 0;
    reading_.depth = 0;
    for (Side& side : sides_) {
        step(side, time_step, gain);
    }
}

template class PairContact<float>;
template class PairContact<double>;
template struct WorldBody<float>;
template struct WorldBody<double>;

} // namespace hybmss
