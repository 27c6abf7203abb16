// Compiled once for each instruction set: between a caller's x y z x y z ... and arrays of a component each, whole
// vectors at a time. Compilers make half the speed of a plain loop over it: element by element they are bound by their
// stores.
#include "kernels/compiled_set.hpp"

#include <cstring>
#include <utility>

namespace hybmss::kernels {
namespace {

/// Vectors of the components of `lanes` neighbouring nodes, and the three vectors that hold them node by node.
template <class T, int lanes>
struct NodesOfVector {
    static constexpr std::ptrdiff_t kLanes = lanes;
    typedef T Vector __attribute__((vector_size(lanes * sizeof(T))));

    HYBMSS_INLINE static Vector load(const T* from) {
        Vector vector;
        std::memcpy(&vector, from, sizeof vector);
        return vector;
    }
    HYBMSS_INLINE static void store(const Vector& vector, T* to) { std::memcpy(to, &vector, sizeof vector); }

    /// a b c = x0 y0 z0 x1 | y1 z1 x2 y2 | z2 x3 y3 z3, of doubles x0 y0 | z0 x1 | y1 z1.
    HYBMSS_INLINE static void take_apart(const Vector (&abc)[3], Vector (&xyz)[3]) {
        const auto& [a, b, c] = abc;
        if constexpr (lanes == 2) {
            xyz[0] = __builtin_shufflevector(a, b, 0, 3);
            xyz[1] = __builtin_shufflevector(a, c, 1, 2);
            xyz[2] = __builtin_shufflevector(b, c, 0, 3);
        } else if constexpr (lanes == 4) {
            // Each one instruction: two lanes of the first and two of the second.
            const Vector x23 = __builtin_shufflevector(b, c, 2, 2, 5, 5);
            const Vector y01 = __builtin_shufflevector(a, b, 1, 1, 4, 4),
                         y23 = __builtin_shufflevector(b, c, 3, 3, 6, 6);
            const Vector z01 = __builtin_shufflevector(a, b, 2, 2, 5, 5);
            xyz[0] = __builtin_shufflevector(a, x23, 0, 3, 4, 6);
            xyz[1] = __builtin_shufflevector(y01, y23, 0, 2, 4, 6);
            xyz[2] = __builtin_shufflevector(z01, c, 0, 2, 4, 7);
        } else {
            take_apart(abc, xyz, std::make_integer_sequence<int, lanes>());
        }
    }
    /// The inverse.
    HYBMSS_INLINE static void put_together(const Vector (&xyz)[3], Vector (&abc)[3]) {
        const auto& [x, y, z] = xyz;
        if constexpr (lanes == 2) {
            abc[0] = __builtin_shufflevector(x, y, 0, 2);
            abc[1] = __builtin_shufflevector(z, x, 0, 3);
            abc[2] = __builtin_shufflevector(y, z, 1, 3);
        } else if constexpr (lanes == 4) {
            const Vector x01_y01 = __builtin_shufflevector(x, y, 0, 1, 4, 5);
            const Vector x23_y23 = __builtin_shufflevector(x, y, 2, 3, 6, 7);
            const Vector z01_x1 = __builtin_shufflevector(z, x, 0, 1, 5, 5);
            const Vector y12_z12 = __builtin_shufflevector(y, z, 1, 2, 5, 6);
            const Vector z23_x3 = __builtin_shufflevector(z, x, 2, 3, 7, 7);
            const Vector y3_z3 = __builtin_shufflevector(y, z, 3, 3, 7, 7);
            abc[0] = __builtin_shufflevector(x01_y01, z01_x1, 0, 2, 4, 6);
            abc[1] = __builtin_shufflevector(y12_z12, x23_y23, 0, 2, 4, 6);
            abc[2] = __builtin_shufflevector(z23_x3, y3_z3, 0, 2, 4, 6);
        } else {
            put_together(xyz, abc, std::make_integer_sequence<int, lanes>());
        }
    }

private:
    // Where a processor takes any lanes of two vectors at once, two such instructions a vector: of the first two, then
    // of that and the third. Lane l of component c is element 3 l + c of a b c; -1: any will do.
    static constexpr int of_first_two(int element, int) { return element < 2 * lanes ? element : -1; }
    static constexpr int of_third(int element, int lane) { return element < 2 * lanes ? lane : element - lanes; }

    template <int... lane>
    HYBMSS_INLINE static void take_apart(const Vector (&abc)[3], Vector (&xyz)[3],
                                         std::integer_sequence<int, lane...>) {
        const auto component = [&]<int c>(std::integral_constant<int, c>) HYBMSS_INLINE_BODY {
            const Vector two = __builtin_shufflevector(abc[0], abc[1], of_first_two(3 * lane + c, lane)...);
            return __builtin_shufflevector(two, abc[2], of_third(3 * lane + c, lane)...);
        };
        xyz[0] = component(std::integral_constant<int, 0>());
        xyz[1] = component(std::integral_constant<int, 1>());
        xyz[2] = component(std::integral_constant<int, 2>());
    }

    // Element e of a b c is lane e / 3 of component e % 3.
    static constexpr int of_xy(int e) { return e % 3 == 2 ? -1 : e / 3 + (e % 3 == 1 ? lanes : 0); }
    static constexpr int of_z(int e, int lane) { return e % 3 == 2 ? e / 3 + lanes : lane; }

    template <int... lane>
    HYBMSS_INLINE static void put_together(const Vector (&xyz)[3], Vector (&abc)[3],
                                           std::integer_sequence<int, lane...>) {
        const auto third = [&]<int v>(std::integral_constant<int, v>) HYBMSS_INLINE_BODY {
            const Vector xy = __builtin_shufflevector(xyz[0], xyz[1], of_xy(v * lanes + lane)...);
            return __builtin_shufflevector(xy, xyz[2], of_z(v * lanes + lane, lane)...);
        };
        abc[0] = third(std::integral_constant<int, 0>());
        abc[1] = third(std::integral_constant<int, 1>());
        abc[2] = third(std::integral_constant<int, 2>());
    }
};

/// Four floats or two doubles: what every processor of the families that kernels are made for can shuffle well.
template <class T>
using FewNodes = NodesOfVector<T, 16 / sizeof(T)>;
/// Whole vectors, where their lanes can be chosen freely.
template <class V>
using ManyNodes = NodesOfVector<Scalar<V>, Traits<V>::kAvx512 ? kWidth<V> : 16 / sizeof(Scalar<V>)>;

template <class Nodes, class T>
HYBMSS_INLINE Range move_from(const T* from, T factor, T* x, T* y, T* z, Range n, Range count) {
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
    return n;
}
template <class Nodes, bool add, class T>
HYBMSS_INLINE Range move_to(const T* x, const T* y, const T* z, T factor, T* to, Range n, Range count) {
    for (; n + Nodes::kLanes <= count; n += Nodes::kLanes) {
        const typename Nodes::Vector xyz[3] = {Nodes::load(x + n), Nodes::load(y + n), Nodes::load(z + n)};
        typename Nodes::Vector abc[3];
        Nodes::put_together(xyz, abc);
        for (int v = 0; v < 3; ++v) {
            T* const at = to + 3 * n + v * Nodes::kLanes;
            Nodes::store(add ? Nodes::load(at) + factor * abc[v] : factor * abc[v], at);
        }
    }
    return n;
}

template <class V>
void from_interleaved(const Scalar<V>* from, Scalar<V> factor, Scalar<V>* x, Scalar<V>* y, Scalar<V>* z, Range count) {
    using T = Scalar<V>;
    Range n = move_from<ManyNodes<V>>(from, factor, x, y, z, 0, count);
    n = move_from<FewNodes<T>>(from, factor, x, y, z, n, count);
    for (; n < count; ++n) {
        x[n] = factor * from[3 * n];
        y[n] = factor * from[3 * n + 1];
        z[n] = factor * from[3 * n + 2];
    }
}

template <bool add, class V>
void to_interleaved(const Scalar<V>* x, const Scalar<V>* y, const Scalar<V>* z, Scalar<V> factor, Scalar<V>* to,
                    Range count) {
    using T = Scalar<V>;
    Range n = move_to<ManyNodes<V>, add>(x, y, z, factor, to, 0, count);
    n = move_to<FewNodes<T>, add>(x, y, z, factor, to, n, count);
    for (; n < count; ++n) {
        const T sum[3] = {factor * x[n], factor * y[n], factor * z[n]};
        for (Range c = 0; c < 3; ++c) {
            to[3 * n + c] = add ? to[3 * n + c] + sum[c] : sum[c];
        }
    }
}

} // namespace

HYBMSS_DEFINE_COMMON_KERNEL(from_interleaved);
HYBMSS_DEFINE_COMMON_KERNEL(to_interleaved);

} // namespace hybmss::kernels
