#include "solvers/newton/pressure_potential.hpp"

#include "dynamics/contact/obstacle_geometry.hpp"
#include "layouts/messages.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>

namespace hybmss {

PressureRim::PressureRim(std::span<const SurfaceFace> faces) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> known;
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
        for (std::size_t c = 0; c < 4; ++c) {
            const std::size_t next = (c + 1) % 4;
            const std::uint32_t a = faces[f].nodes[c], b = faces[f].nodes[next];
            const auto [entry, is_new] = known.try_emplace(std::minmax(a, b), edges_.size());
            if (is_new) {
                edges_.push_back({{a, b}, {faces[f].rest_positions[c], faces[f].rest_positions[next]}, {}});
            }
            Edge& edge = edges_[entry->second];
            edge.faces.push_back({f, edge.nodes[0] == a ? 1.0 : -1.0});
        }
    }
}

std::string PressureRim::find_apex(std::span<const double> pressures, std::span<const PrescribedNode> held,
                                   std::array<double, 3>& apex) const {
    std::map<std::uint32_t, std::pair<std::uint8_t, Point>> holds; // axes and displacements by node
    for (const PrescribedNode& node : held) {
        auto& [axes, displacement] = holds[node.node];
        axes = static_cast<std::uint8_t>(axes | node.axes);
        for (std::size_t a = 0; a < 3; ++a) {
            displacement[a] = node.axes >> a & 1 ? node.displacement[a] : displacement[a];
        }
    }
    std::array<std::optional<double>, 3> at = {};
    for (const Edge& edge : edges_) {
        double jump = 0, size = 0;
        for (const auto& [face, sense] : edge.faces) {
            jump += sense * pressures[face];
            size += std::abs(pressures[face]);
        }
        if (std::abs(jump) <= 1e-12 * size) {
            continue;
        }
        // Axes along which both nodes are held, and those of them along which the edge has no extent.
        unsigned both = 7, across = 0;
        Point where[2] = {edge.rest[0], edge.rest[1]};
        for (std::size_t n = 0; n < 2; ++n) {
            const auto found = holds.find(edge.nodes[n]);
            both &= found == holds.end() ? 0u : found->second.first;
            where[n] = found == holds.end() ? where[n] : plus(where[n], 1, found->second.second);
        }
        const double rounding = 1e-6 * length(plus(edge.rest[1], -1, edge.rest[0]));
        for (std::size_t a = 0; a < 3; ++a) {
            across |= (both >> a & 1) != 0 && std::abs(where[0][a] - where[1][a]) <= rounding ? 1u << a : 0u;
        }
        const auto count = [](unsigned axes) { return (axes & 1) + (axes >> 1 & 1) + (axes >> 2 & 1); };
        if (count(both) == 3 || count(across) == 2) {
            continue;
        }
        if (count(across) != 1) {
            return printed("they end at the nodes %u and %u, which are free to move there", edge.nodes[0],
                           edge.nodes[1]);
        }
        const std::size_t axis = across == 1 ? 0 : across == 2 ? 1 : 2;
        if (at[axis] && std::abs(*at[axis] - where[0][axis]) > rounding) {
            return printed(
                "they end at the nodes %u and %u at %c = %g m, and elsewhere at %c = %g m, held along %c alone",
                edge.nodes[0], edge.nodes[1], static_cast<int>('x' + axis), where[0][axis],
                static_cast<int>('x' + axis), *at[axis], static_cast<int>('x' + axis));
        }
        at[axis] = where[0][axis];
    }
    // Elsewhere near the faces, so that volumes have their digits.
    for (std::size_t a = 0; a < 3; ++a) {
        apex[a] = at[a] ? *at[a] : edges_.empty() ? 0 : edges_[0].rest[0][a];
    }
    return "";
}

namespace {

double triple(const Point& a, const Point& b, const Point& c) {
    return dot(a, cross(b, c));
}

double twelve_volumes(const FaceCorners& x) {
    const auto& [a, b, c, d] = x;
    return triple(a, b, c) + triple(a, c, d) + triple(a, b, d) + triple(b, c, d);
}

/// Visits the vector products that make up the gradient of twelve volumes: of a corner, those of two others.
template <class Visit>
void for_each_product(const Visit& visit) {
    constexpr std::array<std::array<std::size_t, 3>, 4> kTriples = {{{0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {1, 2, 3}}};
    for (const auto& [i, j, k] : kTriples) {
        visit(i, j, k);
        visit(j, k, i);
        visit(k, i, j);
    }
}

} // namespace

template <class T>
PressurePotential<T>::PressurePotential(const Body<T>& body, std::span<const SurfaceFace> faces)
    : length_unit_(body.length_unit()), rim_(faces) {
    check_faces(faces, body.node_count());
    for (const SurfaceFace& given : faces) {
        Face& face = faces_.emplace_back();
        face.rest = given.rest_positions;
        for (std::size_t c = 0; c < 4; ++c) {
            face.places[c] = body.index_of(given.nodes[c]);
            places_.push_back(face.places[c]);
        }
    }
    std::sort(places_.begin(), places_.end());
    places_.erase(std::unique(places_.begin(), places_.end()), places_.end());
    for (Face& face : faces_) {
        for (std::size_t c = 0; c < 4; ++c) {
            const auto at = std::lower_bound(places_.begin(), places_.end(), face.places[c]);
            face.nodes[c] = static_cast<std::size_t>(at - places_.begin());
        }
    }
}

template <class T>
void PressurePotential<T>::set(std::span<const double> pressures) {
    if (!pressures.empty()) {
        check_pressures(pressures, faces_.size());
    }
    acts_ = std::any_of(pressures.begin(), pressures.end(), [](double p) { return p != 0; });
    std::vector<Point> forces(places_.size(), Point{0, 0, 0});
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        faces_[f].pressure = pressures.empty() ? 0 : pressures[f];
        const FaceCorners at_rest = pressure_forces(faces_[f].rest);
        for (std::size_t c = 0; c < 4; ++c) {
            Point& force = forces[faces_[f].nodes[c]];
            force = plus(force, faces_[f].pressure, at_rest[c]);
        }
    }
    largest_force_ = 0;
    for (const Point& force : forces) {
        for (const double component : force) {
            largest_force_ = std::max(largest_force_, std::abs(component));
        }
    }
}

template <class T>
void PressurePotential<T>::set(std::span<const double> pressures, std::span<const PrescribedNode> held) {
    set(pressures);
    if (!pressures.empty()) {
        if (const std::string why = rim_.find_apex(pressures, held, apex_); !why.empty()) {
            throw std::invalid_argument("pressed faces must close, or end where they are held: " + why);
        }
    }
}

template <class T>
FaceCorners PressurePotential<T>::corners(const Face& face, const Point& from, const State<T>& state) const {
    FaceCorners x;
    for (std::size_t c = 0; c < 4; ++c) {
        for (std::size_t a = 0; a < 3; ++a) {
            const Component<const T> u = component(state.displacement, a);
            x[c][a] =
                face.rest[c][a] - from[a] +
                length_unit_ * static_cast<double>(u.first[static_cast<std::ptrdiff_t>(face.places[c]) * u.stride]);
        }
    }
    return x;
}

template <class T>
double PressurePotential<T>::value(const State<T>& state, double* size) const {
    double sum = 0;
    for (const Face& face : faces_) {
        if (face.pressure != 0) {
            FaceCorners rest = face.rest;
            for (Point& x : rest) {
                x = plus(x, -1, apex_);
            }
            const double before = twelve_volumes(rest);
            sum += face.pressure / 12 * (twelve_volumes(corners(face, apex_, state)) - before);
            if (size) {
                *size += std::abs(face.pressure / 12 * before);
            }
        }
    }
    return sum;
}

// In the order of the faces, in double: the same however often a node occurs.
template <class T>
template <class OfCorners>
void PressurePotential<T>::add_sums(const OfCorners& of_corners, NodeField<T>& field) const {
    std::vector<Point> sums(places_.size(), Point{0, 0, 0});
    for (const Face& face : faces_) {
        if (face.pressure != 0) {
            const FaceCorners added = of_corners(face);
            for (std::size_t c = 0; c < 4; ++c) {
                sums[face.nodes[c]] = plus(sums[face.nodes[c]], face.pressure, added[c]);
            }
        }
    }
    for (std::size_t n = 0; n < sums.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            const Component<T> c = component(field, a);
            c.first[static_cast<std::ptrdiff_t>(places_[n]) * c.stride] += static_cast<T>(sums[n][a]);
        }
    }
}

template <class T>
void PressurePotential<T>::add_gradient(const State<T>& state, NodeField<T>& gradient) const {
    add_sums(
        [&](const Face& face) {
            const FaceCorners x = corners(face, apex_, state);
            FaceCorners out = {};
            for_each_product([&](std::size_t i, std::size_t j, std::size_t k) {
                out[i] = plus(out[i], 1.0 / 12, cross(x[j], x[k]));
            });
            return out;
        },
        gradient);
}

template <class T>
void PressurePotential<T>::add_forces(const State<T>& state, NodeField<T>& force) const {
    add_sums([&](const Face& face) { return pressure_forces(corners(face, face.rest[0], state)); }, force);
}

template <class T>
void PressurePotential<T>::add_product(const State<T>& state, const NodeField<T>& direction,
                                       NodeField<T>& product) const {
    add_sums(
        [&](const Face& face) {
            const FaceCorners x = corners(face, apex_, state);
            FaceCorners p, out = {};
            for (std::size_t c = 0; c < 4; ++c) {
                for (std::size_t a = 0; a < 3; ++a) {
                    const Component<const T> from = component(direction, a);
                    p[c][a] =
                        static_cast<double>(from.first[static_cast<std::ptrdiff_t>(face.places[c]) * from.stride]);
                }
            }
            for_each_product([&](std::size_t i, std::size_t j, std::size_t k) {
                out[i] = plus(out[i], length_unit_ / 12, plus(cross(p[j], x[k]), 1, cross(x[j], p[k])));
            });
            return out;
        },
        product);
}

template class PressurePotential<float>;
template class PressurePotential<double>;

} // namespace hybmss
