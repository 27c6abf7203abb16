#pragma once

#include "hybmss/hybmss.h"

#include <cstddef>
#include <string>

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
/// The same, where `count` entries are to be read or written: for none of them null is allowed.
void require(const void* pointer, const char* name, std::size_t count);
/// Throws std::invalid_argument unless given == wanted.
void require_count(std::size_t given, std::size_t wanted, const char* name);

} // namespace hybmss::c_interface
