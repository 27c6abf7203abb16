#include "bindings/c/fields.hpp"

#include "bindings/c/arguments.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace hybmss::c_interface {
namespace {

[[noreturn]] void refuse(const char* name, const std::string& reason) {
    throw std::invalid_argument(std::string(name) + ": " + reason);
}

const char* precision_name(hybmss_precision precision) {
    return precision == HYBMSS_FLOAT ? "HYBMSS_FLOAT" : "HYBMSS_DOUBLE";
}

template <class T, class Field>
void check_field(const Field* field, std::size_t nodes, const char* name) {
    require(field, name);
    constexpr hybmss_precision kPrecision = std::is_same_v<T, double> ? HYBMSS_DOUBLE : HYBMSS_FLOAT;
    if (field->precision != kPrecision) {
        refuse(name, "precision = " + std::to_string(field->precision) + " is not allowed: here it must be " +
                         std::to_string(kPrecision) + " (" + precision_name(kPrecision) + ")");
    }
    if (field->stride < 1) {
        refuse(name, "stride = " + std::to_string(field->stride) + " is not allowed: it must be at least 1 component");
    }
    constexpr std::size_t kMost = std::numeric_limits<std::ptrdiff_t>::max() / sizeof(T);
    if (field->count > kMost / static_cast<std::size_t>(field->stride)) {
        refuse(name, "count = " + std::to_string(field->count) + " with stride " + std::to_string(field->stride) +
                         " is more than there is memory");
    }
    if (!field->map && field->count != nodes) {
        refuse(name, "count = " + std::to_string(field->count) + " is not allowed: the body has " +
                         std::to_string(nodes) + " nodes, and there is no map");
    }
    if (nodes == 0) {
        return;
    }
    const void* const components[] = {field->x, field->y, field->z};
    for (std::size_t c = 0; c < 3; ++c) {
        if (!components[c]) {
            refuse(name, std::string(1, "xyz"[c]) + " is null");
        }
        if (reinterpret_cast<std::uintptr_t>(components[c]) % alignof(T) != 0) {
            refuse(name, std::string(1, "xyz"[c]) + " is not aligned to " + std::to_string(alignof(T)) + " bytes");
        }
    }
    for (std::size_t node = 0; field->map && node < nodes; ++node) {
        if (field->map[node] >= field->count) {
            refuse(name, "map[" + std::to_string(node) + "] = " + std::to_string(field->map[node]) +
                             " is not allowed: it must be below count = " + std::to_string(field->count));
        }
    }
}

/// Whether a component of one entry is another component of the same entry or of another one, as in interleaved memory
/// with the stride of separate arrays. With a map, only of the same: in blocks x x x x y y y y entries are left out.
template <class T>
bool overlap(const hybmss_field& field, const void* a, const void* b) {
    if (field.map) {
        return a == b;
    }
    const auto from = reinterpret_cast<std::uintptr_t>(std::min(a, b, std::less<>()));
    const auto to = reinterpret_cast<std::uintptr_t>(std::max(a, b, std::less<>()));
    const std::size_t apart = (to - from) / sizeof(T), stride = static_cast<std::size_t>(field.stride);
    return apart % stride == 0 && apart / stride < field.count;
}

} // namespace

template <class T>
void check(const hybmss_const_field* field, std::size_t nodes, const char* name) {
    check_field<T>(field, nodes, name);
}
template <class T>
void check(const hybmss_field* field, std::size_t nodes, const char* name) {
    check_field<T>(field, nodes, name);
    if (nodes > 0 && (overlap<T>(*field, field->x, field->y) || overlap<T>(*field, field->y, field->z) ||
                      overlap<T>(*field, field->z, field->x))) {
        refuse(name, "x, y and z must be different memory: with stride = " + std::to_string(field->stride) +
                         " they share some");
    }
}

void check_apart(const hybmss_const_field& in, const hybmss_field& out, const char* name) {
    for (const void* const read : {in.x, in.y, in.z}) {
        for (const void* const written : {out.x, out.y, out.z}) {
            if (read == written && read) {
                refuse(name, "what is written must be other memory than what is read");
            }
        }
    }
}

template <class T>
Input<T>::Input(const hybmss_const_field& field, std::size_t nodes, Scratch<T>& scratch) : scratch_(scratch) {
    const T* const from[3] = {static_cast<const T*>(field.x), static_cast<const T*>(field.y),
                              static_cast<const T*>(field.z)};
    if (!field.map || nodes == 0) {
        view_ = {from[0], from[1], from[2], field.stride, nodes};
        return;
    }
    copy_ = scratch.take(3 * nodes);
    T* to = copy_.data();
    for (std::size_t node = 0; node < nodes; ++node) {
        const auto entry = static_cast<std::ptrdiff_t>(field.map[node]) * field.stride;
        for (const T* component : from) {
            *to++ = component[entry];
        }
    }
    view_ = VectorField<const T>::aos(copy_.data(), nodes);
}

template <class T>
Output<T>::Output(const hybmss_field& field, std::size_t nodes, Scratch<T>& scratch)
    : field_(field), scratch_(scratch) {
    if (!field.map || nodes == 0) {
        view_ = {static_cast<T*>(field.x), static_cast<T*>(field.y), static_cast<T*>(field.z), field.stride, nodes};
        return;
    }
    copy_ = scratch.take(3 * nodes);
    std::fill(copy_.begin(), copy_.end(), T(0));
    view_ = VectorField<T>::aos(copy_.data(), nodes);
}

template <class T>
template <class Move>
void Output<T>::bring(const Move& move) const {
    if (!field_.map) {
        return;
    }
    T* const to[3] = {static_cast<T*>(field_.x), static_cast<T*>(field_.y), static_cast<T*>(field_.z)};
    const T* from = copy_.data();
    for (std::size_t node = 0; node < view_.size; ++node) {
        const auto entry = static_cast<std::ptrdiff_t>(field_.map[node]) * field_.stride;
        for (T* component : to) {
            move(component[entry], *from++);
        }
    }
}

template <class T>
void Output<T>::set() const {
    bring([](T& target, const T& source) { target = source; });
}
template <class T>
void Output<T>::add() const {
    bring([](T& target, const T& source) { target += source; });
}

template void check<float>(const hybmss_const_field*, std::size_t, const char*);
template void check<double>(const hybmss_const_field*, std::size_t, const char*);
template void check<float>(const hybmss_field*, std::size_t, const char*);
template void check<double>(const hybmss_field*, std::size_t, const char*);
template class Input<float>;
template class Input<double>;
template class Output<float>;
template class Output<double>;

} // namespace hybmss::c_interface
