// Compiled once for each instruction set: the sweeps behind spring_forms.hpp. Everything is in an anonymous namespace
// for the reason that kernels/simd.hpp gives.
#include "bench/limits/spring_forms.hpp"
#include "kernels/compiled_set.hpp"

#include <utility>

namespace hybmss::bench {
namespace {

using namespace hybmss::kernels;

/// 1 - 1 / sqrt(1 + s): the library's own levels.
template <Root root, class V>
HYBMSS_INLINE V factor_of_stretch(V s) {
    constexpr Accuracy kLevels[kRoots] = {Accuracy::fast, Accuracy::accurate, Accuracy::exact};
    return one_minus_rsqrt<kLevels[static_cast<int>(root)]>(s);
}

/// 1 - 1 / sqrt(w), w = |d|^2 / l^2. A Newton step t <- t (3 - w t^2) / 2 doubles the digits.
template <Root root, class V>
HYBMSS_INLINE V factor_of_length(V w) {
    const V one = splat<V>(1);
    w = maximum(w, splat<V>(Scalar<V>(0x1p-20)));
    if constexpr (root == Root::exact) {
        return one - divide(one, square_root(w));
    } else {
        V t = reciprocal_square_root_seed(w);
        constexpr int kNewton = root == Root::approximate ? 0 : Traits<V>::kFloat ? 1 : 2;
        for (int step = 0; step < kNewton; ++step) {
            const V half = splat<V>(Scalar<V>(0.5));
            t = t * multiply_add(half, subtract_product(w, t * t, one), one);
        }
        return one - t;
    }
}

template <StateForm form, Root root, int rx, int ry, int rz, class V>
HYBMSS_INLINE void add_spring(const SpringGrid<Scalar<V>>& grid, std::ptrdiff_t from, std::ptrdiff_t to, V stiffness,
                              V (&force)[3]) {
    using T = Scalar<V>;
    constexpr T kRest[3] = {T(rx), T(ry), T(rz)};
    constexpr T kInverse = T(1) / T(rx * rx + ry * ry + rz * rz);
    V d[3];
    for (int c = 0; c < 3; ++c) {
        d[c] = load_lanes<V>(grid.state[c] + to) - load_lanes<V>(grid.state[c] + from);
    }
    V square = d[0] * d[0];
    square = multiply_add(d[1], d[1], square);
    square = multiply_add(d[2], d[2], square);
    V factor;
    if constexpr (form == StateForm::displacement) {
        for (int c = 0; c < 3; ++c) {
            if (kRest[c] != 0) {
                square = multiply_add(splat<V>(2 * kRest[c]), d[c], square);
                d[c] = d[c] + splat<V>(kRest[c]);
            }
        }
        factor = factor_of_stretch<root>(square * splat<V>(kInverse));
    } else {
        factor = factor_of_length<root>(square * splat<V>(kInverse));
    }
    const V tension = stiffness * factor;
    for (int c = 0; c < 3; ++c) {
        force[c] = multiply_add(tension, d[c], force[c]);
    }
}

template <StateForm form, Root root, std::size_t direction, class V>
HYBMSS_INLINE void add_direction(const SpringGrid<Scalar<V>>& grid, std::ptrdiff_t n, V (&force)[3]) {
    constexpr int rx = kDirections[direction][0], ry = kDirections[direction][1], rz = kDirections[direction][2];
    const std::ptrdiff_t step = rx + ry * grid.row + rz * grid.plane;
    const Scalar<V>* stiffness = grid.stiffness[direction];
    add_spring<form, root, rx, ry, rz>(grid, n, n + step, load_lanes<V>(stiffness + n), force);
    add_spring<form, root, -rx, -ry, -rz>(grid, n, n - step, load_lanes<V>(stiffness + n - step), force);
}

template <StateForm form, Root root, class V, std::size_t... directions>
HYBMSS_INLINE void sweep_node(const SpringGrid<Scalar<V>>& grid, std::ptrdiff_t n, std::index_sequence<directions...>) {
    V force[3] = {splat<V>(0), splat<V>(0), splat<V>(0)};
    (add_direction<form, root, directions>(grid, n, force), ...);
    for (int c = 0; c < 3; ++c) {
        store_lanes(grid.force[c] + n, force[c]);
    }
}

template <StateForm form, Root root, class V>
void sweep(const SpringGrid<Scalar<V>>& grid) {
    for (std::ptrdiff_t n = 0; n < grid.nodes; n += kWidth<V>) {
        sweep_node<form, root, V>(grid, n, std::make_index_sequence<kSpringDirections>{});
    }
}

/// Null where there is no such sweep: without an estimate, and of displacements where a level is the next better one.
template <StateForm form, Root root, class V>
constexpr SpringSweep<Scalar<V>> sweep_of() {
    constexpr Seed kSeed = seed_quality<V>();
    constexpr bool kSame = form == StateForm::displacement && ((root == Root::refined && kSeed == Seed::bits11) ||
                                                               (root == Root::approximate && kSeed == Seed::bits8));
    if constexpr ((root != Root::exact && kSeed == Seed::none) || kSame) {
        return nullptr;
    } else {
        return sweep<form, root, V>;
    }
}

template <StateForm form, class V>
constexpr void set_form(SpringSweep<Scalar<V>> (&sweeps)[kStateForms][kRoots]) {
    auto& row = sweeps[static_cast<int>(form)];
    row[static_cast<int>(Root::approximate)] = sweep_of<form, Root::approximate, V>();
    row[static_cast<int>(Root::refined)] = sweep_of<form, Root::refined, V>();
    row[static_cast<int>(Root::exact)] = sweep_of<form, Root::exact, V>();
}

constexpr SpringForms all_forms() {
    SpringForms forms{};
    set_form<StateForm::displacement, FloatBatch>(forms.float_sweeps);
    set_form<StateForm::position, FloatBatch>(forms.float_sweeps);
    set_form<StateForm::displacement, DoubleBatch>(forms.double_sweeps);
    set_form<StateForm::position, DoubleBatch>(forms.double_sweeps);
    return forms;
}

} // namespace

namespace HYBMSS_KERNEL_SET {
extern const SpringForms spring_forms;
constinit const SpringForms spring_forms = all_forms();
} // namespace HYBMSS_KERNEL_SET

} // namespace hybmss::bench
