#pragma once

/// \file
/// The C interface for programs in C++17: handles that end by themselves, errors as exceptions, vectors as fields. All
/// functions and structs are those of hybmss.h. A header alone, over its binary interface.

#include "hybmss/hybmss.h"

#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

namespace hybmss::handles {

/// What was given and what is allowed, in one line.
class Error : public std::runtime_error {
public:
    explicit Error(hybmss_status status) : std::runtime_error(hybmss_last_error()), status_(status) {}
    hybmss_status status() const noexcept { return status_; }

private:
    hybmss_status status_;
};

/// Throws Error where a call failed.
inline void check(hybmss_status status) {
    if (status != HYBMSS_OK) {
        throw Error(status);
    }
}

/// Owns an object of the C interface, and is its pointer wherever a function wants one. Can be moved.
template <class Object, void (*destroy)(Object*)>
class Handle {
public:
    Handle() = default; ///< owns none
    /// By the function that makes one: `Body cube(hybmss_lattice_create, cells, 0.5, nullptr, 0u, &material)`.
    template <class... Parameters, class... Arguments>
    explicit Handle(hybmss_status (*create)(Parameters...), Arguments&&... arguments) {
        check(create(std::forward<Arguments>(arguments)..., &object_));
    }
    Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(object_, other.object_);
        return *this;
    }
    ~Handle() { destroy(object_); }

    operator Object*() const noexcept { return object_; }
    /// To be written to by a function that makes one; ends what was there.
    Object** out() {
        destroy(std::exchange(object_, nullptr));
        return &object_;
    }

private:
    Object* object_ = nullptr;
};

using Body = Handle<hybmss_body, hybmss_body_destroy>;
using Plan = Handle<hybmss_plan, hybmss_plan_destroy>;
using Skin = Handle<hybmss_skin, hybmss_skin_destroy>;
using Solid = Handle<hybmss_solid, hybmss_solid_destroy>;
using Dynamics = Handle<hybmss_dynamics, hybmss_dynamics_destroy>;
using Equilibrium = Handle<hybmss_equilibrium, hybmss_equilibrium_destroy>;
using World = Handle<hybmss_world, hybmss_world_destroy>;
using Record = Handle<hybmss_record, hybmss_record_destroy>;

/// x y z of each node, in the body's order.
inline hybmss_field field(std::vector<float>& xyz) {
    return hybmss_float_field(xyz.data(), xyz.size() / 3, 3);
}
inline hybmss_field field(std::vector<double>& xyz) {
    return hybmss_double_field(xyz.data(), xyz.size() / 3, 3);
}
inline hybmss_const_field field(const std::vector<float>& xyz) {
    return hybmss_const_float_field(xyz.data(), xyz.size() / 3, 3);
}
inline hybmss_const_field field(const std::vector<double>& xyz) {
    return hybmss_const_double_field(xyz.data(), xyz.size() / 3, 3);
}

} // namespace hybmss::handles
