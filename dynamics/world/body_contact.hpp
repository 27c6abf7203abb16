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
    // At the last look:
    Bounds box, speeds;             ///< of the surface, m and m/s
    std::vector<Point> places;      ///< m, of the surface's nodes
    std::vector<Bounds> cell_boxes; ///< of the outer cells, where they have been asked for

    Point position(std::uint32_t node) const { return plus(rest[node], length_unit, read(displacement, node)); }
    Point speed(std::uint32_t node) const { return plus({}, length_unit, read(velocity, node)); }
    /// 1/kg along an axis.
    double mobility(std::uint32_t node, std::size_t axis) const {
        return !held.empty() && (held[node] >> axis & 1) ? 0 : inverse_mass[node];
    }
    /// By an impulse, N s, at the end of a step.
    void push(std::uint32_t node, const Point& impulse, double time_step) {
        const auto i = static_cast<std::ptrdiff_t>(index[node]);
        for (std::size_t a = 0; a < 3; ++a) {
            const double gain = impulse[a] * mobility(node, a) / length_unit;
            velocity[a].first[i * velocity[a].stride] += static_cast<T>(gain);
            displacement[a].first[i * displacement[a].stride] += static_cast<T>(time_step * gain);
        }
    }
    /// Finds box, speeds and places.
    void look();
    void find_cell_boxes();

private:
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
/// linear in the motion of the node against the point of the cell where it was found, until it has gone on by a part of
/// a cell. Depth that comes all at once, of bodies that overlap or cells that are inside out, pushes little by little.
/// Friction is a spring along the surface, as stiff as contact, that is let out where it would pull more than
/// Coulomb's law allows: what sticks does not creep. Nodes act one after the other, each on what those before it left:
/// so none pushes for another, and no number of them makes a step unstable.
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
    /// Ends a step. `gain`: of velocity by acceleration.
    /// `since`: m that they may have come nearer since the last look.
    void step(double time_step, double gain, double since);
    /// The bodies have been moved or held in another way from outside: what may be met is to be found anew.
    void look_again();
    /// They have been set or cut.
    void forget();
    const BodyContactReading& reading() const { return reading_; }

private:
    /// A node near the other body.
    struct Node {
        std::uint32_t node;
        std::uint32_t begin, end;                ///< of its candidates
        std::uint32_t cell = kNone;              ///< where it was found last
        float clear = 0;                         ///< m that the bodies travel before it meets one
        int age = 0;                             ///< steps since it was found
        bool touches = false;                    ///< in the last step
        std::array<std::uint8_t, 9> held = {};   ///< axes that are, of the cell's corners and the node
        std::array<std::uint32_t, 9> index = {}; ///< theirs
        std::array<T, 9> weights = {};           ///< where it was found; the node's own is -1
        std::array<T, 9> gains = {};             ///< of speed by its impulse, in units of length by kg m
        Point rest = {0, 0, 0};                  ///< m: of the node less that point of the cell
        Point mobility = {0, 0, 0}; ///< 1/kg along each axis, of the node and that point against each other
        Point normal = {0, 0, 0};   ///< the way out, then
        double depth = 0;           ///< m, then
        double pressed = 0;         ///< m: depth that pushed in the last step
        double forgiven = 0;        ///< m: depth that does not push yet
        double push = 0;            ///< N, mean of the force with a delay, for friction
        Point slip = {0, 0, 0};     ///< m, of a node that sticks, from where it was found: what friction holds by
    };
    /// A cell that a node may meet.
    struct Candidate {
        std::uint32_t cell;
        float distance; ///< m, along an axis at least, when it was found
    };
    struct Side {
        WorldBody<T>* body;  ///< whose nodes
        WorldBody<T>* other; ///< whose cells
        double sign;         ///< of its forces in the reading; a body on itself: 0, as they cancel
        std::vector<Node> nodes;
        std::vector<Candidate> candidates; ///< ascending for each node
    };

    static constexpr std::uint32_t kNone = 0xffffffff;
    static constexpr int kSame = 16;       ///< steps at most in which a node keeps its place in a cell
    static constexpr double kDrift = 0.02; ///< of a cell's edge, likewise
    static constexpr double kBeside = 0.1; ///< of a cell: a node beside it is still followed

    /// Cosine of what a face may turn by while a node touches it.
    static constexpr double kTurned = 0.7;

    void clear_reading();
    void find(Side& side, double margin) const;
    void step(Side& side, double time_step, double gain, double travelled);
    struct Found {
        std::uint32_t cell = kNone;
        PlaceInCell place = {};
    };
    Found cell_at(const Side& side, Node& node, const Point& x, double travelled) const;
    /// m, of a node from the point of its cell where it was found.
    Point offset(const Side& side, const Node& node) const;
    /// Makes it known how an impulse at this place acts.
    void take_place(const Side& side, Node& node, const std::array<double, 8>& weights) const;
    /// Finds the node's cell and place, and the way out; false where it is in none.
    bool locate(const Side& side, Node& node, const Point& x, double time_step, double travelled) const;

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
