#pragma once

// What cells of another size at rest have of energy beyond those as they were made, a cell a lane. With the stretches
// s_x, s_y, s_z of the axes at rest, Ja = s_x s_y s_z, a cell stores Ja W(F diag(1/s)) where it stored W(F):
//
//     a spring of the direction r     Ja w(|d| / (q l)) - w(|d| / l),   q = |diag(s) r| / |r|
//     the volume                      Ja phi(J / Ja) - phi(J)
//     a pattern g_i . a_j             as its strains are by the new size, p -> sqrt(Ja) / s_j^2 p, or p / sqrt(s_i)
//
// Lengths are by the edge of a cell as it was made, energies by G h^3. No products are fused with sums, so that all
// instruction sets find the same bits.

#include "kernels/vectors.hpp"
#include "kernels/volume_law.hpp"

namespace hybmss::kernels {
namespace {

/// A number and its derivative along a direction.
template <class V>
struct Dual {
    V value, along;
};
template <class V>
HYBMSS_INLINE Dual<V> operator+(const Dual<V>& a, const Dual<V>& b) {
    return {a.value + b.value, a.along + b.along};
}
template <class V>
HYBMSS_INLINE Dual<V> operator-(const Dual<V>& a, const Dual<V>& b) {
    return {a.value - b.value, a.along - b.along};
}
template <class V>
HYBMSS_INLINE Dual<V> operator*(const Dual<V>& a, const Dual<V>& b) {
    return {a.value * b.value, a.value * b.along + a.along * b.value};
}
template <class V>
HYBMSS_INLINE Dual<V> operator+(const Dual<V>& a, V b) {
    return {a.value + b, a.along};
}
template <class V>
HYBMSS_INLINE Dual<V> operator-(const Dual<V>& a, V b) {
    return {a.value - b, a.along};
}
template <class V>
HYBMSS_INLINE Dual<V> operator*(V b, const Dual<V>& a) {
    return {b * a.value, b * a.along};
}

/// 1 / sqrt(a), cbrt(1 + j) - 1 where j > -7/8, and the larger of a and zero.
template <class V>
HYBMSS_INLINE V one_over_root(V a) {
    return divide(splat<V>(1), square_root(a));
}
template <class V>
HYBMSS_INLINE Dual<V> one_over_root(const Dual<V>& a) {
    const V root = one_over_root(a.value);
    return {root, splat<V>(Scalar<V>(-0.5)) * (root * root * root) * a.along};
}
template <class V>
HYBMSS_INLINE V bounded_cube_root_minus_one(V j) {
    return cube_root_minus_one(maximum(j, splat<V>(Scalar<V>(-0.875))));
}
template <class V>
HYBMSS_INLINE Dual<V> bounded_cube_root_minus_one(const Dual<V>& j) {
    const V root = bounded_cube_root_minus_one(j.value), c = root + splat<V>(1);
    return {root, divide(where_positive(j.value - splat<V>(Scalar<V>(-0.875)), j.along), splat<V>(3) * (c * c))};
}
template <class V>
HYBMSS_INLINE V above_zero(V a) {
    return maximum(a, splat<V>(0));
}
template <class V>
HYBMSS_INLINE Dual<V> above_zero(const Dual<V>& a) {
    return {above_zero(a.value), where_positive(a.value, a.along)};
}
template <class V>
HYBMSS_INLINE V one_over(V a) {
    return divide(splat<V>(1), a);
}
template <class V>
HYBMSS_INLINE Dual<V> one_over(const Dual<V>& a) {
    const V inverse = one_over(a.value);
    return {inverse, splat<V>(0) - inverse * inverse * a.along};
}
template <class V>
HYBMSS_INLINE V with_value(V, V value) {
    return value;
}
template <class V>
HYBMSS_INLINE Dual<V> with_value(const Dual<V>&, V value) {
    return {value, splat<V>(0)};
}
/// `a` where gate > 0, else b.
template <class V>
HYBMSS_INLINE V chosen(V gate, V a, V b) {
    return where_positive(gate, a - b) + b;
}
template <class V>
HYBMSS_INLINE Dual<V> chosen(V gate, const Dual<V>& a, const Dual<V>& b) {
    return {chosen(gate, a.value, b.value), chosen(gate, a.along, b.along)};
}

/// A cell's own size at rest, and what follows from it.
template <class V>
struct RestSize {
    V volume;         ///< Ja
    V inverse_volume; ///< 1 / Ja
    V length[8];      ///< q by the bits of the axes that a spring goes along, from 1 on
    V inverse[8];     ///< 1 / q
    V pattern[3][3];  ///< what p_ij is multiplied by
    V fourth;         ///< and the stiffness of the fourth pattern
};
template <bool means, class V>
HYBMSS_INLINE RestSize<V> rest_size(const V (&s)[3]) {
    RestSize<V> size;
    const V one = splat<V>(1);
    size.volume = s[0] * s[1] * s[2];
    size.inverse_volume = one_over(size.volume);
    for (int bits = 1; bits < 8; ++bits) {
        V sum = splat<V>(0);
        int count = 0;
        for (int a = 0; a < 3; ++a) {
            if ((bits >> a & 1) != 0) {
                sum = sum + s[a] * s[a];
                ++count;
            }
        }
        size.length[bits] = count == 1 ? s[bits / 2] : square_root(splat<V>(Scalar<V>(1.0 / count)) * sum);
        size.inverse[bits] = one_over(size.length[bits]);
    }
    if constexpr (means) {
        const V root = square_root(size.volume);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                size.pattern[i][j] = i == j ? one_over_root(s[i]) : divide(root, s[j] * s[j]);
            }
        }
        size.fourth = cube_root_minus_one(maximum(size.volume - one, splat<V>(Scalar<V>(-0.875)))) + one;
    }
    return size;
}

/// Of one spring: tension by its length, over its stiffness, and the energy by its stiffness; `s`: |d|^2.
template <int axes, class S, class V>
HYBMSS_INLINE S spring_tension(const S& s, int bits, const RestSize<V>& size, const ActuationLaw<Scalar<V>>& law) {
    using T = Scalar<V>;
    const V one = splat<V>(1), quadratic = splat<V>(law.quadratic), cubic = splat<V>(law.cubic);
    const S inverse = one_over_root(splat<V>(T(1.0 / axes)) * s); // l / |d|
    const S ratio = splat<V>(T(1.0 / axes)) * s * inverse;        // |d| / l
    const auto law_of = [&](const S& e) HYBMSS_INLINE_BODY { return e * ((cubic * e + quadratic) * e + one); };
    const S own = law_of(size.inverse[bits] * ratio - one), made = law_of(ratio - one);
    return (size.volume * size.inverse[bits] * own - made) * inverse;
}
template <int axes, class V>
HYBMSS_INLINE V spring_energy(V s, int bits, const RestSize<V>& size, const ActuationLaw<Scalar<V>>& law) {
    using T = Scalar<V>;
    const auto number = [](double value) { return splat<V>(static_cast<T>(value)); };
    const V quadratic = number(1.0 / 3) * splat<V>(law.quadratic), cubic = number(0.25) * splat<V>(law.cubic);
    const V ratio = square_root(number(1.0 / axes) * s);
    const auto law_of = [&](V e) HYBMSS_INLINE_BODY { return e * e * ((cubic * e + quadratic) * e + number(0.5)); };
    return number(axes) * (size.volume * law_of(size.inverse[bits] * ratio - number(1)) - law_of(ratio - number(1)));
}

/// The derivative by J of a cell's volume energies, over G; and those themselves.
template <class S, class V>
HYBMSS_INLINE S volume_tension(const S& j, V kappa, const ActuationLaw<Scalar<V>>& law) {
    using T = Scalar<V>;
    S slope = j;
    if (law.mean_stretch) {
        const S e = bounded_cube_root_minus_one(j), c = e + splat<V>(1);
        const S stretch = splat<V>(3) * e * one_over(c * c);
        slope = law.by_sign ? chosen(kappa, j, stretch) : stretch;
    }
    const S depth = above_zero(with_value(j, splat<V>(T(law.crush_ratio - 1))) - j);
    return kappa * slope - splat<V>(law.crush) * depth * depth;
}
template <class V>
HYBMSS_INLINE V volume_energy_of(V j, V kappa, const ActuationLaw<Scalar<V>>& law) {
    using T = Scalar<V>;
    V phi = volume_energy<Volume::quadratic>(j);
    if (law.mean_stretch) {
        const V stretch = volume_energy<Volume::mean_stretch>(j);
        phi = law.by_sign ? chosen(kappa, phi, stretch) : stretch;
    }
    return kappa * phi + splat<V>(law.crush) * crush_energy(above_zero(splat<V>(T(law.crush_ratio - 1)) - j));
}

/// Mean edges a, b, c of the positions whose changes are u.
template <class S, class V>
HYBMSS_INLINE void edges_of(const S (&u)[8][3], V one, S (&edge)[3][3]) {
    const V quarter = splat<V>(Scalar<V>(0.25));
    for (int i = 0; i < 3; ++i) {
        const int bit = 1 << i, next = 1 << (i + 1) % 3, last = 1 << (i + 2) % 3;
        for (int a = 0; a < 3; ++a) {
            edge[i][a] = quarter * (((u[bit][a] - u[0][a]) + (u[bit | next][a] - u[next][a])) +
                                    ((u[bit | last][a] - u[last][a]) + (u[7][a] - u[next | last][a])));
        }
        edge[i][i] = edge[i][i] + one;
    }
}
template <class S>
HYBMSS_INLINE S product_of(const S (&a)[3], const S (&b)[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class S>
HYBMSS_INLINE void cross_of(const S (&a)[3], const S (&b)[3], S (&out)[3]) {
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = a[j] * b[k] - a[k] * b[j];
    }
}
/// The patterns g_1 to g_4, that a corner moves by the product of its sides but that of the axis i; g_4 by all.
template <class S, class V>
HYBMSS_INLINE void patterns_of(const S (&u)[8][3], V eighth, S (&g)[4][3]) {
    for (int a = 0; a < 3; ++a) {
        const S low = (u[3][a] - u[2][a]) - (u[1][a] - u[0][a]), high = (u[7][a] - u[6][a]) - (u[5][a] - u[4][a]);
        const S up = (u[4][a] - u[0][a]), up_x = (u[5][a] - u[1][a]), up_y = (u[6][a] - u[2][a]),
                up_xy = (u[7][a] - u[3][a]);
        g[0][a] = eighth * ((up_y + up_xy) - (up + up_x));
        g[1][a] = eighth * ((up_x + up_xy) - (up + up_y));
        g[2][a] = eighth * (low + high);
        g[3][a] = eighth * (high - low);
    }
}

/// The tensions that p_ij have in excess: by p as they are and by those of the cell's size.
template <class S, class V>
HYBMSS_INLINE void pattern_tensions(const S (&p)[3][3], const RestSize<V>& size, const ActuationLaw<Scalar<V>>& law,
                                    S (&q)[3][3]) {
    const V bending = splat<V>(law.bending), coupling = splat<V>(law.coupling), twist = splat<V>(law.twist),
            joint = splat<V>(law.joint_twist);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const auto of = [&](V own, V other)
                                HYBMSS_INLINE_BODY { return own * (own * p[i][j] + other * (coupling * p[j][i])); };
            if (i != j) {
                q[i][j] = bending * (of(size.pattern[i][j], size.pattern[j][i]) - of(splat<V>(1), splat<V>(1)));
            }
        }
    }
    const S made = p[0][0] + p[1][1] + p[2][2];
    const S own = size.pattern[0][0] * p[0][0] + size.pattern[1][1] * p[1][1] + size.pattern[2][2] * p[2][2];
    for (int i = 0; i < 3; ++i) {
        const V by = size.pattern[i][i];
        q[i][i] = twist * ((by * by - splat<V>(1)) * p[i][i]) + joint * (by * own - made);
    }
}

/// The forces on the corners, over G h^2: of a cell whose corners have moved by u, a pattern of changes from corner 0.
template <bool means, class S, class V>
HYBMSS_INLINE void actuated_cell_forces(const S (&u)[8][3], const RestSize<V>& size, V kappa,
                                        const ActuationLaw<Scalar<V>>& law, S (&f)[8][3]) {
    using T = Scalar<V>;
    const V one = splat<V>(1);
    S edge[3][3], pull[3][3];
    edges_of(u, one, edge);
    for (int i = 0; i < 3; ++i) {
        cross_of(edge[(i + 1) % 3], edge[(i + 2) % 3], pull[i]);
    }
    const S volume = product_of(edge[0], pull[0]);
    const S pressure =
        volume_tension(size.inverse_volume * volume - one, kappa, law) - volume_tension(volume - one, kappa, law);
    for (auto& of_edge : pull) {
        for (S& component : of_edge) {
            component = pressure * component;
        }
    }
    S g[4][3], n[3][3]; // what the patterns feel
    if constexpr (means) {
        const auto spring = [&]<int axes>(int bits, std::integral_constant<int, axes>, V stiffness, int x, int y,
                                          int z) HYBMSS_INLINE_BODY {
            const int sign[3] = {x, y, z};
            S d[3];
            for (int a = 0; a < 3; ++a) {
                d[a] = with_value(edge[0][a], splat<V>(0));
                for (int i = 0; i < 3; ++i) {
                    d[a] = sign[i] > 0 ? d[a] + edge[i][a] : sign[i] < 0 ? d[a] - edge[i][a] : d[a];
                }
            }
            const S t = stiffness * spring_tension<axes>(product_of(d, d), bits, size, law);
            for (int i = 0; i < 3; ++i) {
                for (int a = 0; a < 3; ++a) {
                    pull[i][a] = sign[i] > 0 ? pull[i][a] + t * d[a] : sign[i] < 0 ? pull[i][a] - t * d[a] : pull[i][a];
                }
            }
        };
        const V e = splat<V>(law.edge), face = splat<V>(law.face), cube = splat<V>(law.cube);
        constexpr std::integral_constant<int, 1> kOne;
        constexpr std::integral_constant<int, 2> kTwo;
        constexpr std::integral_constant<int, 3> kThree;
        spring(1, kOne, e, 1, 0, 0);
        spring(2, kOne, e, 0, 1, 0);
        spring(4, kOne, e, 0, 0, 1);
        for (const int sign : {-1, 1}) {
            spring(3, kTwo, face, 1, sign, 0);
            spring(5, kTwo, face, 1, 0, sign);
            spring(6, kTwo, face, 0, 1, sign);
            spring(7, kThree, cube, 1, sign, 1);
            spring(7, kThree, cube, 1, sign, -1);
        }
        patterns_of(u, splat<V>(T(0.125)), g);
        S p[3][3], q[3][3];
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                p[i][j] = product_of(g[i], edge[j]);
            }
        }
        pattern_tensions(p, size, law, q);
        for (int a = 0; a < 3; ++a) {
            for (int i = 0; i < 3; ++i) {
                n[i][a] = q[i][0] * edge[0][a] + q[i][1] * edge[1][a] + q[i][2] * edge[2][a];
                pull[i][a] = pull[i][a] + (q[0][i] * g[0][a] + q[1][i] * g[1][a] + q[2][i] * g[2][a]);
            }
            g[3][a] = splat<V>(law.fourth) * (size.fourth - one) * g[3][a];
        }
    }
    const V quarter = splat<V>(T(0.25)), eighth = splat<V>(T(0.125));
    for (int c = 0; c < 8; ++c) {
        for (int a = 0; a < 3; ++a) {
            const auto signed_sum = [](bool plus, const S& sum, const S& more)
                                        HYBMSS_INLINE_BODY { return plus ? sum + more : sum - more; };
            const bool x = (c & 1) != 0, y = (c & 2) != 0, z = (c & 4) != 0;
            // Against the sides: minus the derivative of the energy.
            S sum = signed_sum(!x, with_value(pull[0][a], splat<V>(0)), pull[0][a]);
            sum = signed_sum(!z, signed_sum(!y, sum, pull[1][a]), pull[2][a]);
            f[c][a] = quarter * sum;
            if constexpr (means) {
                S even = signed_sum(y != z, with_value(n[0][a], splat<V>(0)), n[0][a]);
                even = signed_sum(x != y, signed_sum(x != z, even, n[1][a]), n[2][a]);
                f[c][a] = f[c][a] + eighth * signed_sum((x != y) == z, even, g[3][a]);
            }
        }
    }
    if constexpr (!means) {
        const auto spring = [&]<int axes>(int low, int high, std::integral_constant<int, axes>,
                                          V stiffness) HYBMSS_INLINE_BODY {
            S d[3];
            for (int a = 0; a < 3; ++a) {
                d[a] = u[high][a] - u[low][a];
                const int side = (high >> a & 1) - (low >> a & 1);
                d[a] = side > 0 ? d[a] + one : side < 0 ? d[a] - one : d[a];
            }
            const S t = stiffness * spring_tension<axes>(product_of(d, d), low ^ high, size, law);
            for (int a = 0; a < 3; ++a) {
                const S force = t * d[a];
                f[low][a] = f[low][a] + force;
                f[high][a] = f[high][a] - force;
            }
        };
        const V e = splat<V>(law.edge), face = splat<V>(law.face), cube = splat<V>(law.cube);
        for (int low = 0; low < 8; ++low) {
            for (int high = low + 1; high < 8; ++high) {
                const int bits = low ^ high, axes = (bits & 1) + (bits >> 1 & 1) + (bits >> 2);
                if (axes == 1) {
                    spring(low, high, std::integral_constant<int, 1>{}, e);
                } else if (axes == 2) {
                    spring(low, high, std::integral_constant<int, 2>{}, face);
                } else {
                    spring(low, high, std::integral_constant<int, 3>{}, cube);
                }
            }
        }
    }
}

/// Their energy, over G h^3.
template <bool means, class V>
HYBMSS_INLINE V actuated_cell_energy(const V (&u)[8][3], const RestSize<V>& size, V kappa,
                                     const ActuationLaw<Scalar<V>>& law) {
    using T = Scalar<V>;
    const V one = splat<V>(1), half = splat<V>(T(0.5));
    V edge[3][3], area[3];
    edges_of(u, one, edge);
    cross_of(edge[1], edge[2], area);
    const V volume = product_of(edge[0], area);
    V sum = size.volume * volume_energy_of(size.inverse_volume * volume - one, kappa, law) -
            volume_energy_of(volume - one, kappa, law);
    const V e = splat<V>(law.edge), face = splat<V>(law.face), cube = splat<V>(law.cube);
    const auto add = [&](int bits, const V(&d)[3]) HYBMSS_INLINE_BODY {
        const int axes = (bits & 1) + (bits >> 1 & 1) + (bits >> 2);
        const V s = product_of(d, d);
        sum = sum + (axes == 1   ? e * spring_energy<1>(s, bits, size, law)
                     : axes == 2 ? face * spring_energy<2>(s, bits, size, law)
                                 : cube * spring_energy<3>(s, bits, size, law));
    };
    V d[3];
    if constexpr (means) {
        for (int bits = 1; bits < 8; ++bits) {
            // The last of the axes has the sign +, those before it both.
            const int last = bits >= 4 ? 2 : bits >= 2 ? 1 : 0;
            for (int signs = 0; signs < (1 << last); ++signs) {
                if ((signs & ~bits) != 0) {
                    continue;
                }
                for (int a = 0; a < 3; ++a) {
                    d[a] = edge[last][a];
                    for (int i = 0; i < last; ++i) {
                        if ((bits >> i & 1) != 0) {
                            d[a] = (signs >> i & 1) != 0 ? d[a] - edge[i][a] : d[a] + edge[i][a];
                        }
                    }
                }
                add(bits, d);
            }
        }
        V g[4][3], p[3][3], q[3][3];
        patterns_of(u, splat<V>(T(0.125)), g);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                p[i][j] = product_of(g[i], edge[j]);
            }
        }
        pattern_tensions(p, size, law, q);
        for (int i = 0; i < 3; ++i) {
            sum = sum + half * product_of(q[i], p[i]);
        }
        sum = sum + half * splat<V>(law.fourth) * (size.fourth - one) * product_of(g[3], g[3]);
    } else {
        for (int low = 0; low < 8; ++low) {
            for (int high = low + 1; high < 8; ++high) {
                for (int a = 0; a < 3; ++a) {
                    const int side = (high >> a & 1) - (low >> a & 1);
                    d[a] = u[high][a] - u[low][a];
                    d[a] = side > 0 ? d[a] + one : side < 0 ? d[a] - one : d[a];
                }
                add(low ^ high, d);
            }
        }
    }
    return sum;
}

} // namespace
} // namespace hybmss::kernels
