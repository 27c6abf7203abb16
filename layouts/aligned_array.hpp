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

/// Where an array of plain values lies: aligned to kArrayAlignment, and set off from where its memory begins.
///
/// A sweep walks some twenty arrays side by side. Where all of them begin at the same place in a page, as large ones do
/// that the system hands out in whole pages, they fall into the same sets of the first cache, and stores look like ones
/// that later loads have to wait for: steps take a tenth longer and more. So each array begins five cache lines further
/// into a page than the one before, as near to that as a quarter of its own size allows.
struct ArrayPlace {
    void* array = nullptr; ///< null for no bytes
    std::size_t offset = 0;
    std::size_t bytes = 0; ///< allocated, from array - offset on
};
/// Throws std::bad_alloc.
ArrayPlace allocate_array(const Allocator& allocator, std::size_t bytes);
void release_array(const Allocator& allocator, const ArrayPlace& place);

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
    std::size_t bytes() const { return data_.get_deleter().place.bytes; }

private:
    AlignedArray(std::size_t size, const Allocator& allocator)
        : AlignedArray(size, allocator, allocate_array(allocator, size * sizeof(T))) {}
    AlignedArray(std::size_t size, const Allocator& allocator, const ArrayPlace& place)
        : size_(size), data_(static_cast<T*>(place.array), Delete{allocator, place}) {
        std::fill_n(data_.get(), size, T{});
    }

    /// Gives memory back to where it came from.
    struct Delete {
        Allocator allocator;
        ArrayPlace place;
        void operator()(T*) const { release_array(allocator, place); }
    };
    std::size_t size_ = 0;
    std::unique_ptr<T, Delete> data_;
};

} // namespace hybmss
