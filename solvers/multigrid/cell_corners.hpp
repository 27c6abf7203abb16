#pragma once

#include <cstddef>

namespace hybmss {

/// s = -1 or +1 an axis: where corner lies as seen from the cell's middle, in half edges.
inline void corner_signs(std::size_t corner, float (&s)[3]) {
    for (std::size_t c = 0; c < 3; ++c) {
        s[c] = corner >> c & 1 ? 1.0f : -1.0f;
    }
}

/// The corner of the cell shifted by d that is corner a of the cell itself, or 8 where they do not share it.
inline std::size_t shared_corner(std::size_t a, const int (&d)[3]) {
    std::size_t corner = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const int at = static_cast<int>(a >> c & 1) - d[c];
        if (at < 0 || at > 1) {
            return 8;
        }
        corner |= static_cast<std::size_t>(at) << c;
    }
    return corner;
}

} // namespace hybmss
