#pragma once

#include "hybmss/vector_field.hpp"

#include <cstddef>

namespace hybmss {

// What fields of the caller's must be; all throw std::invalid_argument. T is float or double.

/// `size` vectors, one for each of the `things` ("nodes") of `whose` ("the body"), each with components of its own.
template <class T>
void check_field(const VectorField<const T>& in, std::size_t size, const char* things, const char* whose);
/// The same, x, y and z in different memory.
template <class T>
void check_field(const VectorField<T>& out, std::size_t size, const char* things, const char* whose);
/// That what is written is no memory that is read. With different strides memory may be shared as well; which, would
/// take a walk over the nodes to tell.
template <class T>
void check_apart(const VectorField<T>& out, const VectorField<const T>& in);

} // namespace hybmss
