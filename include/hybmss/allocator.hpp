#pragma once

/// \file
/// Another program's memory for the library's large arrays.

#include "hybmss/export.h"

#include <cstddef>

namespace hybmss {

/// Where the arrays of bodies and states come from: node fields, stiffness shares, packed springs and cells, scratch.
/// Descriptions, lists and other small things stay with operator new.
///
/// The functions may be called from several threads at the same time, and must not throw.
struct Allocator {
    /// `bytes` > 0 of memory aligned to `alignment` (a power of two, 64), or null where there is none: the call under
    /// way then ends in std::bad_alloc.
    void* (*allocate)(std::size_t bytes, std::size_t alignment, void* user) = nullptr;
    /// Takes back what allocate gave; `bytes` and `alignment` are those of that call. Never null.
    void (*release)(void* memory, std::size_t bytes, std::size_t alignment, void* user) = nullptr;
    void* user = nullptr; ///< handed back to both functions
};

/// Arrays made from now on, of the whole process, come from here; each goes back to where it came from, whatever was
/// set since. Call it before the first body is made, or at any time. An Allocator without functions restores the
/// default, aligned operator new. Throws std::invalid_argument where only one of the two functions is given.
HYBMSS_EXPORT void set_allocator(const Allocator& allocator);

} // namespace hybmss
