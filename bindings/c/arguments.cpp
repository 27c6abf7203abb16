#include "bindings/c/arguments.hpp"

#include "hybmss/allocator.hpp"
#include "hybmss/record.hpp"
#include "hybmss/version.hpp"

#include <cstddef>
#include <cstdio>
#include <exception>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>

namespace {

// A fixed size: to tell of a lack of memory must not need any.
thread_local char last_error[1024] = "";

} // namespace

namespace hybmss::c_interface {
namespace {

bool truth(int value, const char* name) {
    if (value != 0 && value != 1) {
        throw std::invalid_argument(std::string(name) + " = " + std::to_string(value) +
                                    " is not allowed: it must be 0 or 1");
    }
    return value == 1;
}

Accuracy given_accuracy(hybmss_accuracy accuracy) {
    switch (accuracy) {
    case HYBMSS_ACCURATE:
        return Accuracy::accurate;
    case HYBMSS_EXACT:
        return Accuracy::exact;
    case HYBMSS_FAST:
        return Accuracy::fast;
    }
    throw std::invalid_argument("accuracy = " + std::to_string(accuracy) +
                                " is not allowed: it must be 0 (HYBMSS_ACCURATE), 1 (HYBMSS_EXACT) or 2 (HYBMSS_FAST)");
}

} // namespace

hybmss_status fail(hybmss_status status, const char* message) noexcept {
    std::snprintf(last_error, sizeof last_error, "%s", message);
    return status;
}

hybmss_status failure_of_current_exception() noexcept {
    try {
        throw;
    } catch (const std::invalid_argument& error) {
        return fail(HYBMSS_INVALID_ARGUMENT, error.what());
    } catch (const std::out_of_range& error) {
        return fail(HYBMSS_INVALID_ARGUMENT, error.what());
    } catch (const RecordError& error) {
        return fail(HYBMSS_FILE_ERROR, error.what());
    } catch (const std::bad_alloc&) {
        return fail(HYBMSS_OUT_OF_MEMORY, "out of memory");
    } catch (const std::length_error&) {
        return fail(HYBMSS_OUT_OF_MEMORY, "out of memory: more is asked for than an array can hold");
    } catch (const std::exception& error) {
        return fail(HYBMSS_INTERNAL_ERROR, error.what());
    } catch (...) {
        return fail(HYBMSS_INTERNAL_ERROR, "unknown failure");
    }
}

void require(const void* pointer, const char* name) {
    if (!pointer) {
        throw std::invalid_argument(std::string(name) + " is null: it must point to something");
    }
}

void require_entries(const void* pointer, const char* name, std::size_t count, std::size_t size) {
    if (!pointer && count > 0) {
        throw std::invalid_argument(std::string(name) + " is null: it must point to " + std::to_string(count) +
                                    " entries");
    }
    if (count > std::numeric_limits<std::ptrdiff_t>::max() / size) {
        throw std::invalid_argument(std::string(name) + ": " + std::to_string(count) +
                                    " entries are more than there is memory");
    }
}

void require_count(std::size_t given, std::size_t wanted, const char* name) {
    if (given != wanted) {
        throw std::invalid_argument(std::string(name) + ": " + std::to_string(given) + " values given, " +
                                    std::to_string(wanted) + " needed");
    }
}

GivenOptions::GivenOptions(const hybmss_plan_options* given) {
    if (!given) {
        return;
    }
    if (given->instruction_set) {
        options.instruction_set = parse_instruction_set(given->instruction_set);
    }
    options.layout = given->layout ? given->layout : "";
    options.accuracy = given_accuracy(given->accuracy);
    options.threads = given->threads;
    options.effort = truth(given->measure, "measure") ? Effort::measure : Effort::estimate;
    if (given->task_runner) {
        runner = {given->task_runner->threads, given->task_runner->enqueue, given->task_runner->finish,
                  given->task_runner->user};
        options.task_runner = &runner;
    }
}

bool is_double(hybmss_precision precision, const char* name) {
    if (precision != HYBMSS_FLOAT && precision != HYBMSS_DOUBLE) {
        throw std::invalid_argument(std::string(name) + " = " + std::to_string(precision) +
                                    " is not allowed: it must be 0 (HYBMSS_FLOAT) or 1 (HYBMSS_DOUBLE)");
    }
    return precision == HYBMSS_DOUBLE;
}

PrescribedNode prescribed_node(const hybmss_prescribed_node& given) {
    if (given.axes > 7) {
        throw std::invalid_argument("axes of prescribed node " + std::to_string(given.node) + " = " +
                                    std::to_string(given.axes) + " is not allowed: it must be 0 to 7");
    }
    PrescribedNode node{given.node, static_cast<std::uint8_t>(given.axes), {}, {}};
    std::copy_n(given.displacement, 3, node.displacement.begin());
    std::copy_n(given.velocity, 3, node.velocity.begin());
    return node;
}

RigidPose pose_of(const hybmss_pose& given) {
    RigidPose pose;
    std::copy_n(given.position, 3, pose.position.begin());
    std::copy_n(given.rotation, 9, pose.rotation.begin());
    std::copy_n(given.velocity, 3, pose.velocity.begin());
    std::copy_n(given.angular_velocity, 3, pose.angular_velocity.begin());
    return pose;
}

Obstacle obstacle_of(const hybmss_obstacle& given) {
    const double(&d)[3] = given.dimensions;
    Obstacle obstacle{{},
                      pose_of(given.pose),
                      given.friction,
                      given.stiffness,
                      given.friction_delay,
                      given.mass,
                      {given.inertia[0], given.inertia[1], given.inertia[2]}};
    switch (given.shape) {
    case HYBMSS_PLANE:
        obstacle.shape = PlaneShape{{d[0], d[1], d[2]}};
        break;
    case HYBMSS_SPHERE:
        obstacle.shape = SphereShape{d[0]};
        break;
    case HYBMSS_BOX:
        obstacle.shape = BoxShape{{d[0], d[1], d[2]}};
        break;
    case HYBMSS_CAPSULE:
        if (!(d[1] >= 0)) {
            throw std::invalid_argument("dimensions[1] = " + std::to_string(d[1]) +
                                        " is not allowed: the length of a capsule's axis must be at least 0");
        }
        obstacle.shape = CapsuleShape{{0, d[1], 0}, d[0]};
        break;
    case HYBMSS_SOLID:
        require(given.solid, "solid");
        obstacle.shape = given.solid->shape;
        break;
    default:
        throw std::invalid_argument("shape = " + std::to_string(given.shape) + " is not allowed: it must be 0 to 4");
    }
    return obstacle;
}

std::vector<RestStretch> stretches_of(const double* stretches, std::size_t count) {
    require(stretches, "stretches", count);
    std::vector<RestStretch> given(count);
    for (std::size_t c = 0; c < count; ++c) {
        std::copy_n(stretches + 3 * c, 3, given[c].begin());
    }
    return given;
}

void require_own(const hybmss_body* body, std::size_t nodes, const char* what) {
    require(body, "body");
    if (body->node_count != nodes) {
        const std::string made(what);
        throw std::invalid_argument("body has " + std::to_string(body->node_count) + " nodes and the " + made + " " +
                                    std::to_string(nodes) + ": it must be the body that the " + made + " was made of");
    }
}

std::vector<SurfaceFace> faces_of(const hybmss_body& body, const std::uint32_t* nodes, std::size_t count,
                                  const std::array<double, 3>& origin) {
    std::vector<SurfaceFace> faces(count);
    for (std::size_t f = 0; f < count; ++f) {
        std::copy_n(nodes + 4 * f, 4, faces[f].nodes.begin());
    }
    if (const auto* const network = std::get_if<Network>(&body.shape)) {
        set_rest_positions(*network, faces);
    } else {
        set_rest_positions(std::get<LatticeBody>(body.shape).lattice, faces, origin);
    }
    return faces;
}

} // namespace hybmss::c_interface

extern "C" {

const char* hybmss_status_name(int status) {
    switch (status) {
    case HYBMSS_OK:
        return "ok";
    case HYBMSS_INVALID_ARGUMENT:
        return "invalid argument";
    case HYBMSS_OUT_OF_MEMORY:
        return "out of memory";
    case HYBMSS_FILE_ERROR:
        return "file error";
    case HYBMSS_MISMATCH:
        return "mismatch";
    case HYBMSS_INTERNAL_ERROR:
        return "internal error";
    default:
        return "unknown status";
    }
}

const char* hybmss_last_error(void) {
    return last_error;
}

const char* hybmss_version(void) {
    return hybmss::kVersion;
}

hybmss_plan_options hybmss_default_plan_options(void) {
    return {nullptr, nullptr, HYBMSS_ACCURATE, 0, 0, nullptr};
}

hybmss_status hybmss_set_allocator(const hybmss_allocator* allocator) {
    return hybmss::c_interface::guarded([&] {
        hybmss::set_allocator(allocator ? hybmss::Allocator{allocator->allocate, allocator->release, allocator->user}
                                        : hybmss::Allocator{});
    });
}

} // extern "C"
