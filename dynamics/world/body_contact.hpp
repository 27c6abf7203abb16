#pragma once

#include "dynamics/world/body_cells.hpp"
#include "hybmss/world.hpp"
#include "plan/bodies/body.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace hybmss {

/// The least box around some vectors.
struct Bounds {
    Point low, high;

    Bounds() {
        low.fill(std::numeric_limits<double>::infinity());
        high.fill(-std::numeric_limits<double>::infinity());
    }
    void include(const Point& x) {
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], x[a]);
            high[a] = std::max(high[a], x[a]);
        }
    }
    Bounds grown(double by) const {
        Bounds box = *this;
        for (std::size_t a = 0; a < 3; ++a) {
            box.low[a] -= by;
            box.high[a] += by;
        }
        return box;
    }
    /// The greatest distance between two boxes along an axis; below zero where they overlap.
    double gap(const Bounds& other) const {
        double gap = -std::numeric_limits<double>::infinity();
        for (std::size_t a = 0; a < 3; ++a) {
            gap = std::max({gap, low[a] - other.high[a], other.low[a] - high[a]});
        }
        return gap;
    }
    bool finite() const { return std::isfinite(length(low)) && std::isfinite(length(high)); }
    bool holds(const Point& x) const {
        return x[0] >= low[0] && x[0] <= high[0] && x[1] >= low[1] && x[1] <= high[1] && x[2] >= low[2] &&
               x[2] <= high[2];
    }
};

using Floats = float __attribute__((vector_size(16)));
using Doubles = double __attribute__((vector_size(16)));

/// x y z, and a fourth number that nobody asks for: in registers that SSE2, NEON and WebAssembly have.
template <class T>
struct Quad {
    /// As many as are worked on at once.
    using Part = std::conditional_t<std::is_same_v<T, float>, Floats, Doubles>;
    static constexpr std::size_t kParts = std::is_same_v<T, float> ? 1 : 2;
    std::array<Part, kParts> part = {};

    Quad() = default;
    explicit Quad(const Point& p) {
        for (std::size_t a = 0; a < 3; ++a) {
            part[a * kParts / 4][a % (4 / kParts)] = static_cast<T>(p[a]);
        }
    }
    T operator[](std::size_t a) const { return part[a * kParts / 4][a % (4 / kParts)]; }
    Point point() const {
        return {static_cast<double>((*this)[0]), static_cast<double>((*this)[1]), static_cast<double>((*this)[2])};
    }
};

/// What contacts do to some nodes of a body within a step, together in memory: where they are, and what they gain.
///
/// Bodies keep each component of a node elsewhere, and a node that touches acts on five nodes, each of which some five
/// others act on too. So they are collected when the body has taken its step, and handed back after the last contact.
template <class T>
struct Gathered {
    struct Node {
        Quad<T> moved;    ///< m, without the gain, from where it was when it came into use: as exact as the body's own
        Quad<T> gain;     ///< m/s
        Quad<T> mobility; ///< 1/kg along each axis; 0 where it is prescribed
    };
    static constexpr std::uint32_t kNone = 0xffffffff;

    std::vector<Node> nodes;
    std::vector<Point> from;           ///< of each: the displacement that it has moved from, as in the state
    std::vector<std::uint32_t> number; ///< of each: the body's node
    std::vector<std::uint32_t> users;  ///< of each: nodes that touch or may soon, that act on it; 0: it is free
    std::vector<std::uint32_t> free;   ///< numbers in `nodes`
    std::vector<std::uint32_t> where;  ///< by the body's node: in `nodes`, or kNone; empty where none ever was
};

/// A body of a world as contacts and attachments see it: where its nodes are, and what moves them.
template <class T>
struct WorldBody {
    std::array<Component<T>, 3> displacement, velocity; ///< of its state, by index
    double length_unit = 1;
    std::vector<Point> rest;          ///< m, by node
    std::vector<std::uint32_t> index; ///< by node: where it is in the state
    std::vector<double> inverse_mass; ///< 1/kg by node; 0 where it has no cell any more
    std::vector<std::uint8_t> held;   ///< by node: axes that are prescribed, as bits; empty where none is
    BodyCells cells;
    Gathered<T> gathered;
    double gathered_step = 0; ///< s: the step that `gathered` is of
    double work = 0;          ///< J that contacts have done on it
    // At the last look:
    Bounds box, speeds;             ///< of the surface, m and m/s
    std::vector<Point> places;      ///< m, of the surface's nodes
    std::vector<Bounds> cell_boxes; ///< of the outer cells, where they have been asked for

    /// With what it has gained in this step.
    Point position(std::uint32_t node) const {
        return plus(plus(rest[node], length_unit, read(displacement, node)), gathered_step, gain(node));
    }
    Point speed(std::uint32_t node) const { return plus(gain(node), length_unit, read(velocity, node)); }
    /// 1/kg along an axis.
    double mobility(std::uint32_t node, std::size_t axis) const {
        return !held.empty() && (held[node] >> axis & 1) ? 0 : inverse_mass[node];
    }
    Point mobility(std::uint32_t node) const { return {mobility(node, 0), mobility(node, 1), mobility(node, 2)}; }
    /// By an impulse, N s, at the end of a step.
    void push(std::uint32_t node, const Point& impulse, double time_step) {
        Point gain;
        for (std::size_t a = 0; a < 3; ++a) {
            gain[a] = impulse[a] * mobility(node, a);
        }
        add(node, gain, time_step);
    }
    /// Finds box, speeds and places.
    void look();
    void find_cell_boxes();

    /// The node's number in `gathered`, for one more user.
    std::uint32_t use(std::uint32_t node);
    void let_go(std::uint32_t gathered_node) { --gathered.users[gathered_node]; }
    /// After a step of the body: reads where the nodes in use are.
    void gather(double time_step);
    /// Makes the mobilities of the nodes in use those of now.
    void weigh_gathered();
    /// Gives the body what its nodes gained.
    void scatter();

private:
    static constexpr std::uint32_t kNone = Gathered<T>::kNone;

    Point gain(std::uint32_t node) const {
        const std::uint32_t g = gathered.where.empty() ? kNone : gathered.where[node];
        return g == kNone ? Point{0, 0, 0} : gathered.nodes[g].gain.point();
    }
    void add(std::uint32_t node, const Point& gain, double time_step) {
        const auto i = static_cast<std::ptrdiff_t>(index[node]);
        for (std::size_t a = 0; a < 3; ++a) {
            velocity[a].first[i * velocity[a].stride] += static_cast<T>(gain[a] / length_unit);
            displacement[a].first[i * displacement[a].stride] += static_cast<T>(time_step * gain[a] / length_unit);
        }
    }
    Point read(const std::array<Component<T>, 3>& field, std::uint32_t node) const {
        const auto i = static_cast<std::ptrdiff_t>(index[node]);
        return {static_cast<double>(field[0].first[i * field[0].stride]),
                static_cast<double>(field[1].first[i * field[1].stride]),
                static_cast<double>(field[2].first[i * field[2].stride])};
    }
};

/// Some nodes of a body by weights whose sum is 1: a point that goes with it. `body` null: a point in space.
template <class T>
struct BodyPoint {
    WorldBody<T>* body = nullptr;
    std::array<std::uint32_t, 8> nodes = {};
    std::array<double, 8> weights = {};
    std::size_t count = 0;

    Point position() const {
        return sum([&](std::uint32_t n) { return body->position(n); });
    }
    Point speed() const {
        return sum([&](std::uint32_t n) { return body->speed(n); });
    }
    /// What it gains of speed along each axis by an impulse of 1, 1/kg.
    Point mobility() const {
        Point out = {0, 0, 0};
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t a = 0; a < 3; ++a) {
                out[a] += weights[i] * weights[i] * body->mobility(nodes[i], a);
            }
        }
        return out;
    }
    /// Likewise by an impulse of 1 at another point of the body.
    Point mobility_with(const BodyPoint& other) const {
        Point out = {0, 0, 0};
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t j = 0; j < other.count; ++j) {
                for (std::size_t a = 0; nodes[i] == other.nodes[j] && a < 3; ++a) {
                    out[a] += weights[i] * other.weights[j] * body->mobility(nodes[i], a);
                }
            }
        }
        return out;
    }
    /// Leaves out what has no mass any more. Returns whether something is left, or it is in space.
    bool keep_mass() {
        std::size_t kept = 0;
        double sum = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (body->inverse_mass[nodes[i]] > 0 && weights[i] > 0) {
                nodes[kept] = nodes[i];
                weights[kept++] = weights[i];
                sum += weights[i];
            }
        }
        for (std::size_t i = 0; i < kept; ++i) {
            weights[i] /= sum;
        }
        count = kept;
        return !body || count > 0;
    }
    void push(const Point& impulse, double time_step) const {
        for (std::size_t i = 0; i < count; ++i) {
            body->push(nodes[i], plus({}, weights[i], impulse), time_step);
        }
    }

private:
    template <class Value>
    Point sum(const Value& value) const {
        Point out = {0, 0, 0};
        for (std::size_t i = 0; i < count; ++i) {
            out = plus(out, weights[i], value(nodes[i]));
        }
        return out;
    }
};

/// Contact of two bodies, or of one with itself: of surface nodes of each with cells of the other.
///
/// Which cells a node may meet is found at times, within a reach that the bodies cannot pass meanwhile. Of those it is
/// in one at most. The depth of a node in a cell, from the nearest free face along the axes at rest, is taken to be
/// linear in the motion of the node against the point of the cell where it was found, or of the face where it was
/// hardly below, until one of the two may have gone on by a part of a cell; the force acts between the two. Depth that
/// comes all at once, of bodies that overlap or cells that are inside out, pushes little by little. Friction is a
/// spring along the surface, as stiff as contact, that is let out where it would pull more than Coulomb's law allows:
/// what sticks does not creep. Nodes act one after the other, each on what those before it left: so none pushes for
/// another, and no number of them makes a step unstable.
template <class T>
class PairContact {
public:
    /// `spec`: complete, valid. The bodies outlive it, where they are.
    PairContact(const BodyContact& spec, WorldBody<T>& first, WorldBody<T>& second);

    const BodyContact& spec() const { return spec_; }
    bool near() const { return !sides_[0].nodes.empty() || !sides_[1].nodes.empty(); }
    /// m/s at most at which a node and a cell come nearer, by the bodies' speeds at the last look.
    double approach() const;
    /// m by which the bodies are apart, at the last look; below zero where they may touch.
    double gap() const;
    /// The bodies have had `way` to come nearer, m.
    void spend(double way) { travelled_ += way; }
    /// m that the bodies may still come nearer before what they may meet must be found anew.
    double reach() const { return reach_ - travelled_; }
    /// How far to look, to have some steps of `way` m each.
    double margin(double way) const;
    /// Finds what nodes may meet while the bodies come nearer by the margin. After a look at the bodies; where gap() is
    /// below the margin, they must have their cells' boxes.
    void find(double margin);
    /// Ends a step, in which the bodies have been gathered. `gain`: of velocity by acceleration.
    /// `since`: m that they may have come nearer since the last look; `way`: in this step.
    void step(double time_step, double gain, double since, double way);
    /// The bodies have been moved or held in another way from outside: what may be met is to be found anew.
    void look_again();
    /// They have been set or cut.
    void forget();
    const BodyContactReading& reading() const { return reading_; }
    /// J in its springs, at the end of the last step.
    double energy() const;

private:
    static constexpr std::uint32_t kNone = 0xffffffff;

    /// A node near the other body.
    struct Near {
        std::uint32_t node;
        std::uint32_t begin, end; ///< of its candidates
        /// m that the bodies travel since they were found before it meets one; infinite where it is in one.
        float clear;
    };
    /// A cell that a node may meet.
    struct Candidate {
        std::uint32_t cell;
        float distance; ///< m, along an axis at least, when it was found
    };
    /// A node in a cell, or hardly beside one.
    struct Touch {
        std::uint32_t near; ///< of its side
        std::uint32_t cell;
        // Where it was found:
        std::uint32_t node;                   ///< as gathered, as are
        std::uint32_t corner_count;           ///< 4 of the face where it is hardly below, or 8
        std::array<std::uint32_t, 8> corners; ///< whatever they are beyond the count
        std::array<T, 8> weights;             ///< of the corners
        Quad<T> start;                        ///< m: by what the node has moved from that point
        Quad<T> normal;                       ///< the way out
        Quad<T> mobility;                     ///< 1/kg along each axis, of the node and that point against each other
        T stiffness;                          ///< N/m; 0 where neither yields
        T depth;                              ///< m
        float found_at;                       ///< m that the bodies had travelled
        // What outlives that it is found anew:
        bool touches = false; ///< in the last step
        T pressed = 0;        ///< m: depth that pushed in the last step
        T forgiven = 0;       ///< m: depth that does not push yet
        T push = 0;           ///< N, mean of the force with a delay, for friction
        T left = 0;           ///< m: of depth, after the last step; 0 where it touches nothing
        Quad<T> slip = {};    ///< m, of a node that sticks, from where it was found: what friction holds by
    };
    struct Side {
        WorldBody<T>* body;  ///< whose nodes
        WorldBody<T>* other; ///< whose cells
        double sign;         ///< of its forces in the reading; a body on itself: 0, as they cancel
        std::vector<Near> nodes = {};
        std::vector<Candidate> candidates = {}; ///< ascending for each node
        std::vector<Touch> touching = {};       ///< ascending by node, but for those that came since the last look
        double clear = 0;                       ///< m: the least of the nodes'
    };

    static constexpr double kDrift = 0.02; ///< of a cell's edge, by which a node may leave the place where it was found
    /// Likewise, by which it or a face may have moved or turned unseen; in fewer steps than these they have not.
    static constexpr double kTravels = 0.05, kSame = 16;
    static constexpr double kBeside = 0.1; ///< of a cell: a node beside it is still followed
    /// Cosine of what a face may turn by while a node touches it.
    static constexpr double kTurned = 0.7;

    void clear_reading();
    void let_go(Side& side, const Touch& touch) const;
    void let_go_of_all();
    void find(Side& side, double margin) const;
    void step(Side& side, double time_step, double gain, double travelled, double way);
    /// Nodes that may have come into a cell.
    void meet(Side& side, double time_step, double travelled);
    struct Found {
        std::uint32_t cell = kNone;
        PlaceInCell place = {};
    };
    /// `last`: where it was.
    Found cell_at(const Side& side, Near& node, std::uint32_t last, const Point& x, double travelled) const;
    /// Finds the node's cell and place, and the way out; false where it is in none, and the touch is over.
    bool locate(Side& side, Touch& touch, double time_step, double travelled) const;

    BodyContact spec_;
    std::array<Side, 2> sides_; ///< the second without nodes where a body touches itself
    double reach_ = 0;          ///< m that what was found last is good for
    double travelled_ = 0;      ///< m since then, up to the last look
    BodyContactReading reading_;
};

extern template class PairContact<float>;
extern template class PairContact<double>;
extern template struct WorldBody<float>;
extern template struct WorldBody<double>;

} // namespace hybmss
