#pragma once

/// \file
/// The bodies of the regression matrix, and the plans that are made of them.

#include "app/verify/verify.hpp"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "hybmss/plan_options.hpp"
#include "hybmss/vector_field.hpp"
#include "reference/body.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace hybmss::verify {

/// One body in one variant: a lattice with its material, or a network made by hand.
struct TestBody {
    std::string name;    ///< e.g. "box 3x2x5"
    std::string variant; ///< e.g. "A=1 quadratic"
    std::optional<Lattice> lattice;
    Material material;    ///< of the lattice
    Network network;      ///< where there is no lattice
    double cell_size = 1; ///< m; a strain of 1 means displacements of this size
};

/// Boxes, masks and networks, each in all of its variants. Random parts follow from the seed alone.
std::vector<TestBody> test_bodies(Extent extent, unsigned seed);

/// A few small ones, for checks that need many runs of each: a box, a mask with mixed stiffness, a network.
std::vector<TestBody> property_bodies(unsigned seed);

reference::Body reference_body(const TestBody& body);

/// For each layout that the body can be planned in, each instruction set and each accuracy: a key that names these and
/// the precision.
std::vector<RowKey> kernel_keys(const TestBody& body, const std::vector<InstructionSet>& sets,
                                const std::string& precision);

/// The options that ask for what a key names.
PlanOptions plan_options(const RowKey& key);

/// A ForcePlan or an ExplicitDynamics of the body.
template <class Planned>
Planned make_planned(const TestBody& body, const PlanOptions& options) {
    return body.lattice ? Planned(*body.lattice, body.material, options) : Planned(body.network, options);
}

/// check(body, table) for all bodies, on all of the machine's processors; the same table as one after the other.
void for_each_body(const std::vector<TestBody>& bodies, RowTable& table,
                   const std::function<void(const TestBody&, RowTable&)>& check);

// ---- memory

/// How one 3-vector a node may lie in memory, as a VectorField can view it.
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

// ---- the parts of run_matrix

/// {layout} x {instruction set} x {accuracy} x {float, double} x {bodies} x {variants} x {strains}: forces, energies
/// and Hessian products, in separate arrays and interleaved ones by turns.
void run_force_matrix(const MatrixOptions& options, RowTable& table);

/// What must hold besides single values: the forced instruction set runs, forces are added, padding is left alone,
/// coincident nodes give finite forces, no total force or torque, rigid motions cost nothing, diagonals are the
/// product's.
void run_properties(const MatrixOptions& options, RowTable& table);

/// Fifty steps of ExplicitDynamics: with gravity, damping and prescribed nodes, and with none of them.
void run_dynamics(const MatrixOptions& options, RowTable& table);

} // namespace hybmss::verify
