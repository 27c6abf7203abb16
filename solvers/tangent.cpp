#include "solvers/tangent.hpp"

#include "layouts/rest_shape.hpp"
#include "solvers/volume_derivatives.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

double side(std::size_t corner, std::size_t axis) {
    return corner >> axis & 1 ? 1.0 : -1.0;
}

template <class A, class B, class C>
void cross(const A* a, const B* b, C* out) {
    out[0] = static_cast<C>(a[1] * b[2] - a[2] * b[1]);
    out[1] = static_cast<C>(a[2] * b[0] - a[0] * b[2]);
    out[2] = static_cast<C>(a[0] * b[1] - a[1] * b[0]);
}

template <class T>
struct Places {
    Component<T> c[3];
    T& operator()(std::size_t place, std::size_t axis) const {
        return c[axis].first[static_cast<std::ptrdiff_t>(place) * c[axis].stride];
    }
};
template <class T>
Places<T> places(NodeField<T>& field) {
    return {{component(field, 0), component(field, 1), component(field, 2)}};
}
template <class T>
Places<const T> places(const NodeField<T>& field) {
    return {{component(field, 0), component(field, 1), component(field, 2)}};
}

} // namespace

template <class T>
Tangent<T>::Tangent(const Body<T>& body, Network network) : body_(&body), network_(std::move(network)) {
    place_.resize(body.node_count());
    for (std::size_t n = 0; n < place_.size(); ++n) {
        place_[n] = static_cast<std::uint32_t>(body.index_of(n));
    }
    const auto place = [&](std::int32_t node) { return place_[static_cast<std::size_t>(node)]; };
    for (const Network::Spring& s : network_.springs) {
        springs_.push_back({place(s.a), place(s.b), {}, {}});
    }
    for (const Network::Cell& cell : network_.cells) {
        const RestShape rest = rest_shape(network_, cell);
        rest_edges_.push_back(rest.edges);
        rest_volume_.push_back(rest.volume);
        Cell c{};
        std::transform(cell.nodes.begin(), cell.nodes.end(), c.nodes.begin(), place);
        cells_.push_back(c);
    }
}

template <class T>
void Tangent<T>::linearise(const State<T>& state) {
    const Places<const T> u = places(state.displacement);
    const double unit = body_->length_unit();
    for (std::size_t s = 0; s < springs_.size(); ++s) {
        const Network::Spring& spring = network_.springs[s];
        double d[3], square = 0, rest = 0, q = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double r = spring.rest_vector[c];
            const double du =
                unit * (static_cast<double>(u(springs_[s].b, c)) - static_cast<double>(u(springs_[s].a, c)));
            d[c] = r + du;
            square += d[c] * d[c];
            rest += r * r;
            q += du * (2 * r + du);
        }
        square = std::max(square, 1e-12 * rest);
        const double k = spring.stiffness * unit, length = std::sqrt(square);
        // q / (|d|^2 + l |d|)
        const double t = q / (square + std::sqrt(rest) * length);
        const double axial = (1 - t) / square;
        std::size_t entry = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = i; j < 3; ++j, ++entry) {
                springs_[s].block[entry] = static_cast<T>(k * ((i == j ? t : 0) + axial * d[i] * d[j]));
                springs_[s].convex[entry] =
                    static_cast<T>(k * ((i == j ? std::max(t, 0.0) : 0) + std::min(axial, 1 / square) * d[i] * d[j]));
            }
        }
    }
    for (std::size_t n = 0; n < cells_.size(); ++n) {
        Cell& cell = cells_[n];
        const std::array<double, 9>& rest = rest_edges_[n];
        double change[9] = {};
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (std::size_t e = 0; e < 9; ++e) {
                change[e] += side(corner, e / 3) / 4 * unit * static_cast<double>(u(cell.nodes[corner], e % 3));
            }
        }
        double edges[9], gradient[9], rest_area[3];
        for (std::size_t e = 0; e < 9; ++e) {
            edges[e] = rest[e] + change[e];
        }
        for (std::size_t e = 0; e < 3; ++e) {
            cross(edges + 3 * ((e + 1) % 3), edges + 3 * ((e + 2) % 3), gradient + 3 * e);
        }
        // V0 j = da . (b x c) + a0 . (db x c) + a0 . (b0 x dc)
        const auto dot = [](const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
        double middle[3];
        cross(change + 3, edges + 6, middle);
        cross(rest.data() + 3, change + 6, rest_area);
        const double j =
            (dot(change, gradient) + dot(rest.data(), middle) + dot(rest.data(), rest_area)) / rest_volume_[n];
        const VolumeDerivatives phi = volume_derivatives(network_.volume_energy, j);
        const double kappa = network_.cells[n].kappa;
        cell.curvature = static_cast<T>(kappa * phi.second / rest_volume_[n] * unit);
        cell.slope = static_cast<T>(kappa * phi.first * unit);
        for (std::size_t e = 0; e < 9; ++e) {
            cell.edges[e] = static_cast<T>(edges[e]);
            cell.gradient[e] = static_cast<T>(gradient[e]);
        }
    }
}

template <class T>
void Tangent<T>::multiply(const NodeVector<T>& p, NodeVector<T>& out) const {
    for (auto& array : out.field) {
        std::fill_n(array.data(), array.size(), T(0));
    }
    const Places<const T> in = places(p.field);
    const Places<T> to = places(out.field);
    for (const Spring& s : springs_) {
        const T x = in(s.b, 0) - in(s.a, 0), y = in(s.b, 1) - in(s.a, 1), z = in(s.b, 2) - in(s.a, 2);
        const Symmetric3<T>& k = s.block;
        const T f[3] = {k[0] * x + k[1] * y + k[2] * z, k[1] * x + k[3] * y + k[4] * z, k[2] * x + k[4] * y + k[5] * z};
        for (std::size_t c = 0; c < 3; ++c) {
            to(s.b, c) += f[c];
            to(s.a, c) -= f[c];
        }
    }
    for (const Cell& cell : cells_) {
        T change[9] = {};
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const T sign = static_cast<T>(side(corner, axis) / 4);
                for (std::size_t c = 0; c < 3; ++c) {
                    change[3 * axis + c] += sign * in(cell.nodes[corner], c);
                }
            }
        }
        T volume_change = 0;
        for (std::size_t e = 0; e < 9; ++e) {
            volume_change += cell.gradient[e] * change[e];
        }
        // By edge: curvature (g . dp) g + slope d(g)
        T response[9];
        for (std::size_t e = 0; e < 3; ++e) {
            const std::size_t f = 3 * ((e + 1) % 3), g = 3 * ((e + 2) % 3);
            T first[3], second[3];
            cross(change + f, cell.edges.data() + g, first);
            cross(cell.edges.data() + f, change + g, second);
            for (std::size_t c = 0; c < 3; ++c) {
                response[3 * e + c] =
                    cell.curvature * volume_change * cell.gradient[3 * e + c] + cell.slope * (first[c] + second[c]);
            }
        }
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const T sign = static_cast<T>(side(corner, axis) / 4);
                for (std::size_t c = 0; c < 3; ++c) {
                    to(cell.nodes[corner], c) += sign * response[3 * axis + c];
                }
            }
        }
    }
}

template <class T>
void Tangent<T>::convex_diagonal(std::vector<Symmetric3<double>>& blocks) const {
    blocks.assign(body_->node_count(), {});
    for (std::size_t s = 0; s < springs_.size(); ++s) {
        for (std::size_t e = 0; e < 6; ++e) {
            const auto value = static_cast<double>(springs_[s].convex[e]);
            blocks[static_cast<std::size_t>(network_.springs[s].a)][e] += value;
            blocks[static_cast<std::size_t>(network_.springs[s].b)][e] += value;
        }
    }
    for (std::size_t n = 0; n < cells_.size(); ++n) {
        const auto curvature = std::max(static_cast<double>(cells_[n].curvature), 0.0);
        for (std::size_t corner = 0; corner < 8; ++corner) {
            double g[3] = {};
            for (std::size_t e = 0; e < 9; ++e) {
                g[e % 3] += side(corner, e / 3) / 4 * static_cast<double>(cells_[n].gradient[e]);
            }
            auto& block = blocks[static_cast<std::size_t>(network_.cells[n].nodes[corner])];
            std::size_t entry = 0;
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = i; j < 3; ++j, ++entry) {
                    block[entry] += curvature * g[i] * g[j];
                }
            }
        }
    }
}

template class Tangent<float>;
template class Tangent<double>;

} // namespace hybmss
