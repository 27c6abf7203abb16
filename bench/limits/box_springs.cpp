#include "bench/limits/box_springs.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace hybmss::bench {

#define HYBMSS_BUILT_ONLY
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    namespace set {                                                                                                    \
    extern const SpringForms spring_forms;                                                                             \
    }
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET

const SpringForms& spring_forms(InstructionSet wanted) {
    switch (wanted) {
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    case InstructionSet::set:                                                                                          \
        return set::spring_forms;
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
    default:
        throw std::invalid_argument("no loops for the instruction set " + std::string(name(wanted)));
    }
}

namespace {

constexpr std::size_t kVectorSlack = 64;

} // namespace

template <class T>
BoxSprings<T>::BoxSprings(int edge, const Material& material, double cell_size, StateForm form)
    : edge_(edge), row_(edge + 3), form_(form) {
    const auto row = static_cast<std::size_t>(row_), nodes = row * row * row;
    margin_ = row * row + 2 * row + kVectorSlack;
    for (auto* arrays : {&state_, &force_, &displacement_}) {
        for (auto& array : *arrays) {
            array.assign(nodes + 2 * margin_, T(0));
        }
    }
    const SpringConstants k = spring_constants(material, cell_size);
    for (int s = 0; s < kSpringDirections; ++s) {
        stiffness_[s].assign(nodes + 2 * margin_, T(0));
        const auto& r = kDirections[s];
        const int kind = std::abs(r[0]) + std::abs(r[1]) + std::abs(r[2]);
        const double share = (kind == 1 ? k.edge / 4 : kind == 2 ? k.face_diagonal / 2 : k.cube_diagonal) * cell_size;
        for (int z = 1; z <= edge + 1; ++z) {
            for (int y = 1; y <= edge + 1; ++y) {
                for (int x = 1; x <= edge + 1; ++x) {
                    if (!is_inside(x + r[0], y + r[1], z + r[2])) {
                        continue;
                    }
                    // A spring belongs to two cells along each axis that it is at right angles to, at the surface to
                    // one.
                    int cells = 1;
                    const int node[3] = {x, y, z};
                    for (int a = 0; a < 3; ++a) {
                        cells *= r[a] == 0 && node[a] > 1 && node[a] <= edge ? 2 : 1;
                    }
                    stiffness_[s][at(x, y, z)] = static_cast<T>(share * cells);
                }
            }
        }
        grid_.stiffness[static_cast<std::size_t>(s)] = stiffness_[s].data() + margin_;
    }
    grid_.row = row_;
    grid_.plane = static_cast<std::ptrdiff_t>(row_) * row_;
    grid_.nodes = static_cast<std::ptrdiff_t>(nodes);
    for (int c = 0; c < 3; ++c) {
        grid_.state[c] = state_[c].data() + margin_;
        grid_.force[c] = force_[c].data() + margin_;
    }
    displace(0);
}

template <class T>
std::size_t BoxSprings<T>::at(int i, int j, int k) const {
    return margin_ + static_cast<std::size_t>(i + row_ * (j + row_ * k));
}

template <class T>
bool BoxSprings<T>::is_inside(int i, int j, int k) const {
    return std::min({i, j, k}) >= 1 && std::max({i, j, k}) <= edge_ + 1;
}

template <class T>
void BoxSprings<T>::displace(double strain) {
    std::mt19937 engine(20);
    std::uniform_real_distribution<double> draw(-0.5, 0.5);
    for (int k = 0; k < row_; ++k) {
        for (int j = 0; j < row_; ++j) {
            for (int i = 0; i < row_; ++i) {
                const int rest[3] = {i, j, k};
                for (int c = 0; c < 3; ++c) {
                    const double u = is_inside(i, j, k) ? strain * draw(engine) : 0;
                    const std::size_t n = at(i, j, k);
                    displacement_[c][n] = static_cast<T>(u);
                    state_[c][n] = form_ == StateForm::displacement
                                       ? displacement_[c][n]
                                       : static_cast<T>(rest[c] + static_cast<double>(displacement_[c][n]));
                }
            }
        }
    }
}

/// k (1 - l/|d|) d, 1 - l/|d| = s / (1 + s + sqrt(1 + s)) with s = (2 r.du + du.du) / l^2: no cancellation.
template <class T>
std::array<long double, 3> BoxSprings<T>::exact_force(int i, int j, int k) const {
    std::array<long double, 3> force = {0, 0, 0};
    for (int s = 0; s < kSpringDirections; ++s) {
        for (const int sign : {1, -1}) {
            const int r[3] = {sign * kDirections[s][0], sign * kDirections[s][1], sign * kDirections[s][2]};
            const std::size_t here = at(i, j, k), there = at(i + r[0], j + r[1], k + r[2]);
            long double d[3], change = 0, rest = 0;
            for (int c = 0; c < 3; ++c) {
                const long double du = static_cast<long double>(displacement_[c][there]) - displacement_[c][here];
                d[c] = r[c] + du;
                change += (2 * r[c] + du) * du;
                rest += r[c] * r[c];
            }
            const long double w = 1 + change / rest;
            const long double tension = stiffness_[s][sign > 0 ? here : there] * (change / rest) / (w + std::sqrt(w));
            for (std::size_t c = 0; c < 3; ++c) {
                force[c] += tension * d[c];
            }
        }
    }
    return force;
}

template <class T>
double BoxSprings<T>::force_error() const {
    long double error = 0, scale = 0;
    for (int k = 1; k <= edge_ + 1; ++k) {
        for (int j = 1; j <= edge_ + 1; ++j) {
            for (int i = 1; i <= edge_ + 1; ++i) {
                const auto exact = exact_force(i, j, k);
                for (std::size_t c = 0; c < 3; ++c) {
                    error = std::max(error, std::abs(force_[c][at(i, j, k)] - exact[c]));
                    scale = std::max(scale, std::abs(exact[c]));
                }
            }
        }
    }
    return static_cast<double>(error / scale);
}

template class BoxSprings<float>;
template class BoxSprings<double>;

} // namespace hybmss::bench
