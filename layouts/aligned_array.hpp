#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>

namespace hybmss {

/// A vector's width in the widest precision's count, and the padding of every array: 16 floats are 64 bytes.
inline constexpr std::size_t kPadding = 16;

constexpr std::size_t padded(std::size_t size) {
    return (size + kPadding - 1) / kPadding * kPadding;
}

/// A zeroed array of plain values, aligned to 64 bytes (a cache line, and the widest vector). Throws std::bad_alloc.
template <class T>
class AlignedArray {
public:
    AlignedArray() = default;
    explicit AlignedArray(std::size_t size)
        : size_(size), data_(static_cast<T*>(::operator new (size * sizeof(T), std::align_val_t{64}))) {
        std::fill_n(data_.get(), size, T{});
    }

    T* data() { return data_.get(); }
    const T* data() const { return data_.get(); }
    T& operator[](std::size_t i) { return data_.get()[i]; }
    const T& operator[](std::size_t i) const { return data_.get()[i]; }
    std::size_t size() const { return size_; }
    std::size_t bytes() const { return size_ * sizeof(T); }

private:
    struct Delete {
        void operator()(T* p) const { ::operator delete (p, std::align_val_t{64}); }
    };
    std::size_t size_ = 0;
    std::unique_ptr<T, Delete> data_;
};

} // namespace hybmss
