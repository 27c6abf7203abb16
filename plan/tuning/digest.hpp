#pragma once

#include "layouts/messages.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace hybmss {

/// FNV-1a in 64 bits: any one changed byte changes it. Against damage and mix-ups, not against malice.
class Digest {
public:
    Digest() = default;
    /// Goes on from another digest's value.
    explicit Digest(std::uint64_t value) : value_(value) {}
    void add(const void* data, std::size_t bytes) {
        const auto* byte = static_cast<const unsigned char*>(data);
        for (std::size_t i = 0; i < bytes; ++i) {
            value_ = (value_ ^ byte[i]) * 0x100000001b3u;
        }
    }
    void add(std::string_view text) { add(text.data(), text.size()); }
    template <class T>
    void add(std::span<const T> values) {
        add(values.data(), values.size_bytes());
    }
    std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// Of a text, in 16 hexadecimal digits.
inline std::string hexadecimal_digest(std::string_view text) {
    Digest digest;
    digest.add(text);
    return printed("%016llx", static_cast<unsigned long long>(digest.value()));
}

} // namespace hybmss
