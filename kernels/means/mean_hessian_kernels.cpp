// Compiled once for each instruction set: second derivatives of springs on means, of lattices and networks, and passes
// by other laws of the springs. The patterns damp as springs do; they do not stiffen. What a vector of cells gives is a
// function for both, which nothing inlines: its arithmetic hides the call, and it is half of all there is to compile.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian.hpp"
#include "kernels/means/cell_corners.hpp"
#include "kernels/means/mean_cell.hpp"

namespace hybmss::kernels {
namespace {

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
    // k [ isotropic p + axial n n.p ] of every spring, n = (1 - t) d / l.
    constexpr std::size_t kSprings = kMeanSprings<face_diagonals>;
    V s[kSprings], t[kSprings], isotropic[kSprings], axial[kSprings];
    mean_stretches(change, edges, s);
    one_minus_rsqrt<accuracy>(s, t);
    if constexpr (law != SpringLaw::stiffening) {
        const V half = splat<V>(T(0.5));
        along_springs(MeanMatrix<V>{dot(edges.a, pa), dot(edges.b, pb), dot(edges.c, pc),
                                    half * (dot(edges.a, pb) + dot(edges.b, pa)),
                                    half * (dot(edges.a, pc) + dot(edges.c, pa)),
                                    half * (dot(edges.b, pc) + dot(edges.c, pb))},
                      axial);
    }
    for (std::size_t i = 0; i < kSprings; ++i) {
        const LawFactors<V> factor = law_factors<law>(s[i], t[i], stiffening);
        isotropic[i] = factor.isotropic;
        if constexpr (law != SpringLaw::stiffening) {
            const V shortened = splat<V>(1) - t[i];
            axial[i] =
                factor.axial * (shortened * shortened) * (splat<V>(static_cast<T>(1.0 / kMeanLength2[i])) * axial[i]);
        }
    }
    Vector3<V> on_edge[3] = {none, none, none};
    if constexpr (law == SpringLaw::stiffening) {
        const MeanEdges<V> opposite = {none - edges.a, none - edges.b, none - edges.c};
        add_product(sum_of_springs(isotropic, k, constants), opposite, on_edge);
    } else {
        add_product(sum_of_springs(axial, k, constants), edges, on_edge);
        if constexpr (law != SpringLaw::damping) {
            add_product(sum_of_springs(isotropic, k, constants), MeanEdges<V>{pa, pb, pc}, on_edge);
        }
    }
    Vector3<V>&of_a = on_edge[0], &of_b = on_edge[1], &of_c = on_edge[2];
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
            pattern_tensions(old, k * splat<V>(stiffening.geometric), constants, w);
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
    Vector3<V> minus = of_a, plus = of_a;
    if constexpr (law == SpringLaw::elastic || law == SpringLaw::damping) {
        minus = subtract_product(k * splat<V>(constants.fourth), direction.fourth, of_a);
        plus = multiply_add(k * splat<V>(constants.fourth), direction.fourth, of_a);
    }
    odd[0] = along + minus, odd[1] = along - minus, odd[2] = against + plus, odd[3] = against - plus;
    if constexpr (sum.volume != Volume::none) {
        add_volume_product<sum.volume>(u, p, kappa, stiffening.geometric, odd);
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
    const auto products = [&](Range i, int lane, const MeanFactors<V>& by, Vector3<V>(&u)[8]) HYBMSS_INLINE_BODY {
        Vector3<V> p[8];
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
    };
    add_to_corners<V>(cells, begin, end, nodes.product, products);
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
    isotropic = multiply_add(k, splat<V>(constants.fourth), isotropic);
    for (int i = 0; i < 3; ++i) {
        block.entry[i] = block.entry[i] + isotropic;
    }
}

/// Of a, b, c in each spring's vector.
constexpr int kSigns[13][3] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {1, 1, 1},  {1, -1, -1}, {1, -1, 1}, {1, 1, -1},
                               {1, 1, 0}, {1, -1, 0}, {1, 0, 1}, {1, 0, -1}, {0, 1, 1},   {0, 1, -1}};

/// The diagonal blocks of the corners.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
[[gnu::noinline]] void mean_cell_blocks(const Vector3<V> (&u)[8], V k, V kappa,
                                        const MeanConstants<Scalar<V>>& constants,
                                        const StiffeningConstants<Scalar<V>>& stiffening, Symmetric3<V> (&blocks)[8]) {
    constexpr SpringLaw law = sum.law;
    using T = Scalar<V>;
    const V zero = splat<V>(0);
    const CellParts<V> change = cell_parts(u);
    const MeanEdges<V> edges = mean_edges(change);
    for (Symmetric3<V>& block : blocks) {
        block = {{zero, zero, zero, zero, zero, zero}};
    }
    V s[kMeanSprings<face_diagonals>];
    mean_stretches(change, edges, s);
    for (std::size_t i = 0; i < kMeanSprings<face_diagonals>; ++i) {
        const int(&sign)[3] = kSigns[i];
        const auto with = [&](int axis, const Vector3<V>& edge)
                              HYBMSS_INLINE_BODY { return scaled(splat<V>(static_cast<T>(sign[axis])), edge); };
        const V stiffness = i < 3 ? splat<V>(constants.edge) : i < 7 ? splat<V>(T(kCube)) : splat<V>(constants.face);
        const Symmetric3<V> h = law_block<law>(k * stiffness, s[i], one_minus_rsqrt<accuracy>(s[i]),
                                               splat<V>(static_cast<T>(1.0 / kMeanLength2[i])),
                                               with(0, edges.a) + with(1, edges.b) + with(2, edges.c), stiffening);
        for (int corner = 0; corner < 8; ++corner) {
            // A corner moves the vector so many times.
            const int moves = sign[0] * side(corner, 0) + sign[1] * side(corner, 1) + sign[2] * side(corner, 2);
            for (int e = 0; e < kBlockEntries; ++e) {
                blocks[corner].entry[e] =
                    multiply_add(splat<V>(static_cast<T>(moves * moves)), h.entry[e], blocks[corner].entry[e]);
            }
        }
    }
    if constexpr (law == SpringLaw::elastic || law == SpringLaw::damping) {
        V p[3][3], w[3][3];
        pattern_projections(change.g, edges, p);
        pattern_tensions(p, k * splat<V>(stiffening.geometric), constants, w);
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
    V s[kMeanSprings<face_diagonals>], cell = splat<V>(0);
    mean_stretches(change, mean_edges(change), s);
    for (std::size_t i = 0; i < kMeanSprings<face_diagonals>; ++i) {
        const V stiffness = i < 3   ? splat<V>(constants.edge)
                            : i < 7 ? splat<V>(Scalar<V>(kCube))
                                    : splat<V>(constants.face);
        cell = multiply_add(splat<V>(static_cast<Scalar<V>>(kMeanLength2[i])) * stiffness,
                            stiffening_energy(s[i], stiffening), cell);
    }
    return k * cell;
}

template <bool face_diagonals, class V>
double mean_stiffening_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    double energy = 0;
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        Vector3<V> u[8];
        load_cells<V>(layer, layer.displacement, hessian_rows<V>(layer, n), u);
        const V k = load_lanes<V>(layer.stiffness[6] + n);
        add_in_double(energy, mean_cell_stiffening<face_diagonals>(u, k, layer.means, layer.stiffening));
    }
    return energy;
}

template <bool face_diagonals, class V>
double network_mean_stiffening_energy(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes,
                                      Range begin, Range end) {
    double sum[1] = {};
    add_of_cells<V>(
        cells, begin, end, sum, [&](Range i, int lane, const MeanFactors<V>& by, V(&found)[1]) HYBMSS_INLINE_BODY {
            Vector3<V> u[8];
            load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, u);
            const V cell = mean_cell_stiffening<face_diagonals>(u, by.stiffness, cells.constants, nodes.stiffening);
            found[0] = divide(cell, by.inverse_edge);
        });
    return sum[0];
}

} // namespace

HYBMSS_DEFINE_KERNEL(mean_product);
HYBMSS_DEFINE_COMMON_KERNEL(mean_diagonal);
HYBMSS_DEFINE_ORDERED_KERNEL(mean_stiffening_energy);
HYBMSS_DEFINE_ORDERED_KERNEL(network_mean_product);
HYBMSS_DEFINE_COMMON_KERNEL(network_mean_diagonal);
HYBMSS_DEFINE_ORDERED_KERNEL(network_mean_stiffening_energy);

} // namespace hybmss::kernels
