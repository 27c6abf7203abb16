// Compiled once for each instruction set: the product K(u) p of a lattice, in the same sweep as its forces, and passes
// by other laws of the springs.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian.hpp"

namespace hybmss::kernels {
namespace {

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
    const auto multiply = [&](auto spring) HYBMSS_INLINE_BODY {
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

/// One layer of cells: adds K p, or what another law makes of p, to `partial`, sets `above`. Rows meet and are stored
/// as in lattice_layer.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
void lattice_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    constexpr SpringLaw law = sum.law;
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
        if constexpr (sum.volume != Volume::none) {
            add_volume_product<sum.volume>(u, p, k[6] * splat<V>(layer.volume_ratio), layer.stiffening.geometric, f);
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
template <bool face_diagonals, SpringLaw law, Accuracy accuracy, class V>
void lattice_top_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
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

template <class V>
void lattice_join_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    join_planes<V>(layer);
}

/// Of the springs that start at a plane's nodes; with `top` of the topmost plane's.
template <bool face_diagonals, bool top, class V>
HYBMSS_INLINE double stiffening_energy_of_layer(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    double energy = 0;
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        V k[7];
        for (int kind = 0; kind < 7; ++kind) {
            k[kind] = load_lanes<V>(layer.stiffness[kind] + n);
        }
        Vector3<V> u[8];
        if constexpr (top) {
            load_row<V>(layer.displacement, n, u[0], u[1]);
            load_row<V>(layer.displacement, at.low_y, u[2], u[3]);
            add_in_double(energy, stiffening_energies(PlaneSprings<face_diagonals>{}, u, k, layer.stiffening));
        } else {
            load_cells<V>(layer, layer.displacement, at, u);
            add_in_double(energy, stiffening_energies(CubeDiagonals{}, u, k, layer.stiffening) +
                                      stiffening_energies(EdgesAndFaces<face_diagonals>{}, u, k, layer.stiffening));
        }
    }
    return energy;
}

template <bool face_diagonals, class V>
double lattice_stiffening_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    return stiffening_energy_of_layer<face_diagonals, false, V>(layer);
}
template <bool face_diagonals, class V>
double lattice_top_stiffening_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    return stiffening_energy_of_layer<face_diagonals, true, V>(layer);
}

} // namespace

HYBMSS_DEFINE_KERNEL(lattice_product);
HYBMSS_DEFINE_KERNEL(lattice_top_product);
HYBMSS_DEFINE_COMMON_KERNEL(lattice_join_product);
HYBMSS_DEFINE_ORDERED_KERNEL(lattice_stiffening_energy);
HYBMSS_DEFINE_ORDERED_KERNEL(lattice_top_stiffening_energy);

} // namespace hybmss::kernels
