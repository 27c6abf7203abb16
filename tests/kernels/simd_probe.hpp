#pragma once

/// \file
/// The vector operations of kernels/simd.hpp and the laws built on them, applied to arrays by code that was compiled
/// for one instruction set; the tests run all of them that the machine has.

#include "hybmss/instruction_set.hpp"

#include <cstdint>

namespace hybmss::testing {

/// Each function handles `width` elements an operand.
template <class T>
struct SimdProbe {
    InstructionSet instruction_set;
    int width;
    void (*multiply_add)(const T* a, const T* b, const T* c, T* out);
    void (*subtract_product)(const T* a, const T* b, const T* c, T* out);
    void (*multiply_subtract)(const T* a, const T* b, const T* c, T* out);
    void (*minus_product_minus)(const T* a, const T* b, const T* c, T* out);
    void (*maximum)(const T* a, const T* b, T* out);
    void (*square_root)(const T* a, T* out);
    void (*divide)(const T* a, const T* b, T* out);
    void (*shift_in)(const T* previous, const T* current, T* out);
    void (*gather)(const T* base, const std::int32_t* index, T* out);
    void (*scatter)(const T* values, T* base, const std::int32_t* index);
    double (*sum_in_double)(const T* a);
    void (*where_positive)(const T* gate, const T* value, T* out);
    void (*one_where_positive)(const T* a, T* out);
    void (*round_fraction_to_11_bits)(const T* a, T* out);
    void (*cube_root_seed)(const T* a, T* out);
    /// Null where the instruction set has no estimate for T; `seed_error` bounds its relative error.
    void (*reciprocal_square_root_seed)(const T* a, T* out);
    void (*reciprocal_seed)(const T* a, T* out);
    double seed_error;
    void (*one_minus_rsqrt_fast)(const T* s, T* out);
    void (*one_minus_rsqrt_accurate)(const T* s, T* out);
    void (*one_minus_rsqrt_exact)(const T* s, T* out);
    void (*squared_strain)(const T* s, T* out);
    void (*cube_root_minus_one)(const T* j, T* out);
    void (*mean_stretch_slope)(const T* j, T* out);
    void (*mean_stretch_energy)(const T* j, T* out);
};

} // namespace hybmss::testing
