#pragma once

#include "kernels/vectors.hpp"

namespace hybmss::kernels {
namespace {

/// How 1/4 kappa phi' times each cofactor b x c, c x a, a x b of a cell changes when its mean edges do by p: `along` is
/// 1/4 kappa phi''/V0, `pressure` 1/4 kappa phi'. Their signed sums are K p at the corners, as those of the cofactors
/// are the gradients of V':
///
///     along dV' (b x c) + pressure (pb x c + b x pc), ...,  dV' = pa . (b x c) + pb . (c x a) + pc . (a x b)
template <class Cell, class V>
HYBMSS_INLINE void cofactor_products(const Cell& cell, const Vector3<V> (&p)[3], V along, V pressure,
                                     Vector3<V> (&out)[3]) {
    const V scale = along * (dot(p[0], cell.bc) + dot(p[1], cell.ca) + dot(p[2], cell.ab));
    const Vector3<V> pa = scaled(pressure, p[0]), pb = scaled(pressure, p[1]), pc = scaled(pressure, p[2]);
    out[0] = add_cross(cell.b, pc, add_cross(pb, cell.c, scaled(scale, cell.bc)));
    out[1] = add_cross(cell.c, pa, add_cross(pc, cell.a, scaled(scale, cell.ca)));
    out[2] = add_cross(cell.a, pb, add_cross(pa, cell.b, scaled(scale, cell.ab)));
}

} // namespace
} // namespace hybmss::kernels
