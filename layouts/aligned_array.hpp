#pragma once

#include "hybmss/allocator.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>

namespace hybmss {

/// A vector's width in the widest precision's count, and the padding of every array: 16 floats are 64 bytes.
inline constexpr std::size_t kPadding = 16;

constexpr std::size_t padded(std::size_t size) {
    return (size + kPadding - 1) / kPadding * kPadding;
}

inline constexpr std::size_t kArrayAlignment = 64;

/// What set_allocator was given last, or the default.
Allocator current_allocator();
/// Memory aligned to kArrayAlignment; null for no bytes. Throws std::bad_alloc.
void* allocate_array(const Allocator& allocator, std::size_t bytes);

/// A zeroed array of plain values, aligned to 64 bytes (a cache line, and the widest vector). Throws std::bad_alloc.
template <class T>
class AlignedArray {
public:
    AlignedArray() = default;
    explicit AlignedArray(std::size_t size) : AlignedArray(size, current_allocator()) {}

    T* data() { return data_.get(); }
    const T* data() const { return data_.get(); }
    T& operator[](std::size_t i) { return data_.get()[i]; }
    const T& operator[](std::size_t i) const { return data_.get()[i]; }
    std::size_t size() const { return size_; }
    std::size_t bytes() const { return size_ * sizeof(T); }

private:
    AlignedArray(std::size_t size, const Allocator& allocator)
        : size_(size),
          data_(static_cast<T*>(allocate_array(allocator, size * sizeof(T))), Delete{allocator, size * sizeof(T)}) {
        std::fill_n(data_.get(), size, T{});
    }

    /// Gives memory back to where it came from.
    struct Delete {
        Allocator allocator;
        std::size_t bytes = 0;
        void operator()(T* p) const { allocator.release(p, bytes, kArrayAlignment, allocator.user); }
    };
    std::size_t size_ = 0;
    std::unique_ptr<T, Delete> data_;
};

} // namespace hybmss
