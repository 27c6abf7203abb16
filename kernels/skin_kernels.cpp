// Compiled once for each instruction set: vertices that move with the cells that they lie in.
#include "kernels/compiled_set.hpp"

#include <limits>

namespace hybmss::kernels {
namespace {

/// u = m0 + m1 x + m2 y + m3 z + m4 xy + m5 yz + m6 zx + m7 xyz in the cell, x, y and z from -1 to 1: by sums and
/// differences of its corners.
template <class T>
HYBMSS_INLINE void monomials(const SkinVertices<T>& skin, const SkinCell<T>& cell, T (&m)[8][3]) {
    constexpr int kMonomial[8] = {0, 1, 2, 4, 3, 6, 5, 7}; // by the bits of their axes
    for (int a = 0; a < 3; ++a) {
        T u[8];
        for (int c = 0; c < 8; ++c) {
            u[c] = skin.displacement[a][static_cast<std::ptrdiff_t>(cell.nodes[c]) * skin.displacement_stride];
        }
        for (int bit = 1; bit < 8; bit *= 2) {
            for (int c = 0; c < 8; ++c) {
                if ((c & bit) == 0) {
                    const T low = u[c], high = u[c | bit];
                    u[c] = low + high;
                    u[c | bit] = high - low;
                }
            }
        }
        for (int i = 0; i < 8; ++i) {
            m[i][a] = u[kMonomial[i]] * T(0.125);
        }
    }
}

/// 1 / sqrt(a) to a few roundings; a above zero.
template <class V>
HYBMSS_INLINE V inverse_root(V a) {
    if constexpr (seed_quality<V>() == Seed::none) {
        return divide(splat<V>(1), square_root(a));
    } else {
        V y = reciprocal_square_root_seed(a);
        constexpr int kSteps = Traits<V>::kFloat ? (seed_quality<V>() == Seed::bits8 ? 2 : 1) : 2;
        for (int i = 0; i < kSteps; ++i) { // y + y (1 - a y^2) / 2
            y = multiply_add(y * splat<V>(Scalar<V>(0.5)), subtract_product(a * y, y, splat<V>(1)), y);
        }
        return y;
    }
}

template <class T>
HYBMSS_INLINE void put(const T* lanes, Range count, const std::uint32_t* order, T* to, std::ptrdiff_t stride) {
    for (Range n = 0; n < count; ++n) {
        to[static_cast<std::ptrdiff_t>(order[n]) * stride] = lanes[n];
    }
}

/// x = X + u at the vertices of a cell, and n = cof(F) N / |cof(F) N| with F = I + du/dX there. Beside the cell u goes
/// on linearly from the nearest point p: as (w - p) times the slopes there of the products in u.
template <bool normals, bool inside, class V>
HYBMSS_INLINE void move_vertices(const SkinVertices<Scalar<V>>& skin, const SkinCell<Scalar<V>>& cell) {
    using T = Scalar<V>;
    T m[8][3];
    monomials(skin, cell, m);
    const T scale = skin.inverse_half_size;
    const Range end = cell.first + cell.count;
    for (Range first = cell.first; first < end; first += kWidth<V>) {
        const auto value = [&](int i) HYBMSS_INLINE_BODY { return load_lanes<V>(skin.values[i] + first); };
        const Range count = end - first < kWidth<V> ? end - first : kWidth<V>;
        const V w[3] = {value(kSkinPlace), value(kSkinPlace + 1), value(kSkinPlace + 2)};
        V p[3] = {w[0], w[1], w[2]}, products[3], all;
        if constexpr (inside) {
            for (int a = 0; a < 3; ++a) {
                products[a] = w[a] * w[(a + 1) % 3];
            }
            all = products[0] * w[2];
        } else {
            V at[3];
            for (int a = 0; a < 3; ++a) {
                p[a] = value(kSkinNearest + a);
            }
            for (int a = 0; a < 3; ++a) {
                const int b = (a + 1) % 3;
                at[a] = p[a] * p[b];
                products[a] = multiply_add(w[a], p[b], multiply_subtract(p[a], w[b], at[a]));
            }
            all = multiply_add(w[0], at[1],
                               multiply_add(w[1], at[2], multiply_subtract(w[2], at[0], splat<V>(2) * at[0] * p[2])));
        }
        alignas(64) T lanes[3][kWidth<V>];
        for (int a = 0; a < 3; ++a) {
            const auto c = [&](int i) HYBMSS_INLINE_BODY { return splat<V>(m[i][a]); };
            V sum = multiply_add(all, c(7), c(0));
            for (int b = 0; b < 3; ++b) {
                sum = multiply_add(products[b], c(4 + b), sum);
            }
            for (int b = 0; b < 3; ++b) {
                sum = multiply_add(w[b], c(1 + b), sum);
            }
            const V rest = multiply_add(w[a], splat<V>(skin.half_size), splat<V>(cell.middle[a]));
            (rest + sum).store_aligned(lanes[a]);
        }
        for (int a = 0; a < 3; ++a) {
            put(lanes[a], count, skin.order + first, skin.positions[a], skin.positions_stride);
        }
        if constexpr (normals) {
            V f[3][3]; // by rows
            for (int a = 0; a < 3; ++a) {
                const auto c = [&](int i) HYBMSS_INLINE_BODY { return splat<V>(m[i][a] * scale); };
                const V xz = multiply_add(c(7), p[1], c(6)); // the factor of z in that of x, and the other way round
                f[a][0] = multiply_add(xz, p[2], multiply_add(c(4), p[1], c(1)));
                f[a][1] = multiply_add(multiply_add(c(7), p[0], c(5)), p[2], multiply_add(c(4), p[0], c(2)));
                f[a][2] = multiply_add(xz, p[0], multiply_add(c(5), p[1], c(3)));
                f[a][a] = f[a][a] + splat<V>(1);
            }
            const V rest[3] = {value(kSkinNormal), value(kSkinNormal + 1), value(kSkinNormal + 2)};
            V normal[3], size = splat<V>(std::numeric_limits<T>::min());
            for (int a = 0; a < 3; ++a) {
                const V *const r = f[(a + 1) % 3], *const s = f[(a + 2) % 3];
                // A row of the cofactor is their cross product.
                normal[a] = multiply_add(subtract_product(r[2], s[1], r[1] * s[2]), rest[0],
                                         multiply_add(subtract_product(r[0], s[2], r[2] * s[0]), rest[1],
                                                      subtract_product(r[1], s[0], r[0] * s[1]) * rest[2]));
                size = multiply_add(normal[a], normal[a], size);
            }
            const V by = inverse_root(size);
            for (int a = 0; a < 3; ++a) {
                (normal[a] * by).store_aligned(lanes[a]);
            }
            for (int a = 0; a < 3; ++a) {
                put(lanes[a], count, skin.order + first, skin.normals[a], skin.normals_stride);
            }
        }
    }
}

template <bool normals, class V>
void move_skin(const SkinVertices<Scalar<V>>& skin, Range begin, Range end) {
    for (Range n = begin; n < end; ++n) {
        const SkinCell<Scalar<V>>& cell = skin.cells[n];
        if (cell.inside) {
            move_vertices<normals, true, V>(skin, cell);
        } else {
            move_vertices<normals, false, V>(skin, cell);
        }
    }
}

} // namespace

HYBMSS_DEFINE_COMMON_KERNEL(move_skin);

} // namespace hybmss::kernels
