#pragma once

/// \file
/// Between the caller's x y z x y z ... and arrays of a component each, whole vectors at a time. Compilers make half
/// the speed of a plain loop over it: element by element they are bound by their stores.

#include <cstddef>
#include <cstring>

namespace hybmss {

/// Four floats or two doubles: what every processor of the families that kernels are made for has.
template <class T>
struct InterleavedVector;
template <>
struct InterleavedVector<float> {
    typedef float Type __attribute__((vector_size(16)));
    static constexpr std::size_t kLanes = 4;
};
template <>
struct InterleavedVector<double> {
    typedef double Type __attribute__((vector_size(16)));
    static constexpr std::size_t kLanes = 2;
};

/// Vectors of the components of kLanes neighbouring nodes, and the three vectors that hold them node by node.
template <class T>
struct NodesOfVector {
    using Vector = typename InterleavedVector<T>::Type;
    static constexpr std::size_t kLanes = InterleavedVector<T>::kLanes;

    static Vector load(const T* from) {
        Vector vector;
        std::memcpy(&vector, from, sizeof vector);
        return vector;
    }
    static void store(const Vector& vector, T* to) { std::memcpy(to, &vector, sizeof vector); }

    /// a b c = x0 y0 z0 x1 | y1 z1 x2 y2 | z2 x3 y3 z3, of doubles x0 y0 | z0 x1 | y1 z1.
    static void take_apart(const Vector (&abc)[3], Vector (&xyz)[3]) {
        const auto& [a, b, c] = abc;
        if constexpr (kLanes == 2) {
            xyz[0] = __builtin_shufflevector(a, b, 0, 3);
            xyz[1] = __builtin_shufflevector(a, c, 1, 2);
            xyz[2] = __builtin_shufflevector(b, c, 0, 3);
        } else {
            // Each one instruction: two lanes of the first and two of the second.
            const Vector x23 = __builtin_shufflevector(b, c, 2, 2, 5, 5);
            const Vector y01 = __builtin_shufflevector(a, b, 1, 1, 4, 4),
                         y23 = __builtin_shufflevector(b, c, 3, 3, 6, 6);
            const Vector z01 = __builtin_shufflevector(a, b, 2, 2, 5, 5);
            xyz[0] = __builtin_shufflevector(a, x23, 0, 3, 4, 6);
            xyz[1] = __builtin_shufflevector(y01, y23, 0, 2, 4, 6);
            xyz[2] = __builtin_shufflevector(z01, c, 0, 2, 4, 7);
        }
    }
    /// The inverse.
    static void put_together(const Vector (&xyz)[3], Vector (&abc)[3]) {
        const auto& [x, y, z] = xyz;
        if constexpr (kLanes == 2) {
            abc[0] = __builtin_shufflevector(x, y, 0, 2);
            abc[1] = __builtin_shufflevector(z, x, 0, 3);
            abc[2] = __builtin_shufflevector(y, z, 1, 3);
        } else {
            const Vector x01_y01 = __builtin_shufflevector(x, y, 0, 1, 4, 5);
            const Vector x23_y23 = __builtin_shufflevector(x, y, 2, 3, 6, 7);
            const Vector z01_x1 = __builtin_shufflevector(z, x, 0, 1, 5, 5);
            const Vector y12_z12 = __builtin_shufflevector(y, z, 1, 2, 5, 6);
            const Vector z23_x3 = __builtin_shufflevector(z, x, 2, 3, 7, 7);
            const Vector y3_z3 = __builtin_shufflevector(y, z, 3, 3, 7, 7);
            abc[0] = __builtin_shufflevector(x01_y01, z01_x1, 0, 2, 4, 6);
            abc[1] = __builtin_shufflevector(y12_z12, x23_y23, 0, 2, 4, 6);
            abc[2] = __builtin_shufflevector(z23_x3, y3_z3, 0, 2, 4, 6);
        }
    }
};

/// x[n] = factor * from[3 n] and so on, for n < count. No memory overlaps.
template <class T>
void scale_from_interleaved(const T* from, T factor, T* x, T* y, T* z, std::size_t count) {
    using Nodes = NodesOfVector<T>;
    std::size_t n = 0;
    for (; n + Nodes::kLanes <= count; n += Nodes::kLanes) {
        const T* const at = from + 3 * n;
        const typename Nodes::Vector abc[3] = {Nodes::load(at), Nodes::load(at + Nodes::kLanes),
                                               Nodes::load(at + 2 * Nodes::kLanes)};
        typename Nodes::Vector xyz[3];
        Nodes::take_apart(abc, xyz);
        Nodes::store(factor * xyz[0], x + n);
        Nodes::store(factor * xyz[1], y + n);
        Nodes::store(factor * xyz[2], z + n);
    }
    for (; n < count; ++n) {
        x[n] = factor * from[3 * n];
        y[n] = factor * from[3 * n + 1];
        z[n] = factor * from[3 * n + 2];
    }
}

/// to[3 n] = factor * x[n] and so on, for n < count; `add`: to[3 n] += factor * x[n]. No memory overlaps.
template <bool add, class T>
void scale_to_interleaved(const T* x, const T* y, const T* z, T factor, T* to, std::size_t count) {
    using Nodes = NodesOfVector<T>;
    std::size_t n = 0;
    for (; n + Nodes::kLanes <= count; n += Nodes::kLanes) {
        const typename Nodes::Vector xyz[3] = {Nodes::load(x + n), Nodes::load(y + n), Nodes::load(z + n)};
        typename Nodes::Vector abc[3];
        Nodes::put_together(xyz, abc);
        for (std::size_t v = 0; v < 3; ++v) {
            T* const at = to + 3 * n + v * Nodes::kLanes;
            Nodes::store(add ? Nodes::load(at) + factor * abc[v] : factor * abc[v], at);
        }
    }
    for (; n < count; ++n) {
        const T sum[3] = {factor * x[n], factor * y[n], factor * z[n]};
        for (std::size_t c = 0; c < 3; ++c) {
            to[3 * n + c] = add ? to[3 * n + c] + sum[c] : sum[c];
        }
    }
}

} // namespace hybmss
