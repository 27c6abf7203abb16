// Compiled once for each instruction set: stress, strain and energy of cells.
//
// P = 1/V0 sum k (1 - l/|d|) d (x) r over a cell's share of its springs + phi'(J) cof F, and of what else stores energy
// (hybmss/stress.hpp). All 28 springs between the corners are computed for every cell: to share those of neighbours
// would be half as much arithmetic, but needs rows of cells that have all their neighbours. Springs on means are
// computed from the Green strain: s = |d|^2/l^2 - 1 = 2 n.E n, and P = F sum k t r (x) r.
#include "kernels/compiled_set.hpp"
#include "kernels/volume_law.hpp"

#include <utility>

namespace hybmss::kernels {
namespace {

/// -1, 0 or 1 along each axis of the 13 directions, one of r and -r each.
constexpr int rest_of(int direction, int axis) {
    const int number = 14 + direction;
    return (axis == 0 ? number : axis == 1 ? number / 3 : number / 9) % 3 - 1;
}
constexpr int axes_of(int direction) {
    int axes = 0;
    for (int axis = 0; axis < 3; ++axis) {
        axes += rest_of(direction, axis) != 0;
    }
    return axes;
}
/// Where the n-th spring of a direction begins and ends, by corner.
constexpr int corner_of(int direction, int n, bool end) {
    for (int from = 0; from < 8; ++from) {
        int to = from;
        bool inside = true;
        for (int axis = 0; axis < 3; ++axis) {
            const bool high = (from >> axis & 1) != 0;
            inside = inside && !(rest_of(direction, axis) > 0 && high) && !(rest_of(direction, axis) < 0 && !high);
            to ^= (rest_of(direction, axis) != 0) << axis;
        }
        if (inside && n-- == 0) {
            return end ? to : from;
        }
    }
    return 0;
}

/// What is summed up of a vector of cells.
template <class V>
struct Stored {
    V piola[3][3], density;
};

/// Springs of one direction with these changes of their vectors; together they are of a whole cell.
template <int direction, bool stiffening, Accuracy accuracy, class V, std::size_t count>
HYBMSS_INLINE void add_springs(const StressCells<Scalar<V>>& cells, const V (&change)[count][3], Stored<V>& sum) {
    using T = Scalar<V>;
    constexpr int kAxes = axes_of(direction);
    const auto k = [](double value) HYBMSS_INLINE_BODY { return splat<V>(static_cast<T>(value)); };
    V s[count], t[count], pull[3] = {k(0), k(0), k(0)}, energy = k(0);
    for (std::size_t n = 0; n < count; ++n) {
        V along = k(0); // r . du, the first without a sum
        bool first = true;
        for (int axis = 0; axis < 3; ++axis) {
            const int r = rest_of(direction, axis);
            if (r != 0) {
                along = first ? (r > 0 ? change[n][axis] : k(0) - change[n][axis])
                              : (r > 0 ? along + change[n][axis] : along - change[n][axis]);
                first = false;
            }
        }
        V q = along + along;
        for (int axis = 0; axis < 3; ++axis) {
            q = multiply_add(change[n][axis], change[n][axis], q);
        }
        s[n] = kAxes == 1 ? q : q * k(1.0 / kAxes);
    }
    one_minus_rsqrt<accuracy>(s, t);
    for (std::size_t n = 0; n < count; ++n) {
        const V w = maximum(s[n] + k(1), k(Traits<V>::kFloat ? 0x1p-20 : 0x1p-40)); // as t bounds it
        energy = multiply_add(t[n] * t[n], w, energy);
        V factor = t[n];
        if constexpr (stiffening) {
            factor = factor + law_factors<SpringLaw::stiffening>(s[n], t[n], cells.stiffening).isotropic;
            energy = energy + k(2) * stiffening_energy(s[n], cells.stiffening);
        }
        for (int axis = 0; axis < 3; ++axis) {
            const int r = rest_of(direction, axis);
            pull[axis] = multiply_add(factor, r == 0 ? change[n][axis] : change[n][axis] + k(r), pull[axis]);
        }
    }
    const T modulus = cells.springs[kAxes - 1] * static_cast<T>(1.0 / count);
    sum.density = multiply_add(splat<V>(modulus * static_cast<T>(0.5 * kAxes)), energy, sum.density);
    for (int i = 0; i < 3; ++i) {
        const V p = splat<V>(modulus) * pull[i];
        for (int j = 0; j < 3; ++j) {
            const int r = rest_of(direction, j);
            if (r != 0) {
                sum.piola[i][j] = r > 0 ? sum.piola[i][j] + p : sum.piola[i][j] - p;
            }
        }
    }
}

template <int direction, bool stiffening, Accuracy accuracy, class V>
HYBMSS_INLINE void add_direction(const StressCells<Scalar<V>>& cells, const V (&u)[8][3], Stored<V>& sum) {
    constexpr int kAxes = axes_of(direction), kCount = 8 >> kAxes;
    if (kAxes == 2 && !(cells.springs[1] > 0)) { // six of thirteen, for all cells or none
        return;
    }
    V change[kCount][3];
    for (int n = 0; n < kCount; ++n) {
        for (int i = 0; i < 3; ++i) {
            change[n][i] = u[corner_of(direction, n, true)][i] - u[corner_of(direction, n, false)][i];
        }
    }
    add_springs<direction, stiffening, accuracy>(cells, change, sum);
}

/// Of a symmetric matrix: xx, yy, zz, xy, yz, xz.
constexpr int entry(int a, int b) {
    return a == b ? a : a + b == 1 ? 3 : a + b == 3 ? 4 : 5;
}

/// Springs on means of one direction; `green` is twice the strain, `tension` the sum of k t r (x) r.
template <int direction, bool stiffening, Accuracy accuracy, class V>
HYBMSS_INLINE void add_mean_spring(const StressCells<Scalar<V>>& cells, const V (&green)[6], V (&tension)[6],
                                   V& density) {
    using T = Scalar<V>;
    constexpr int kAxes = axes_of(direction);
    if (kAxes == 2 && !(cells.springs[1] > 0)) {
        return;
    }
    V normal = splat<V>(0), shear = splat<V>(0);
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, r = rest_of(direction, a) * rest_of(direction, b);
        normal = rest_of(direction, a) == 0 ? normal : normal + green[a];
        shear = r == 0 ? shear : r > 0 ? shear + green[entry(a, b)] : shear - green[entry(a, b)];
    }
    V s = kAxes == 1 ? normal : normal + (shear + shear);
    s = kAxes == 1 ? s : s * splat<V>(T(1.0 / kAxes));
    const V t = one_minus_rsqrt<accuracy>(s);
    const V w = maximum(s + splat<V>(1), splat<V>(static_cast<T>(Traits<V>::kFloat ? 0x1p-20 : 0x1p-40)));
    V factor = t, energy = t * t * w;
    if constexpr (stiffening) {
        factor = factor + law_factors<SpringLaw::stiffening>(s, t, cells.stiffening).isotropic;
        energy = energy + splat<V>(2) * stiffening_energy(s, cells.stiffening);
    }
    const T modulus = cells.springs[kAxes - 1];
    density = multiply_add(splat<V>(modulus * static_cast<T>(0.5 * kAxes)), energy, density);
    factor = factor * splat<V>(modulus);
    for (int a = 0; a < 3; ++a) {
        for (int b = a; b < 3; ++b) {
            const int r = rest_of(direction, a) * rest_of(direction, b), at = entry(a, b);
            tension[at] = r == 0 ? tension[at] : r > 0 ? tension[at] + factor : tension[at] - factor;
        }
    }
}

template <bool stiffening, Accuracy accuracy, class V>
HYBMSS_INLINE void add_mean_springs(const StressCells<Scalar<V>>& cells, const V (&h)[3][3], const V (&f)[3][3],
                                    Stored<V>& sum) {
    const V zero = splat<V>(0);
    V green[6], tension[6] = {zero, zero, zero, zero, zero, zero};
    for (int a = 0; a < 3; ++a) {
        for (int b = a; b < 3; ++b) {
            V value = h[a][b] + h[b][a];
            for (int m = 0; m < 3; ++m) {
                value = multiply_add(h[m][a], h[m][b], value);
            }
            green[entry(a, b)] = value;
        }
    }
    [&]<int... direction>(std::integer_sequence<int, direction...>) HYBMSS_INLINE_BODY {
        (add_mean_spring<direction, stiffening, accuracy>(cells, green, tension, sum.density), ...);
    }
    (std::make_integer_sequence<int, 13>());
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            for (int m = 0; m < 3; ++m) {
                sum.piola[i][j] = multiply_add(f[i][m], tension[entry(m, j)], sum.piola[i][j]);
            }
        }
    }
}

/// What holds the patterns g that springs on means do not see: p_ij = g_i . F e_j.
template <class V>
HYBMSS_INLINE void add_patterns(const StressCells<Scalar<V>>& cells, const V (&u)[8][3], const V (&f)[3][3],
                                Stored<V>& sum) {
    using T = Scalar<V>;
    V g[4][3]; // their signs: yz, xz, xy, xyz
    for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < 4; ++i) {
            V value = i == 3 ? splat<V>(0) - u[0][axis] : u[0][axis];
            for (int c = 1; c < 8; ++c) {
                const int x = c & 1, y = c >> 1 & 1, z = c >> 2;
                const int high = i == 0 ? y + z : i == 1 ? x + z : i == 2 ? x + y : x + y + z + 1;
                value = high % 2 == 0 ? value + u[c][axis] : value - u[c][axis];
            }
            g[i][axis] = value * splat<V>(T(0.125));
        }
    }
    const auto dot = [](const V(&a)[3], const V& x, const V& y, const V& z)
                         HYBMSS_INLINE_BODY { return multiply_add(a[2], z, multiply_add(a[1], y, a[0] * x)); };
    V p[3][3], q[3][3];
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            p[i][j] = dot(g[i], f[0][j], f[1][j], f[2][j]);
        }
    }
    const V trace = p[0][0] + p[1][1] + p[2][2];
    V energy = splat<V>(cells.fourth) * dot(g[3], g[3][0], g[3][1], g[3][2]);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            q[i][j] = i == j ? multiply_add(splat<V>(cells.twist), p[i][i], splat<V>(cells.joint_twist) * trace)
                             : splat<V>(cells.bending) * multiply_add(splat<V>(cells.coupling), p[j][i], p[i][j]);
            energy = multiply_add(p[i][j], q[i][j], energy);
        }
    }
    sum.density = multiply_add(splat<V>(T(0.5)), energy, sum.density);
    for (int row = 0; row < 3; ++row) {
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 3; ++i) {
                sum.piola[row][j] = multiply_add(g[i][row], q[i][j], sum.piola[row][j]);
            }
        }
    }
}

/// kappa phi(J) by the cells' own energies, and what keeps them from being crushed; j = J - 1.
template <class V>
HYBMSS_INLINE void add_volume(const StressCells<Scalar<V>>& cells, Range first, const V (&f)[3][3], V j,
                              Stored<V>& sum) {
    const V quadratic = load_lanes<V>(cells.quadratic + first), stretch = load_lanes<V>(cells.mean_stretch + first);
    V slope = quadratic * j;
    sum.density = multiply_add(quadratic, volume_energy<Volume::quadratic>(j), sum.density);
    if (any_positive(maximum(stretch, splat<V>(0) - stretch))) { // roots are taken where they are needed
        slope = multiply_add(stretch, volume_slope<Volume::mean_stretch>(j), slope);
        sum.density = multiply_add(stretch, volume_energy<Volume::mean_stretch>(j), sum.density);
    }
    const V depth = maximum(splat<V>(cells.crush_bound) - j, splat<V>(0)), crush = splat<V>(cells.crush);
    slope = multiply_add(crush, crush_derivatives(depth).slope, slope);
    sum.density = multiply_add(crush, crush_energy(depth), sum.density);
    for (int row = 0; row < 3; ++row) {
        const V *const a = f[(row + 1) % 3], *const b = f[(row + 2) % 3];
        for (int column = 0; column < 3; ++column) {
            const int c1 = (column + 1) % 3, c2 = (column + 2) % 3;
            sum.piola[row][column] =
                multiply_add(slope, multiply_subtract(a[c1], b[c2], a[c2] * b[c1]), sum.piola[row][column]);
        }
    }
}

/// Cells [first, first + count), at most a vector of them.
template <class V>
HYBMSS_INLINE void put(const StressCells<Scalar<V>>& cells, int value, Range first, Range count, V v) {
    Scalar<V>* const to = cells.values[value];
    if (!to) {
        return;
    }
    if (count == kWidth<V>) {
        store_lanes(to + first, v);
        return;
    }
    alignas(64) Scalar<V> lanes[kWidth<V>];
    v.store_aligned(lanes);
    for (Range n = 0; n < count; ++n) {
        to[first + n] = lanes[n];
    }
}

/// Of the stored energy's derivative by F = I + h what is asked for.
template <class V>
HYBMSS_INLINE void put_all(const StressCells<Scalar<V>>& cells, Range first, Range count, const V (&h)[3][3],
                           const V (&f)[3][3], V j, const Stored<V>& stored) {
    using T = Scalar<V>;
    constexpr int kA[6] = {0, 1, 2, 0, 1, 0}, kB[6] = {0, 1, 2, 1, 2, 2};
    const V scale = load_lanes<V>(cells.scale + first), half = splat<V>(T(0.5)), zero = splat<V>(0);
    put(cells, kStressVolumeRatio, first, count, j + splat<V>(1));
    put(cells, kStressEnergy, first, count, scale * stored.density);
    V p[3][3];
    for (int i = 0; i < 9; ++i) {
        p[i / 3][i % 3] = scale * stored.piola[i / 3][i % 3];
        put(cells, kStressPiola + i, first, count, p[i / 3][i % 3]);
    }
    const V ratio = j + splat<V>(1);
    const V size = divide(splat<V>(1), maximum(maximum(ratio, zero - ratio), splat<V>(T(1e-9))));
    const V inverse = subtract_product(size + size, one_where_positive(zero - ratio), size); // of the ratio's sign
    V cauchy[6];
    for (int s = 0; s < 6; ++s) {
        const int a = kA[s], b = kB[s];
        V tau = zero, product = zero;
        for (int m = 0; m < 3; ++m) {
            tau = multiply_add(p[a][m], f[b][m], tau);
            product = multiply_add(h[m][a], h[m][b], product);
        }
        for (int m = 0; m < 3 && a != b; ++m) {
            tau = multiply_add(p[b][m], f[a][m], tau);
        }
        cauchy[s] = (a == b ? tau : half * tau) * inverse;
        put(cells, kStressCauchy + s, first, count, cauchy[s]);
        put(cells, kStressGreen + s, first, count, half * (h[a][b] + h[b][a] + product));
    }
    V normal = zero, shear = zero; // of sums of squares
    for (int a = 0; a < 3; ++a) {
        const V difference = cauchy[a] - cauchy[(a + 1) % 3];
        normal = multiply_add(difference, difference, normal);
        shear = multiply_add(cauchy[3 + a], cauchy[3 + a], shear);
    }
    put(cells, kStressVonMises, first, count, square_root(multiply_add(half, normal, splat<V>(3) * shear)));
    put(cells, kStressPressure, first, count, (cauchy[0] + cauchy[1] + cauchy[2]) * splat<V>(T(-1.0 / 3.0)));
}

template <bool on_means, bool stiffening, Accuracy accuracy, class V>
void cell_stress(const StressCells<Scalar<V>>& cells, Range end) {
    using T = Scalar<V>;
    const V zero = splat<V>(0);
    for (Range first = 0; first < end; first += kWidth<V>) {
        const Range count = end - first < kWidth<V> ? end - first : kWidth<V>;
        V u[8][3];
        const bool row = cells.in_a_row[first] >= kWidth<V>;
        for (int c = 0; c < 8; ++c) {
            const std::int32_t* const node = cells.corners[c] + first;
            for (int axis = 0; axis < 3; ++axis) {
                u[c][axis] = row ? load_lanes<V>(cells.displacement[axis] + *node)
                                 : gather_lanes<V>(cells.displacement[axis], node);
            }
        }
        V h[3][3], f[3][3]; // displacement and deformation gradient
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                const int b = 1 << (j + 1) % 3, c = 1 << (j + 2) % 3, up = 1 << j;
                h[i][j] = splat<V>(T(0.25)) * (((u[up][i] - u[0][i]) + (u[up | b][i] - u[b][i])) +
                                               ((u[up | c][i] - u[c][i]) + (u[7][i] - u[b | c][i])));
                f[i][j] = i == j ? h[i][j] + splat<V>(1) : h[i][j];
            }
        }
        Stored<V> stored{{{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}}, zero};
        if constexpr (on_means) {
            add_mean_springs<stiffening, accuracy>(cells, h, f, stored);
            add_patterns(cells, u, f, stored);
        } else {
            [&]<int... direction>(std::integer_sequence<int, direction...>) HYBMSS_INLINE_BODY {
                (add_direction<direction, stiffening, accuracy>(cells, u, stored), ...);
            }
            (std::make_integer_sequence<int, 13>());
        }
        const auto minor = [&](int i, int k)
                               HYBMSS_INLINE_BODY { return multiply_subtract(h[i][i], h[k][k], h[i][k] * h[k][i]); };
        const V yz = minor(1, 2);
        const V determinant =
            multiply_add(h[0][0], yz,
                         multiply_subtract(h[0][2], multiply_subtract(h[1][0], h[2][1], h[1][1] * h[2][0]),
                                           h[0][1] * multiply_subtract(h[1][0], h[2][2], h[1][2] * h[2][0])));
        const V j = (h[0][0] + h[1][1] + h[2][2]) + ((minor(0, 1) + yz) + (minor(0, 2) + determinant));
        add_volume(cells, first, f, j, stored);
        put_all(cells, first, count, h, f, j, stored);
    }
}

} // namespace

HYBMSS_DEFINE_KERNEL(cell_stress);

} // namespace hybmss::kernels
