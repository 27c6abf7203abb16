// How rigid obstacles with mass move: the velocities after a step in which nodes push them, and inertia of shapes.
#include "dynamics/contact/free_obstacle.hpp"

#include "layouts/messages.hpp"

#include <stdexcept>
#include <utility>

namespace hybmss {
namespace {

using Six = std::array<double, 6>;

/// Of six equations, row by row; by Gauss with pivots. False where they have no one solution.
bool solve_six(std::array<Six, 6> matrix, Six right, Six& solution) {
    for (std::size_t c = 0; c < 6; ++c) {
        std::size_t pivot = c;
        for (std::size_t r = c + 1; r < 6; ++r) {
            pivot = std::abs(matrix[r][c]) > std::abs(matrix[pivot][c]) ? r : pivot;
        }
        if (!(std::abs(matrix[pivot][c]) > 0)) {
            return false;
        }
        std::swap(matrix[c], matrix[pivot]);
        std::swap(right[c], right[pivot]);
        for (std::size_t r = c + 1; r < 6; ++r) {
            const double factor = matrix[r][c] / matrix[c][c];
            for (std::size_t k = c; k < 6; ++k) {
                matrix[r][k] -= factor * matrix[c][k];
            }
            right[r] -= factor * right[c];
        }
    }
    for (std::size_t c = 6; c-- > 0;) {
        double sum = right[c];
        for (std::size_t k = c + 1; k < 6; ++k) {
            sum -= matrix[c][k] * solution[k];
        }
        solution[c] = sum / matrix[c][c];
    }
    return true;
}

/// m += factor a b^T
void add_product(double factor, const Point& a, const Point& b, Matrix& m) {
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
            m[3 * r + c] += factor * a[r] * b[c];
        }
    }
}

Point turned_by_inertia(const Obstacle& obstacle, const Matrix& rotation, const Point& spin) {
    Point own = from_space(rotation, spin);
    for (std::size_t a = 0; a < 3; ++a) {
        own[a] /= obstacle.inertia[a];
    }
    return to_space(rotation, own);
}

} // namespace

FreeObstacle::FreeObstacle(const Obstacle& obstacle, const FreeMotion& before, double time_step, double acting,
                           const Point& gravity)
    : obstacle_(obstacle), before_(before), time_step_(time_step),
      weight_impulse_(plus({0, 0, 0}, obstacle.mass * acting, gravity)), unpushed_(before.pose) {
    unpushed_.velocity = plus(before.pose.velocity, 1 / obstacle.mass, weight_impulse_);
    unpushed_.angular_velocity = turned_by(before.spin);
    unpushed_.position = plus(before.pose.position, time_step, unpushed_.velocity);
    unpushed_.rotation = turned(before.pose.rotation, plus({0, 0, 0}, time_step, unpushed_.angular_velocity));
}

Point FreeObstacle::turned_by(const Point& spin) const {
    return turned_by_inertia(obstacle_, before_.pose.rotation, spin);
}

Point FreeObstacle::spin_of(const Point& turn) const {
    Point own = from_space(before_.pose.rotation, turn);
    for (std::size_t a = 0; a < 3; ++a) {
        own[a] *= obstacle_.inertia[a];
    }
    return to_space(before_.pose.rotation, own);
}

/// As Contact has it for an obstacle that is led.
Matrix FreeObstacle::respond(FreeTouch& touch, const Change& change) {
    const Point& n = touch.normal;
    const Point moved = plus(change.velocity, 1, cross(change.turn, touch.arm));
    const double depth = touch.depth + touch.time_step * touch.slope * dot(n, moved);
    const double would_be = std::max(depth, 0.0), stiffness = touch.stiffness * touch.slope;
    const double yields = stiffness / (1 + stiffness * touch.way);
    double by_depth = depth > 0 ? yields : 0;
    touch.push = yields * would_be;
    if (touch.way > 0) {
        const SurfaceDistance surface{-depth, n, touch.slope};
        if (const double stop = stopping_push(surface, would_be - touch.stopped, touch.way); stop > touch.push) {
            by_depth = depth > 0 ? stopping_push(surface, 1, touch.way) : 0;
            touch.push = stop;
        }
    }
    touch.end_depth = std::max(would_be - touch.way * touch.push, 0.0);
    const double by_speed = by_depth * touch.time_step * touch.slope;
    Matrix derivatives{};
    add_product(by_speed, n, n, derivatives);
    touch.grip = touch.push_before;
    touch.rubbed = {0, 0, 0};
    if (!(touch.friction > 0) || !(touch.push > 0)) {
        return derivatives;
    }
    const bool first = !(touch.push_before > 0);
    touch.grip = first ? touch.push : touch.push_before + (touch.push - touch.push_before) * touch.follows;
    const Point v = plus(touch.velocity, -1, moved), along = plus(v, -dot(v, n), n);
    const double speed = length(along), most = touch.friction * touch.grip;
    if (speed <= most * touch.gain) {
        touch.rubbed = plus({0, 0, 0}, -1 / touch.gain, along);
        for (std::size_t a = 0; a < 3; ++a) {
            derivatives[4 * a] += 1 / touch.gain;
        }
        add_product(-1 / touch.gain, n, n, derivatives);
        return derivatives;
    }
    const Point t = plus({0, 0, 0}, 1 / speed, along);
    touch.rubbed = plus({0, 0, 0}, -most, t);
    const double across = most / speed;
    for (std::size_t a = 0; a < 3; ++a) {
        derivatives[4 * a] += across;
    }
    add_product(-across, n, n, derivatives);
    add_product(-across, t, t, derivatives);
    add_product(-touch.friction * (first ? 1 : touch.follows) * by_speed, t, n, derivatives);
    return derivatives;
}

void FreeObstacle::solve(std::span<FreeTouch> touches) {
    if (touches.empty()) {
        return;
    }
    constexpr int kMost = 60; // steps, those that are taken back too
    constexpr double kEnough = 1e-13;
    const double size =
        std::sqrt(std::max({obstacle_.inertia[0], obstacle_.inertia[1], obstacle_.inertia[2]}) / obstacle_.mass);
    Six step{};
    double part = 1, error_before = std::numeric_limits<double>::infinity();
    const auto go = [&](double factor) {
        for (std::size_t a = 0; a < 3; ++a) {
            change_.velocity[a] += factor * step[a];
            change_.turn[a] += factor * step[3 + a];
        }
    };
    for (int iteration = 0; iteration < kMost; ++iteration) {
        std::array<Six, 6> matrix{};
        Six right{};
        const Point spin = spin_of(change_.turn);
        for (std::size_t a = 0; a < 3; ++a) {
            Point axis = {0, 0, 0};
            axis[a] = 1;
            const Point column = spin_of(axis);
            matrix[a][a] = obstacle_.mass;
            right[a] = -obstacle_.mass * change_.velocity[a];
            right[3 + a] = -spin[a];
            for (std::size_t b = 0; b < 3; ++b) {
                matrix[3 + b][3 + a] = column[b];
            }
        }
        for (FreeTouch& touch : touches) {
            const Matrix derivatives = respond(touch, change_);
            if (!(touch.push > 0)) {
                continue;
            }
            const double factor = touch.mass * touch.acting;
            const Point impulse = plus(plus({0, 0, 0}, factor * touch.push, touch.normal), factor, touch.rubbed);
            const Point moment = cross(touch.arm, impulse);
            for (std::size_t a = 0; a < 3; ++a) {
                right[a] -= impulse[a];
                right[3 + a] -= moment[a];
            }
            for (std::size_t c = 0; c < 6; ++c) {
                Point axis = {0, 0, 0};
                axis[c % 3] = factor;
                const Point by = to_space(derivatives, c < 3 ? axis : cross(axis, touch.arm));
                const Point about = cross(touch.arm, by);
                for (std::size_t a = 0; a < 3; ++a) {
                    matrix[a][c] += by[a];
                    matrix[3 + a][c] += about[a];
                }
            }
        }
        double error = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            error += right[a] * right[a] + right[3 + a] * right[3 + a] / (size * size);
        }
        // Where nodes change between sticking, slipping and no touch, a whole step may lead away.
        if (error > error_before && part > 1e-3) {
            go(-part / 2);
            part /= 2;
            continue;
        }
        error_before = error;
        if (!solve_six(matrix, right, step)) {
            break;
        }
        part = 1;
        go(part);
        double way = 0, whole = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            way = std::max({way, std::abs(step[a]), size * std::abs(step[3 + a])});
            whole = std::max({whole, std::abs(change_.velocity[a]), size * std::abs(change_.turn[a])});
        }
        if (way <= kEnough * whole) {
            break;
        }
    }
    // The momenta by the very impulses that the nodes get.
    Point impulse = {0, 0, 0}, moment = {0, 0, 0};
    for (FreeTouch& touch : touches) {
        respond(touch, change_);
        const double factor = touch.mass * touch.acting;
        const Point one = plus(plus({0, 0, 0}, factor * touch.push, touch.normal), factor, touch.rubbed);
        impulse = plus(impulse, 1, one);
        moment = plus(moment, 1, cross(touch.arm, one));
    }
    change_.velocity = plus({0, 0, 0}, -1 / obstacle_.mass, impulse);
    change_.turn = plus({0, 0, 0}, -1, turned_by(moment));
}

Point FreeObstacle::mean_velocity(const Point& arm) const {
    const auto mean = [](const Point& a, const Point& b) { return plus(plus({0, 0, 0}, 0.5, a), 0.5, b); };
    const Point velocity = mean(before_.pose.velocity, plus(unpushed_.velocity, 1, change_.velocity));
    const Point turn = plus(unpushed_.angular_velocity, 0.5, change_.turn);
    return plus(velocity, 1, cross(turn, arm));
}

double FreeObstacle::faster() const {
    return length(weight_impulse_) / obstacle_.mass + length(change_.velocity);
}

FreeMotion FreeObstacle::after() const {
    FreeMotion end = before_;
    end.spin = plus(before_.spin, 1, spin_of(change_.turn));
    end.pose.velocity = plus(unpushed_.velocity, 1, change_.velocity);
    end.pose.position = plus(before_.pose.position, time_step_, end.pose.velocity);
    Point turn = turned_by(end.spin);
    const Matrix& was = before_.pose.rotation;
    const Point& inertia = obstacle_.inertia;
    if (inertia[0] != inertia[1] || inertia[1] != inertia[2]) { // by the rotation half way: of the second order
        turn = turned_by_inertia(obstacle_, turned(was, plus({0, 0, 0}, time_step_ / 2, turn)), end.spin);
    }
    end.pose.rotation = turned(was, plus({0, 0, 0}, time_step_, turn));
    end.pose.angular_velocity = turned_by_inertia(obstacle_, end.pose.rotation, end.spin);
    end.work_of_gravity +=
        0.5 * (dot(weight_impulse_, before_.pose.velocity) + dot(weight_impulse_, end.pose.velocity));
    return end;
}

FreeMotion kicked(const Obstacle& obstacle, FreeMotion motion, double seconds, const Point& force,
                  const Point& torque) {
    motion.pose.velocity = plus(motion.pose.velocity, seconds / obstacle.mass, force);
    motion.spin = plus(motion.spin, seconds, torque);
    motion.pose.angular_velocity = turned_by_inertia(obstacle, motion.pose.rotation, motion.spin);
    return motion;
}

namespace {

[[noreturn]] void refuse_inertia(std::size_t number, const std::string& what) {
    throw std::invalid_argument("obstacle " + std::to_string(number) + ": " + what);
}

/// Of what triangles enclose, by the tetrahedra from the origin: the covariance of a tetrahedron of the volume v is
/// v/20 (sum of its corners' squares + the square of their sum).
Point inertia_within(std::span<const std::array<Point, 3>> triangles, double mass, std::size_t number) {
    double volume = 0, extent = 0;
    Point moment = {0, 0, 0};
    Matrix squares{};
    for (const auto& corners : triangles) {
        const double v = dot(corners[0], cross(corners[1], corners[2])) / 6;
        Point sum = {0, 0, 0};
        for (const Point& x : corners) {
            extent = std::max(extent, length(x));
            sum = plus(sum, 1, x);
            add_product(v / 20, x, x, squares);
        }
        add_product(v / 20, sum, sum, squares);
        moment = plus(moment, v / 4, sum);
        volume += v;
    }
    if (volume < 0) { // its triangles turn the other way
        volume = -volume;
        moment = plus({0, 0, 0}, -1, moment);
        for (double& square : squares) {
            square = -square;
        }
    }
    const double small = 1e-6 * extent;
    if (length(moment) > small * volume) {
        refuse_inertia(number,
                       printed("its centre of mass is at (%g, %g, %g) m in its own axes: a free one's points are "
                               "about it, or its inertia is given",
                               moment[0] / volume, moment[1] / volume, moment[2] / volume));
    }
    if (std::abs(squares[1]) + std::abs(squares[2]) + std::abs(squares[5]) > small * extent * volume) {
        refuse_inertia(number, "its axes are not the principal ones of its shape: a free one's are, or its inertia is "
                               "given");
    }
    const double density = mass / volume;
    return {density * (squares[4] + squares[8]), density * (squares[8] + squares[0]),
            density * (squares[0] + squares[4])};
}

} // namespace

Point inertia_of(const ObstacleShape& shape, double mass, std::size_t number) {
    if (const auto* sphere = std::get_if<SphereShape>(&shape)) {
        const double all = 0.4 * mass * sphere->radius * sphere->radius;
        return {all, all, all};
    }
    if (const auto* box = std::get_if<BoxShape>(&shape)) {
        const auto [a, b, c] = box->size;
        return {mass / 12 * (b * b + c * c), mass / 12 * (c * c + a * a), mass / 12 * (a * a + b * b)};
    }
    if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
        const double l = length(capsule->axis), r = capsule->radius;
        const double rod = mass * l / (l + 4 * r / 3), ends = mass - rod;
        const double across = rod * (l * l / 12 + r * r / 4) + ends * (0.4 * r * r + l * l / 4 + 3 * l * r / 8);
        Point inertia = {across, across, across};
        for (std::size_t a = 0; a < 3; ++a) {
            if (std::abs(capsule->axis[a]) == l) {
                inertia[a] = rod * r * r / 2 + ends * 0.4 * r * r;
                return inertia;
            }
        }
        refuse_inertia(number, "the axis of a free capsule must be along one of the obstacle's axes, or its inertia "
                               "given");
    }
    const std::vector<std::array<Point, 3>> triangles = triangles_of(shape);
    if (triangles.empty()) {
        refuse_inertia(number, "its inertia must be given: it has no volume of its own");
    }
    return inertia_within(triangles, mass, number);
}

} // namespace hybmss
