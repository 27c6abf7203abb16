#pragma once

/// \file
/// What callers give, in the library's words, and the status that they get back.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/hybmss.h"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "hybmss/plan_options.hpp"
#include "hybmss/separation.hpp"
#include "hybmss/skin.hpp"
#include "hybmss/task_runner.hpp"

#include <cstddef>
#include <memory>
#include <variant>
#include <vector>

namespace hybmss::c_interface {

/// Keeps the message for hybmss_last_error and returns the status. Allocates nothing.
hybmss_status fail(hybmss_status status, const char* message) noexcept;

/// The status that belongs to the exception being handled, its message kept.
hybmss_status failure_of_current_exception() noexcept;

/// Runs work() where no exception gets out.
template <class Work>
hybmss_status guarded(const Work& work) noexcept {
    try {
        work();
        return HYBMSS_OK;
    } catch (...) {
        return failure_of_current_exception();
    }
}

/// Throws std::invalid_argument for a null pointer.
void require(const void* pointer, const char* name);
/// The same, where `count` entries of `size` bytes are to be read or written: for none of them null is allowed. Nor is
/// a count that no memory can hold, such as a negative number that became a size.
void require_entries(const void* pointer, const char* name, std::size_t count, std::size_t size);
template <class T>
void require(const T* pointer, const char* name, std::size_t count) {
    require_entries(pointer, name, count, sizeof(T));
}
/// Throws std::invalid_argument unless given == wanted.
void require_count(std::size_t given, std::size_t wanted, const char* name);

/// Options in the library's words, and what they point to. Not to be moved.
struct GivenOptions {
    /// Null: the defaults. Throws std::invalid_argument.
    explicit GivenOptions(const hybmss_plan_options* given);
    GivenOptions(const GivenOptions&) = delete;
    GivenOptions& operator=(const GivenOptions&) = delete;

    TaskRunner runner;
    PlanOptions options;
};

/// Throws std::invalid_argument for a number that names none. True for double.
bool is_double(hybmss_precision precision, const char* name);

struct LatticeBody {
    Lattice lattice;
    Material material;
};

/// Throw std::invalid_argument for a number that names none.
VolumeEnergy volume_energy(hybmss_volume_energy number);
Material material(const hybmss_material* given);
PrescribedNode prescribed_node(const hybmss_prescribed_node& given);
RigidPose pose_of(const hybmss_pose& given);
Obstacle obstacle_of(const hybmss_obstacle& given);
/// Three numbers a cell.
std::vector<RestStretch> stretches_of(const double* stretches, std::size_t count);

} // namespace hybmss::c_interface

struct hybmss_body {
    std::variant<hybmss::c_interface::LatticeBody, hybmss::Network> shape;
    std::size_t node_count;
    /// Of a lattice that has parted: its network, which is in `shape`, is here by its nodes alone.
    std::unique_ptr<hybmss::SeparatedNetwork> parted = nullptr;
};

/// A hull, a mesh or a height field.
struct hybmss_solid {
    hybmss::ObstacleShape shape;
};

namespace hybmss::c_interface {

/// Throws std::invalid_argument, which says what a lattice alone has, for a network.
/// Throws where vertices or triangles are missing.
TriangleMesh mesh_of(const double* vertices, std::size_t vertex_count, const std::uint32_t* triangles,
                     std::size_t triangle_count);
const LatticeBody& lattice_of(const hybmss_body& body, const char* what);

/// Throws std::invalid_argument unless `body` may be the one that `what`, of so many nodes, was made of.
void require_own(const hybmss_body* body, std::size_t nodes, const char* what);

/// Faces of four nodes each; `origin`: of a lattice's low corner, m.
std::vector<SurfaceFace> faces_of(const hybmss_body& body, const std::uint32_t* nodes, std::size_t count,
                                  const std::array<double, 3>& origin = {0, 0, 0});

/// A ForcePlan, an ExplicitDynamics or an EquilibriumSolver of the body.
template <class Planned>
Planned made_of(const hybmss_body& body, const PlanOptions& options) {
    if (const auto* shape = std::get_if<LatticeBody>(&body.shape)) {
        return Planned(shape->lattice, shape->material, options);
    }
    return Planned(std::get<Network>(body.shape), options);
}

// Handles of what is made of a body: `held` is a Held<float> or a Held<double>.

template <template <class> class Held, class Handle>
hybmss_status create(const hybmss_body* body, hybmss_precision precision, const hybmss_plan_options* options,
                     Handle** handle, const char* name) noexcept {
    return guarded([&] {
        require(handle, name);
        require(body, "body");
        const bool wide = is_double(precision, "precision");
        const GivenOptions given(options);
        auto made = std::make_unique<Handle>();
        if (wide) {
            made->held = std::make_unique<Held<double>>(*body, given.options);
        } else {
            made->held = std::make_unique<Held<float>>(*body, given.options);
        }
        *handle = made.release();
    });
}

/// Runs work(what the handle holds) where no exception gets out.
template <class Handle, class Work>
hybmss_status guarded(Handle* handle, const char* name, const Work& work) noexcept {
    return guarded([&] {
        require(handle, name);
        std::visit([&](const auto& held) { work(*held); }, handle->held);
    });
}

} // namespace hybmss::c_interface
