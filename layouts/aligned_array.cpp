#include "layouts/aligned_array.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <new>
#include <stdexcept>

namespace hybmss {
namespace {

void* allocate_by_new(std::size_t bytes, std::size_t alignment, void*) {
    return ::operator new (bytes, std::align_val_t{alignment}, std::nothrow);
}
void release_by_delete(void* memory, std::size_t, std::size_t alignment, void*) {
    ::operator delete (memory, std::align_val_t{alignment});
}

constexpr Allocator kDefault = {&allocate_by_new, &release_by_delete, nullptr};

std::mutex mutex;
Allocator current = kDefault;

} // namespace

Allocator current_allocator() {
    const std::lock_guard lock(mutex);
    return current;
}

ArrayPlace allocate_array(const Allocator& allocator, std::size_t bytes) {
    constexpr std::size_t kPageLines = 64, kStep = 5; // lines; odd, so that it meets all of a page's
    if (bytes == 0) {
        return {};
    }
    const std::size_t room = std::min(kPageLines, bytes / 4 / kArrayAlignment);
    ArrayPlace place;
    place.bytes = bytes + room * kArrayAlignment;
    void* const memory = allocator.allocate(place.bytes, kArrayAlignment, allocator.user);
    if (!memory) {
        throw std::bad_alloc();
    }
    static std::atomic<std::size_t> arrays = 0;
    if (room > 0) {
        const std::size_t line = reinterpret_cast<std::uintptr_t>(memory) / kArrayAlignment % kPageLines;
        const std::size_t wanted = arrays.fetch_add(1, std::memory_order_relaxed) * kStep % kPageLines;
        place.offset = (wanted + kPageLines - line) % kPageLines % room * kArrayAlignment;
    }
    place.array = static_cast<std::byte*>(memory) + place.offset;
    return place;
}

void release_array(const Allocator& allocator, const ArrayPlace& place) {
    allocator.release(static_cast<std::byte*>(place.array) - place.offset, place.bytes, kArrayAlignment,
                      allocator.user);
}

void set_allocator(const Allocator& allocator) {
    if (!allocator.allocate != !allocator.release) {
        throw std::invalid_argument("allocator: allocate and release must both be given, or neither");
    }
    const std::lock_guard lock(mutex);
    current = allocator.allocate ? allocator : kDefault;
}

} // namespace hybmss
