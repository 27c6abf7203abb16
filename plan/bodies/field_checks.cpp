#include "plan/bodies/field_checks.hpp"

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss {
namespace {

[[noreturn]] void refuse(const std::string& what) {
    throw std::invalid_argument("vector field: " + what);
}

/// Whether one of the `of_a` entries from a on, `stride` apart, is one of the `of_b` from b on, as in interleaved
/// memory with the stride of separate arrays.
template <class T>
bool overlap(const T* a, std::size_t of_a, const T* b, std::size_t of_b, std::size_t stride) {
    if (std::less<>()(b, a)) {
        std::swap(a, b);
        std::swap(of_a, of_b);
    }
    const std::size_t apart = (reinterpret_cast<std::uintptr_t>(b) - reinterpret_cast<std::uintptr_t>(a)) / sizeof(T);
    return of_b > 0 && apart < stride * of_a && apart % stride == 0;
}

template <class T>
std::size_t stride_of(const VectorField<T>& field) {
    return static_cast<std::size_t>(field.stride < 0 ? -field.stride : field.stride);
}

} // namespace

template <class T>
void check_field(const VectorField<const T>& in, std::size_t size, const char* things, const char* whose) {
    if (in.size != size) {
        throw std::invalid_argument("vector field of " + std::to_string(in.size) + " " + things + " given: " + whose +
                                    " has " + std::to_string(size));
    }
    if (size == 0) {
        return;
    }
    if (!in.x || !in.y || !in.z) {
        refuse(std::string(1, !in.x ? 'x' : !in.y ? 'y' : 'z') + " is null");
    }
    if (in.stride == 0) {
        refuse("stride = 0 is not allowed: every node has components of its own");
    }
}

template <class T>
void check_field(const VectorField<T>& out, std::size_t size, const char* things, const char* whose) {
    check_field(VectorField<const T>(out), size, things, whose);
    if (size == 0) {
        return;
    }
    const std::size_t stride = stride_of(out);
    if (overlap(out.x, size, out.y, size, stride) || overlap(out.y, size, out.z, size, stride) ||
        overlap(out.z, size, out.x, size, stride)) {
        refuse("x, y and z must be different memory: with stride = " + std::to_string(out.stride) + " they share some");
    }
}

template <class T>
void check_apart(const VectorField<T>& out, const VectorField<const T>& in) {
    if (in.stride != out.stride || out.size == 0) {
        return;
    }
    for (const T* const a : {in.x, in.y, in.z}) {
        for (const T* const b : {out.x, out.y, out.z}) {
            if (overlap<T>(a, in.size, b, out.size, stride_of(out))) {
                refuse("what is written must be other memory than what is read");
            }
        }
    }
}

template void check_field(const VectorField<const float>&, std::size_t, const char*, const char*);
template void check_field(const VectorField<const double>&, std::size_t, const char*, const char*);
template void check_field(const VectorField<float>&, std::size_t, const char*, const char*);
template void check_field(const VectorField<double>&, std::size_t, const char*, const char*);
template void check_apart(const VectorField<float>&, const VectorField<const float>&);
template void check_apart(const VectorField<double>&, const VectorField<const double>&);

} // namespace hybmss
