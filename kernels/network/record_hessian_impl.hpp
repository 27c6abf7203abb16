#pragma once

#include "kernels/hessian_arguments.hpp"
#include "kernels/network/network_records_impl.hpp"

// Second derivatives in scalar loops over arrays of structs; see network_records_impl.hpp.

namespace hybmss::kernels {
namespace {

/// A spring's block k [ isotropic I + axial n n^T ] by a law, and l n; see spring_hessian.hpp.
template <class T>
struct RecordBlock {
    T isotropic, axial;
    Point<T> d, axis;
};

template <SpringLaw law, class T>
HYBMSS_INLINE RecordBlock<T> record_block(const SpringRecord<T>& spring, const T* u, const StiffeningConstants<T>& c) {
    RecordBlock<T> block;
    const T s = record_stretch(spring, u, block.d);
    const T t = scalar_one_minus_rsqrt(s);
    block.axis = (1 - t) * block.d;
    if constexpr (law == SpringLaw::elastic) {
        block.isotropic = t;
        block.axial = 1 - t;
    } else if constexpr (law == SpringLaw::damping) {
        block.isotropic = 0;
        block.axial = 1;
    } else {
        const T e = s / (1 + scalar_square_root(s + 1 > 0 ? s + 1 : T(0)));
        block.isotropic = e * e * (c.quadratic + c.cubic * e) * (1 - t);
        block.axial = law == SpringLaw::stiffening ? T(0) : e * (2 * c.quadratic + 3 * c.cubic * e) - block.isotropic;
    }
    return block;
}

/// product_b += H (p_b - p_a), or what another law says, product_a -= the same.
template <class V, SpringLaw law = SpringLaw::elastic>
void record_spring_product(const SpringRecord<Scalar<V>>* springs, const PackedHessian<Scalar<V>>& nodes,
                           std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const SpringRecord<T>& spring = springs[i];
        const RecordBlock<T> block = record_block<law>(spring, nodes.displacement, nodes.stiffening);
        Point<T> p = block.d;
        if constexpr (law != SpringLaw::stiffening) {
            p = point_at(nodes.direction + spring.b) - point_at(nodes.direction + spring.a);
        }
        const T axial = spring.stiffness * block.axial * spring.inverse_length2 * scalar_product(block.axis, p);
        const Point<T> change = (spring.stiffness * block.isotropic) * p + axial * block.axis;
        add_to(nodes.product + spring.b, change);
        add_to(nodes.product + spring.a, T(-1) * change);
    }
}

/// Adds kappa [ phi''/V0 (grad V' . p) grad V' + phi' (hess V') p ].
template <Volume volume, class V>
void record_cell_product(const CellRecord<Scalar<V>>* cells, const PackedHessian<Scalar<V>>& nodes,
                         std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const RecordVolume<T> cell = record_volume(cells[i], nodes.displacement);
        Point<T> p[3];
        mean_edges(cells[i], nodes.direction, p);
        const T scale = T(0.25) * cells[i].kappa;
        const T change = scalar_product(p[0], cell.bc) + scalar_product(p[1], cell.ca) + scalar_product(p[2], cell.ab);
        const T along = scale * scalar_volume_curvature<volume>(cell.dilation) * cells[i].inverse_volume * change;
        const T pressure = scale * scalar_volume_slope<volume>(cell.dilation);
        const Point<T> x = along * cell.bc + pressure * (vector_product(p[1], cell.c) + vector_product(cell.b, p[2])),
                       y = along * cell.ca + pressure * (vector_product(p[2], cell.a) + vector_product(cell.c, p[0])),
                       z = along * cell.ab + pressure * (vector_product(p[0], cell.b) + vector_product(cell.a, p[1]));
        for (int corner = 0; corner < 8; ++corner) {
            add_to(nodes.product + cells[i].node[corner],
                   T(corner & 1 ? 1 : -1) * x + T(corner & 2 ? 1 : -1) * y + T(corner & 4 ? 1 : -1) * z);
        }
    }
}

/// Adds diagonal I + scale v v^T to the block of the node whose first element is at `first`.
template <class T>
HYBMSS_INLINE void add_rank_one(T diagonal, T scale, const Point<T>& v, const DiagonalBlocks<T>& blocks,
                                std::int32_t first) {
    const std::int32_t node = first / 4;
    const Point<T> w = scale * v;
    blocks.entry[0][node] += diagonal + w.x * v.x;
    blocks.entry[1][node] += diagonal + w.y * v.y;
    blocks.entry[2][node] += diagonal + w.z * v.z;
    blocks.entry[3][node] += w.x * v.y;
    blocks.entry[4][node] += w.x * v.z;
    blocks.entry[5][node] += w.y * v.z;
}

/// Adds H to the blocks of both ends.
template <class V, SpringLaw law = SpringLaw::elastic>
void record_spring_diagonal(const SpringRecord<Scalar<V>>* springs, const Scalar<V>* displacement,
                            const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const SpringRecord<T>& spring = springs[i];
        const RecordBlock<T> block = record_block<law>(spring, displacement, blocks.stiffening);
        const T axial = spring.stiffness * block.axial * spring.inverse_length2;
        for (const std::int32_t end_node : {spring.a, spring.b}) {
            add_rank_one(spring.stiffness * block.isotropic, axial, block.axis, blocks, end_node);
        }
    }
}

/// Adds kappa phi''/V0 (grad V')(grad V')^T, corner by corner.
template <Volume volume, class V>
void record_cell_diagonal(const CellRecord<Scalar<V>>* cells, const Scalar<V>* displacement,
                          const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const RecordVolume<T> cell = record_volume(cells[i], displacement);
        const T scale =
            T(1.0 / 16.0) * cells[i].kappa * scalar_volume_curvature<volume>(cell.dilation) * cells[i].inverse_volume;
        for (int corner = 0; corner < 8; ++corner) {
            const Point<T> gradient =
                T(corner & 1 ? 1 : -1) * cell.bc + T(corner & 2 ? 1 : -1) * cell.ca + T(corner & 4 ? 1 : -1) * cell.ab;
            add_rank_one(T(0), scale, gradient, blocks, cells[i].node[corner]);
        }
    }
}

} // namespace
} // namespace hybmss::kernels
