#pragma once

/// \file
/// One 3-vector a node in any of the memory arrangements that a VectorField can view.

#include "hybmss/vector_field.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

namespace hybmss::verify {

enum class Arrangement { separate_arrays, stride_3, stride_4 };

inline constexpr Arrangement kArrangements[] = {Arrangement::separate_arrays, Arrangement::stride_3,
                                                Arrangement::stride_4};

template <class T>
class NodeArray {
public:
    NodeArray(Arrangement arrangement, std::size_t nodes)
        : arrangement_(arrangement), nodes_(nodes),
          values_((arrangement == Arrangement::stride_4 ? 4 : 3) * nodes, T(0)) {}

    NodeArray(Arrangement arrangement, std::span<const Eigen::Vector3d> vectors)
        : NodeArray(arrangement, vectors.size()) {
        const VectorField<T> out = field();
        for (std::size_t n = 0; n < nodes_; ++n) {
            const auto at = static_cast<std::ptrdiff_t>(n) * out.stride;
            out.x[at] = static_cast<T>(vectors[n].x());
            out.y[at] = static_cast<T>(vectors[n].y());
            out.z[at] = static_cast<T>(vectors[n].z());
        }
    }

    VectorField<T> field() {
        T* v = values_.data();
        switch (arrangement_) {
        case Arrangement::stride_3:
            return VectorField<T>::aos(v, nodes_, 3);
        case Arrangement::stride_4:
            return VectorField<T>::aos(v, nodes_, 4);
        default:
            return VectorField<T>::soa(v, v + nodes_, v + 2 * nodes_, nodes_);
        }
    }

    std::vector<Eigen::Vector3d> vectors() {
        const VectorField<T> in = field();
        std::vector<Eigen::Vector3d> out(nodes_);
        for (std::size_t n = 0; n < nodes_; ++n) {
            const auto at = static_cast<std::ptrdiff_t>(n) * in.stride;
            out[n] = {static_cast<double>(in.x[at]), static_cast<double>(in.y[at]), static_cast<double>(in.z[at])};
        }
        return out;
    }

    /// The fourth component of a stride of 4, which belongs to the caller alone.
    T& padding(std::size_t node) { return values_[4 * node + 3]; }

private:
    Arrangement arrangement_;
    std::size_t nodes_;
    std::vector<T> values_;
};

/// The vectors as T holds them, in double: what the reference must be given for a fair comparison.
template <class T>
std::vector<Eigen::Vector3d> rounded(std::span<const Eigen::Vector3d> vectors) {
    return NodeArray<T>(Arrangement::stride_3, vectors).vectors();
}

/// One a node, each component within `bound`, as T holds them.
template <class T>
std::vector<Eigen::Vector3d> random_vectors(std::size_t nodes, double bound, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-bound, bound);
    std::vector<Eigen::Vector3d> vectors(nodes);
    for (Eigen::Vector3d& v : vectors) {
        v = {uniform(random), uniform(random), uniform(random)};
    }
    return rounded<T>(vectors);
}

/// max over nodes and axes of |a - b|; NaN where any component is NaN.
inline double max_difference(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b) {
    double worst = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        for (int axis = 0; axis < 3; ++axis) {
            const double difference = std::abs(a[n][axis] - b[n][axis]);
            if (std::isnan(difference)) {
                return std::numeric_limits<double>::quiet_NaN();
            }
            worst = std::max(worst, difference);
        }
    }
    return worst;
}
/// max over nodes and axes of |a|; NaN where any component is NaN.
inline double max_component(std::span<const Eigen::Vector3d> a) {
    const std::vector<Eigen::Vector3d> zero(a.size(), Eigen::Vector3d::Zero());
    return max_difference(a, zero);
}

} // namespace hybmss::verify
