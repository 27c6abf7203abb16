#pragma once

#include "kernels/hessian_arguments.hpp"
#include "kernels/lattice/active_rows_impl.hpp"
#include "kernels/lattice/lattice_layer_impl.hpp"
#include "kernels/spring_hessian.hpp"

// The product K(u) p of a lattice, in the same sweep as its forces (lattice_layer_impl.hpp).

namespace hybmss::kernels {
namespace {

/// Of a field with three components: those of a row of node vectors, and of their neighbours one further in x.
template <class V>
HYBMSS_INLINE void load_row(const Scalar<V>* const (&field)[3], std::ptrdiff_t n, Vector3<V>& low, Vector3<V>& high) {
    low = {load_lanes<V>(field[0] + n), load_lanes<V>(field[1] + n), load_lanes<V>(field[2] + n)};
    high = {load_lanes<V>(field[0] + n + 1), load_lanes<V>(field[1] + n + 1), load_lanes<V>(field[2] + n + 1)};
}

/// The eight corners of a vector of cells.
template <class V, class Layer>
HYBMSS_INLINE void load_cells(const Layer& layer, const Scalar<V>* const (&field)[3], const CellRows& at,
                              Vector3<V> (&corner)[8]) {
    load_row<V>(field, at.low, corner[0], corner[1]);
    load_row<V>(field, at.low_y, corner[2], corner[3]);
    load_row<V>(field, layer.plane + at.high, corner[4], corner[5]);
    load_row<V>(field, layer.plane + at.high_y, corner[6], corner[7]);
}

// Flat or active rows, found out at run time: a vector of cells has work enough to hide the question. So all layouts
// share these kernels.
template <class V, class Layer>
HYBMSS_INLINE CellRows hessian_rows(const Layer& layer, std::ptrdiff_t n) {
    return layer.neighbors ? listed_rows<V>(layer, n) : rows_at(layer, n);
}
/// The first vector: in active rows, the one at 0 is void.
template <class V, class Layer>
HYBMSS_INLINE std::ptrdiff_t first_vector(const Layer& layer) {
    return layer.neighbors ? kWidth<V> : 0;
}
/// All that a sweep adds to in `above`.
template <class V, class T, int components>
HYBMSS_INLINE void clear_above(const LatticeHessianLayer<T, components>& layer) {
    const std::ptrdiff_t end = layer.neighbors ? layer.upper_lanes : layer.plane;
    for (int c = 0; c < components; ++c) {
        for (std::ptrdiff_t n = 0; n < end; n += kWidth<V>) {
            store_lanes(layer.above[c] + n, splat<V>(0));
        }
    }
}

/// What a law makes of p_a - p_b for each spring of a group, by the pair of its corners: what it adds at a, and
/// subtracts at b.
template <class V, class... Springs>
struct SpringProducts {
    Vector3<V> value[sizeof...(Springs)];

    template <int a, int b>
    HYBMSS_INLINE const Vector3<V>& at() const {
        int i = 0, found = 0;
        ((found = Springs::a == a && Springs::b == b ? i : found, ++i), ...);
        return value[found];
    }
};

template <Accuracy accuracy, SpringLaw law, class V, int corners, class... Springs>
HYBMSS_INLINE SpringProducts<V, Springs...> spring_products(SpringGroup<Springs...>, const Vector3<V> (&u)[corners],
                                                            const Vector3<V> (&p)[corners], const V (&k)[7],
                                                            const StiffeningConstants<Scalar<V>>& constants) {
    SpringProducts<V, Springs...> product;
    const V s[] = {Springs::stretch(u[Springs::b] - u[Springs::a])...};
    V t[sizeof...(Springs)];
    one_minus_rsqrt<accuracy>(s, t);
    int i = 0;
    const auto multiply = [&](auto spring) {
        using Spring = decltype(spring);
        const Vector3<V> d = Spring::vector(u[Spring::b] - u[Spring::a]);
        Vector3<V> difference;
        if constexpr (law == SpringLaw::stiffening) {
            difference = {-d.x, -d.y, -d.z};
        } else {
            difference = p[Spring::a] - p[Spring::b];
        }
        product.value[i] =
            law_product<law>(k[Spring::kKind], s[i], t[i], splat<V>(static_cast<Scalar<V>>(1.0 / Spring::kLength2)), d,
                             difference, constants);
        ++i;
    };
    (multiply(Springs{}), ...);
    return product;
}

/// Adds the product of a vector of cells' volumes to that of their cube diagonals, on the corners 0 to 3.
///
/// With V' = 4a . (S x T) / 32, the gradient with respect to cube diagonal 0 is (S x T + T x 4a) / 32, and so on
/// (lattice_cell.hpp). K p is its change, kappa [ phi'' dJ grad V' + phi' d grad V' ], when the corners move by p:
///
///     dJ = (d4a . (S x T) + dS . (T x 4a) + dT . (4a x S)) / 32,  d(S x T) = dS x T + S x dT, ...
template <Volume volume, class V>
HYBMSS_INLINE void add_volume_product(const Vector3<V> (&u)[8], const Vector3<V> (&p)[8], V scale,
                                      Vector3<V> (&product)[4]) {
    const CellVolume<V> cell = cell_volume(u[7] - u[0], u[6] - u[1], u[5] - u[2], u[4] - u[3]);
    const VolumeDerivatives<V> phi = volume_derivatives<volume>(cell.dilation);
    const Vector3<V> p0 = p[0] - p[7], p1 = p[1] - p[6], p2 = p[2] - p[5], p3 = p[3] - p[4];
    const Vector3<V> ds = p0 + p1, dt = p2 + p3, da = (p0 - p1) + (p2 - p3);
    const V change =
        (dot(da, cell.st) + dot(ds, cell.ta) + dot(dt, cell.as)) * splat<V>(static_cast<Scalar<V>>(1.0 / 32.0));
    const V along = scale * phi.curvature * change, pressure = scale * phi.slope;
    const Vector3<V> ws = scaled(pressure, ds), wt = scaled(pressure, dt), wa = scaled(pressure, da);
    const Vector3<V> st = add_cross(cell.s, wt, add_cross(ws, cell.t, scaled(along, cell.st)));
    const Vector3<V> ta = add_cross(cell.t, wa, add_cross(wt, cell.a, scaled(along, cell.ta)));
    const Vector3<V> as = add_cross(cell.a, ws, add_cross(wa, cell.s, scaled(along, cell.as)));
    product[0] = product[0] + (st + ta);
    product[1] = product[1] + (ta - st);
    product[2] = product[2] + (st + as);
    product[3] = product[3] + (as - st);
}

/// One layer of cells: adds K p, or what another law makes of p, to `partial`, sets `above`. Rows meet and are stored
/// as in lattice_layer.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V, SpringLaw law = SpringLaw::elastic>
void lattice_hessian_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    clear_above<V>(layer);
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[8], p[8];
        load_cells<V>(layer, layer.displacement, at, u);
        if constexpr (law != SpringLaw::stiffening) {
            load_cells<V>(layer, layer.direction, at, p);
        }
        V k[7];
        for (int kind = 0; kind < 7; ++kind) {
            k[kind] = load_lanes<V>(layer.stiffness[kind] + n);
        }
        const auto diagonals = spring_products<accuracy, law>(CubeDiagonals{}, u, p, k, layer.stiffening);
        Vector3<V> f[4] = {diagonals.template at<0, 7>(), diagonals.template at<1, 6>(), diagonals.template at<2, 5>(),
                           diagonals.template at<3, 4>()};
        if constexpr (volume != Volume::none) {
            add_volume_product<volume>(u, p, k[6] * splat<V>(layer.volume_ratio), f);
        }
        const auto springs = spring_products<accuracy, law>(EdgesAndFaces<face_diagonals>{}, u, p, k, layer.stiffening);
        const Vector3<V>&x = springs.template at<0, 1>(), &y = springs.template at<0, 2>(),
              &z = springs.template at<0, 4>();

        // Corners 4 to 7 get the opposite: held, and merged, with the sign reversed.
        Vector3<V> f0 = f[0] + x + y + z, minus_f6 = f[1], minus_f5 = f[2], minus_f4 = f[3] + z;
        f[1] = f[1] - x;
        f[2] = f[2] - y;
        Vector3<V> f3 = f[3];
        if constexpr (face_diagonals) {
            const Vector3<V>&xy = springs.template at<0, 3>(), &yx = springs.template at<1, 2>(),
                  &xz = springs.template at<0, 5>(), &zx = springs.template at<1, 4>(),
                  &yz = springs.template at<0, 6>(), &zy = springs.template at<2, 4>();
            f0 = f0 + xy + xz + yz;
            minus_f6 = minus_f6 + yz;
            minus_f5 = minus_f5 + xz;
            minus_f4 = minus_f4 + zx + zy;
            f3 = f3 - xy;
            f[1] = f[1] + yx + zx;
            f[2] = f[2] - yx + zy;
        }
        store_force<V>(layer.above, at.high_y,
                       load_force<V>(layer.above, at.high_y) - minus_f6 - next_column(f[0], carry.high_y));
        store_force<V>(layer.above, at.high,
                       load_force<V>(layer.above, at.high) - minus_f4 - next_column(minus_f5, carry.high));
        store_force<V>(layer.partial, at.low_y,
                       load_force<V>(layer.partial, at.low_y) + f[2] + next_column(f3, carry.low_y));
        store_force<V>(layer.partial, n, load_force<V>(layer.partial, n) + f0 + next_column(f[1], carry.low));
    }
}

/// The topmost node plane, above which there are no cells; `above` is not touched.
template <bool face_diagonals, Accuracy accuracy, class V, SpringLaw law = SpringLaw::elastic>
void lattice_hessian_product_top(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    const V zero = splat<V>(0);
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[4], p[4];
        load_row<V>(layer.displacement, n, u[0], u[1]);
        load_row<V>(layer.displacement, at.low_y, u[2], u[3]);
        if constexpr (law != SpringLaw::stiffening) {
            load_row<V>(layer.direction, n, p[0], p[1]);
            load_row<V>(layer.direction, at.low_y, p[2], p[3]);
        }
        V k[7];
        for (int kind : {0, 1, 3}) {
            k[kind] = load_lanes<V>(layer.stiffness[kind] + n);
        }
        const auto springs = spring_products<accuracy, law>(PlaneSprings<face_diagonals>{}, u, p, k, layer.stiffening);
        const Vector3<V>&x = springs.template at<0, 1>(), &y = springs.template at<0, 2>();
        Vector3<V> f0 = x + y, minus_f1 = x, minus_f2 = y, minus_f3{zero, zero, zero};
        if constexpr (face_diagonals) {
            const Vector3<V>&xy = springs.template at<0, 3>(), &yx = springs.template at<1, 2>();
            f0 = f0 + xy;
            minus_f1 = minus_f1 - yx;
            minus_f2 = minus_f2 + yx;
            minus_f3 = xy;
        }
        store_force<V>(layer.partial, at.low_y,
                       load_force<V>(layer.partial, at.low_y) - minus_f2 - next_column(minus_f3, carry.low_y));
        store_force<V>(layer.partial, n, load_force<V>(layer.partial, n) + f0 - next_column(minus_f1, carry.low));
    }
}

/// partial += above, where two slabs meet.
template <int components, class V>
void lattice_hessian_join(const LatticeHessianLayer<Scalar<V>, components>& layer) {
    for (int c = 0; c < components; ++c) {
        for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
            store_lanes(layer.partial[c] + n, load_lanes<V>(layer.partial[c] + n) + load_lanes<V>(layer.above[c] + n));
        }
    }
}

} // namespace
} // namespace hybmss::kernels
