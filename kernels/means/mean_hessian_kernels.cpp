// Compiled once for each instruction set: second derivatives of springs on means, of lattices and networks, and passes
// by other laws of the springs. The patterns damp as springs do; they do not stiffen. What a vector of cells gives is a
// function for both, which nothing inlines: its arithmetic hides the call, and it is half of all there is to compile.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian.hpp"
#include "kernels/means/cell_corners.hpp"
#include "kernels/means/mean_cell.hpp"

#include <utility>

namespace hybmss::kernels {
namespace {

/// visit(signs of A, B, C in the spring's vector, |d|^2 / l^2 - 1, stiffness by k / 16, l^2 in units of A) of each mean
/// spring.
template <bool face_diagonals, class V, class Visit>
HYBMSS_INLINE void for_each_mean_spring(const CellParts<V>& change, const MeanEdges<V>& edges,
                                        const MeanConstants<Scalar<V>>& constants, const Visit& visit) {
    V s[3];
    edge_stretches(change, s);
    const V edge = splat<V>(constants.edge);
    visit(std::integer_sequence<int, 1, 0, 0>(), s[0], edge);
    visit(std::integer_sequence<int, 0, 1, 0>(), s[1], edge);
    visit(std::integer_sequence<int, 0, 0, 1>(), s[2], edge);
    if constexpr (face_diagonals) {
        V f[6];
        face_stretches(change, edges, s, f);
        const V face = splat<V>(constants.face);
        visit(std::integer_sequence<int, 1, 1, 0>(), f[0], face);
        visit(std::integer_sequence<int, 1, -1, 0>(), f[1], face);
        visit(std::integer_sequence<int, 1, 0, 1>(), f[2], face);
        visit(std::integer_sequence<int, 1, 0, -1>(), f[3], face);
        visit(std::integer_sequence<int, 0, 1, 1>(), f[4], face);
        visit(std::integer_sequence<int, 0, 1, -1>(), f[5], face);
    }
}
/// sum + sign * v
template <int sign, class V>
HYBMSS_INLINE Vector3<V> signed_sum(const Vector3<V>& sum, const Vector3<V>& v) {
    return {signed_sum<sign>(sum.x, v.x), signed_sum<sign>(sum.y, v.y), signed_sum<sign>(sum.z, v.z)};
}
/// The vector with these signs of a, b, c.
template <int a, int b, int c, class V>
HYBMSS_INLINE Vector3<V> combined(const Vector3<V>& va, const Vector3<V>& vb, const Vector3<V>& vc) {
    static_assert(a > 0 || (a == 0 && (b > 0 || (b == 0 && c > 0))), "begins with a plus");
    if constexpr (a > 0) {
        return signed_sum<c>(signed_sum<b>(va, vb), vc);
    } else if constexpr (b > 0) {
        return signed_sum<c>(vb, vc);
    } else {
        return vc;
    }
}

/// K p of a vector of cells, or what another law makes of p: odd_i + even_i at corner i, even_i - odd_i at corner 7 -
/// i. With p the changes of A to G_3 by the direction's, reversed where they are odd: at low corners K p is positive.
/// Units as in mean_cell_forces; `stiffening` the law takes p for nothing.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
[[gnu::noinline]] void mean_cell_product(const Vector3<V> (&u)[8], const Vector3<V> (&p)[8], V k, V kappa,
                                         const MeanConstants<Scalar<V>>& constants,
                                         const StiffeningConstants<Scalar<V>>& stiffening, CornerForces<V>& result) {
    constexpr SpringLaw law = sum.law;
    using T = Scalar<V>;
    const V zero = splat<V>(0);
    const Vector3<V> none{zero, zero, zero};
    const CellParts<V> change = cell_parts(u);
    const MeanEdges<V> edges = mean_edges(change);
    CellParts<V> direction{};
    Vector3<V> pa = none, pb = none, pc = none;
    if constexpr (law != SpringLaw::stiffening) {
        direction = cell_parts(p);
        pa = none - direction.a, pb = none - direction.b, pc = none - direction.c;
    }
    const auto product_of = [&](V stiffness, V s, V inverse_length2, const Vector3<V>& d,
                                const Vector3<V>& moved) HYBMSS_INLINE_BODY {
        return law_product<law>(stiffness, s, one_minus_rsqrt<accuracy>(s), inverse_length2, d,
                                law == SpringLaw::stiffening ? none - d : moved, stiffening);
    };

    Vector3<V> of_a = none, of_b = none, of_c = none;
    for_each_mean_spring<face_diagonals>(
        change, edges, constants,
        [&]<int a, int b, int c>(std::integer_sequence<int, a, b, c>, V s, V stiffness) HYBMSS_INLINE_BODY {
            constexpr double kLength2 = 16.0 * (a * a + b * b + c * c);
            const Vector3<V> f =
                product_of(k * stiffness, s, splat<V>(static_cast<T>(1 / kLength2)),
                           combined<a, b, c>(edges.a, edges.b, edges.c), combined<a, b, c>(pa, pb, pc));
            of_a = signed_sum<a>(of_a, f);
            of_b = signed_sum<b>(of_b, f);
            of_c = signed_sum<c>(of_c, f);
        });
    if constexpr (law == SpringLaw::elastic || law == SpringLaw::damping) {
        // dP = dG . A + G . dA, and the tensions that these make; a dashpot has no more.
        V old[3][3], moved[3][3], w[3][3], dw[3][3];
        pattern_projections(direction.g, edges, moved);
        const MeanEdges<V> reversed = {pa, pb, pc};
        pattern_projections(change.g, reversed, old);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                moved[i][j] = moved[i][j] - old[i][j];
            }
        }
        pattern_tensions(moved, k, constants, dw);
        of_a = of_a - of_edge(dw, 0, change.g);
        of_b = of_b - of_edge(dw, 1, change.g);
        of_c = of_c - of_edge(dw, 2, change.g);
        Vector3<V> patterns[3] = {of_pattern(dw[0], edges), of_pattern(dw[1], edges), of_pattern(dw[2], edges)};
        if constexpr (law == SpringLaw::elastic) {
            pattern_projections(change.g, edges, old);
            pattern_tensions(old, k, constants, w);
            of_a = of_a - of_edge(w, 0, direction.g);
            of_b = of_b - of_edge(w, 1, direction.g);
            of_c = of_c - of_edge(w, 2, direction.g);
            for (int i = 0; i < 3; ++i) {
                patterns[i] = patterns[i] - of_pattern(w[i], reversed);
            }
        }
        corner_sums(patterns[0], patterns[1], patterns[2], result.even);
    } else {
        corner_sums(none, none, none, result.even);
    }

    const Vector3<V> along = of_b + of_c, against = of_c - of_b;
    Vector3<V>(&odd)[4] = result.odd;
    odd[0] = of_a + along, odd[1] = along - of_a, odd[2] = of_a + against, odd[3] = against - of_a;
    const auto add_diagonal = [&](auto spring, int i) HYBMSS_INLINE_BODY {
        using Spring = decltype(spring);
        odd[i] = odd[i] + product_of(k, Spring::stretch(change.diagonal[i]), splat<V>(static_cast<T>(1.0 / 3)),
                                     Spring::vector(change.diagonal[i]), none - direction.diagonal[i]);
    };
    add_diagonal(CellSpring<0, 7>(), 0);
    add_diagonal(CellSpring<1, 6>(), 1);
    add_diagonal(CellSpring<2, 5>(), 2);
    add_diagonal(CellSpring<3, 4>(), 3);
    if constexpr (sum.volume != Volume::none) {
        add_volume_product<sum.volume>(u, p, kappa, odd);
    }
}

/// One layer of cells: adds the product to `partial`, sets `above`.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
void mean_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    clear_above<V>(layer);
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[8], p[8];
        load_cells<V>(layer, layer.displacement, at, u);
        load_cells<V>(layer, sum.law == SpringLaw::stiffening ? layer.displacement : layer.direction, at, p);
        const V k = load_lanes<V>(layer.stiffness[6] + n);
        CornerForces<V> product;
        mean_cell_product<face_diagonals, sum, accuracy>(u, p, k, k * splat<V>(layer.volume_ratio), layer.means,
                                                         layer.stiffening, product);
        const Vector3<V>(&odd)[4] = product.odd, (&even)[4] = product.even;
        store_force<V>(layer.above, at.high_y,
                       load_force<V>(layer.above, at.high_y) - (odd[1] - even[1]) -
                           next_column(odd[0] - even[0], carry.high_y));
        store_force<V>(layer.above, at.high,
                       load_force<V>(layer.above, at.high) - (odd[3] - even[3]) -
                           next_column(odd[2] - even[2], carry.high));
        store_force<V>(layer.partial, at.low_y,
                       load_force<V>(layer.partial, at.low_y) + (odd[2] + even[2]) +
                           next_column(odd[3] + even[3], carry.low_y));
        store_force<V>(layer.partial, n,
                       load_force<V>(layer.partial, n) + (odd[0] + even[0]) + next_column(odd[1] + even[1], carry.low));
    }
}

/// In a network.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
void network_mean_product(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes, Range begin,
                          Range end) {
    for_each_vector<V>(cells, begin, end, [&](Range i, int lane, const MeanFactors<V>& by) HYBMSS_INLINE_BODY {
        Vector3<V> u[8], p[8];
        load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, u);
        load_corners(cells, i, lane, sum.law == SpringLaw::stiffening ? nodes.displacement : nodes.direction,
                     by.inverse_edge, p);
        CornerForces<V> product;
        mean_cell_product<face_diagonals, sum, accuracy>(u, p, by.stiffness, by.kappa, cells.constants,
                                                         nodes.stiffening, product);
        for (int c = 0; c < 4; ++c) {
            u[c] = product.odd[c] + product.even[c];
            u[7 - c] = product.even[c] - product.odd[c];
        }
        add_corners(cells, i, lane, u, nodes.product);
    });
}

/// Sides of a corner: -1 low, +1 high.
constexpr int side(int corner, int axis) {
    return corner >> axis & 1 ? 1 : -1;
}
template <class V>
HYBMSS_INLINE V with_sign(int sign, V v) {
    return sign > 0 ? v : -v;
}

/// Adds the patterns' blocks of one corner: with dP_ij = q_ij . dx, the energy's sum of dP dP, and for the elastic law
/// twice w_ij with the signs of both.
template <bool elastic, class V>
HYBMSS_INLINE void add_pattern_block(int corner, const CellParts<V>& change, const MeanEdges<V>& edges,
                                     const V (&w)[3][3], V k, const MeanConstants<Scalar<V>>& constants,
                                     Symmetric3<V>& block) {
    const Vector3<V> edge[3] = {edges.a, edges.b, edges.c};
    const int pattern[3] = {side(corner, 1) * side(corner, 2), side(corner, 0) * side(corner, 2),
                            side(corner, 0) * side(corner, 1)};
    const auto slope = [&](int i, int j) HYBMSS_INLINE_BODY {
        const Vector3<V>&a = edge[j], &g = change.g[i];
        return Vector3<V>{with_sign(pattern[i], a.x) + with_sign(side(corner, j), g.x),
                          with_sign(pattern[i], a.y) + with_sign(side(corner, j), g.y),
                          with_sign(pattern[i], a.z) + with_sign(side(corner, j), g.z)};
    };
    const V zero = splat<V>(0);
    V isotropic = zero;
    // p^2 + q^2 + 2 c p q = (1 + c)/2 (p + q)^2 + (1 - c)/2 (p - q)^2
    const V half = splat<V>(Scalar<V>(0.5)), one = splat<V>(1);
    const V bending = k * splat<V>(constants.bending), coupling = splat<V>(constants.coupling),
            twist = k * splat<V>(constants.twist);
    const V even = half * bending * (one + coupling), odd = half * bending * (one - coupling);
    const auto add_pair = [&](int i, int j) HYBMSS_INLINE_BODY {
        const Vector3<V> p = slope(i, j), q = slope(j, i);
        block = block + rank_one(zero, even, p + q);
        block = block + rank_one(zero, odd, p - q);
    };
    add_pair(2, 0);
    add_pair(2, 1);
    add_pair(1, 0);
    block = block + rank_one(zero, k * splat<V>(constants.joint_twist), slope(0, 0) + slope(1, 1) + slope(2, 2));
    for (int i = 0; i < 3; ++i) {
        block = block + rank_one(zero, twist, slope(i, i));
        for (int j = 0; elastic && j < 3; ++j) {
            isotropic = isotropic + with_sign(pattern[i] * side(corner, j), w[i][j] + w[i][j]);
        }
    }
    for (int i = 0; i < 3; ++i) {
        block.entry[i] = block.entry[i] + isotropic;
    }
}

/// The diagonal blocks of the corners.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
[[gnu::noinline]] void mean_cell_blocks(const Vector3<V> (&u)[8], V k, V kappa,
                                        const MeanConstants<Scalar<V>>& constants,
                                        const StiffeningConstants<Scalar<V>>& stiffening, Symmetric3<V> (&blocks)[8]) {
    constexpr SpringLaw law = sum.law;
    using T = Scalar<V>;
    const V zero = splat<V>(0);
    const V all[7] = {k, k, k, k, k, k, k};
    const CellParts<V> change = cell_parts(u);
    const MeanEdges<V> edges = mean_edges(change);
    for (Symmetric3<V>& block : blocks) {
        block = {{zero, zero, zero, zero, zero, zero}};
    }
    add_spring_blocks<accuracy, law>(CubeDiagonals{}, u, all, stiffening, blocks);
    for_each_mean_spring<face_diagonals>(
        change, edges, constants,
        [&]<int a, int b, int c>(std::integer_sequence<int, a, b, c>, V s, V stiffness) HYBMSS_INLINE_BODY {
            constexpr double kLength2 = 16.0 * (a * a + b * b + c * c);
            const Symmetric3<V> h =
                law_block<law>(k * stiffness, s, one_minus_rsqrt<accuracy>(s), splat<V>(static_cast<T>(1 / kLength2)),
                               combined<a, b, c>(edges.a, edges.b, edges.c), stiffening);
            for (int corner = 0; corner < 8; ++corner) {
                // A corner moves the vector by 0, once or twice.
                const int moves = a * side(corner, 0) + b * side(corner, 1) + c * side(corner, 2);
                for (int e = 0; e < kBlockEntries && moves != 0; ++e) {
                    blocks[corner].entry[e] =
                        multiply_add(splat<V>(static_cast<T>(moves * moves)), h.entry[e], blocks[corner].entry[e]);
                }
            }
        });
    if constexpr (law == SpringLaw::elastic || law == SpringLaw::damping) {
        V p[3][3], w[3][3];
        pattern_projections(change.g, edges, p);
        pattern_tensions(p, k, constants, w);
        for (int corner = 0; corner < 8; ++corner) {
            add_pattern_block<law == SpringLaw::elastic>(corner, change, edges, w, k, constants, blocks[corner]);
        }
    }
    if constexpr (sum.volume != Volume::none) {
        add_volume_blocks<sum.volume>(u, kappa, blocks);
    }
}

/// One layer of cells: adds the diagonal blocks to `partial`, sets `above`.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
void mean_diagonal(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    const V zero = splat<V>(0);
    const Symmetric3<V> none{{zero, zero, zero, zero, zero, zero}};
    clear_above<V>(layer);
    Symmetric3<V> carry[4] = {none, none, none, none};
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[8];
        load_cells<V>(layer, layer.displacement, at, u);
        const V k = load_lanes<V>(layer.stiffness[6] + n);
        Symmetric3<V> blocks[8];
        mean_cell_blocks<face_diagonals, sum, accuracy>(u, k, k * splat<V>(layer.volume_ratio), layer.means,
                                                        layer.stiffening, blocks);
        add_blocks<V>(layer.above, at.high_y, blocks[6] + next_column(blocks[7], carry[3]));
        add_blocks<V>(layer.above, at.high, blocks[4] + next_column(blocks[5], carry[2]));
        add_blocks<V>(layer.partial, at.low_y, blocks[2] + next_column(blocks[3], carry[1]));
        add_blocks<V>(layer.partial, n, blocks[0] + next_column(blocks[1], carry[0]));
    }
}

/// In a network, by the length unit m.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
void network_mean_diagonal(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes,
                           const DiagonalBlocks<Scalar<V>>& sums, Range begin, Range end) {
    for_each_vector<V>(cells, begin, end, [&](Range i, int lane, const MeanFactors<V>& by) HYBMSS_INLINE_BODY {
        Vector3<V> u[8];
        load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, u);
        Symmetric3<V> blocks[8];
        mean_cell_blocks<face_diagonals, sum, accuracy>(u, by.stiffness * by.inverse_edge, by.kappa * by.inverse_edge,
                                                        cells.constants, sums.stiffening, blocks);
        add_corner_blocks(cells, i, lane, nodes.displacement[1] == nullptr, blocks, sums);
    });
}

/// What the springs of a vector of cells stiffen by, in units of force times h.
template <bool face_diagonals, class V>
[[gnu::noinline]] V mean_cell_stiffening(const Vector3<V> (&u)[8], V k, const MeanConstants<Scalar<V>>& constants,
                                         const StiffeningConstants<Scalar<V>>& stiffening) {
    const CellParts<V> change = cell_parts(u);
    V cell = splat<V>(0);
    for_each_mean_spring<face_diagonals>(
        change, mean_edges(change), constants,
        [&]<int a, int b, int c>(std::integer_sequence<int, a, b, c>, V s, V stiffness) HYBMSS_INLINE_BODY {
            constexpr auto kLength2 = static_cast<Scalar<V>>(16.0 * (a * a + b * b + c * c));
            cell = multiply_add(splat<V>(kLength2) * stiffness, stiffening_energy(s, stiffening), cell);
        });
    const V all[7] = {k, k, k, k, k, k, k};
    return multiply_add(k, cell, stiffening_energies(CubeDiagonals{}, u, all, stiffening));
}

template <bool face_diagonals, class V>
double mean_stiffening_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    double energy = 0;
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        Vector3<V> u[8];
        load_cells<V>(layer, layer.displacement, hessian_rows<V>(layer, n), u);
        const V k = load_lanes<V>(layer.stiffness[6] + n);
        energy += sum_in_double(mean_cell_stiffening<face_diagonals>(u, k, layer.means, layer.stiffening));
    }
    return energy;
}

template <bool face_diagonals, class V>
double network_mean_stiffening_energy(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes,
                                      Range begin, Range end) {
    double energy = 0;
    for_each_vector<V>(cells, begin, end, [&](Range i, int lane, const MeanFactors<V>& by) HYBMSS_INLINE_BODY {
        Vector3<V> u[8];
        load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, u);
        const V cell = mean_cell_stiffening<face_diagonals>(u, by.stiffness, cells.constants, nodes.stiffening);
        energy += sum_in_double(divide(cell, by.inverse_edge));
    });
    return energy;
}

} // namespace

HYBMSS_DEFINE_KERNEL(mean_product);
HYBMSS_DEFINE_KERNEL(mean_diagonal);
HYBMSS_DEFINE_KERNEL(mean_stiffening_energy);
HYBMSS_DEFINE_KERNEL(network_mean_product);
HYBMSS_DEFINE_KERNEL(network_mean_diagonal);
HYBMSS_DEFINE_KERNEL(network_mean_stiffening_energy);

} // namespace hybmss::kernels
