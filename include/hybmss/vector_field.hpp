#pragma once

/// \file
/// A view of caller-owned memory that holds one 3-vector a node.

#include <cstddef>
#include <type_traits>

namespace hybmss {

/// Component c of node n is at c[n * stride], for c in {x, y, z}. Nothing is owned; nothing beyond `size` nodes is
/// touched.
template <class T>
struct VectorField {
    T* x = nullptr;
    T* y = nullptr;
    T* z = nullptr;
    std::ptrdiff_t stride = 1; ///< in elements: 1 for a structure of arrays, 3 or 4 for an array of structures
    std::size_t size = 0;      ///< nodes

    /// Three separate arrays of `size` values.
    static VectorField soa(T* x, T* y, T* z, std::size_t size) { return {x, y, z, 1, size}; }
    /// Interleaved x y z (stride 3) or x y z w (stride 4).
    static VectorField aos(T* xyz, std::size_t size, std::ptrdiff_t stride = 3) {
        return {xyz, xyz + 1, xyz + 2, stride, size};
    }

    operator VectorField<const T>() const requires(!std::is_const_v<T>) { return {x, y, z, stride, size}; }
};

} // namespace hybmss
