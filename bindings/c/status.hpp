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
/// The same, where `count` entries of `size` bytes are to be read or written: for none of them null is allowed. Nor is
/// a count that no memory can hold, such as a negative number that became a size.
void require_entries(const void* pointer, const char* name, std::size_t count, std::size_t size);
template <class T>
void require(const T* pointer, const char* name, std::size_t count) {
    require_entries(pointer, name, count, sizeof(T));
}
/// Throws std::invalid_argument unless given == wanted.
void require_count(std::size_t given, std::size_t wanted, const char* name);

} // namespace hybmss::c_interface
