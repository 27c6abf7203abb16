#include "layouts/aligned_array.hpp"

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

void* allocate_array(const Allocator& allocator, std::size_t bytes) {
    if (bytes == 0) {
        return nullptr;
    }
    void* memory = allocator.allocate(bytes, kArrayAlignment, allocator.user);
    if (!memory) {
        throw std::bad_alloc();
    }
    return memory;
}

void set_allocator(const Allocator& allocator) {
    if (!allocator.allocate != !allocator.release) {
        throw std::invalid_argument("allocator: allocate and release must both be given, or neither");
    }
    const std::lock_guard lock(mutex);
    current = allocator.allocate ? allocator : kDefault;
}

} // namespace hybmss
