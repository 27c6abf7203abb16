#include "solvers/block_jacobi.hpp"

#include "solvers/bounded_inverse.hpp"

#include <algorithm>

namespace hybmss {
template <class T>
void BlockJacobi<T>::update(const Potential<T>& potential) {
    potential_ = &potential;
    const Body<T>& body = potential.body();
    potential.tangent().convex_diagonal(blocks_);
    const std::span<const double> pull = potential.pull_stiffness();
    const auto& free = potential.free().field;
    const std::size_t places = free[1].size() > 0 ? free[0].size() : free[0].size() / 4;
    for (auto& entries : inverse_) {
        if (entries.size() != places) {
            entries = AlignedArray<T>(places);
        }
    }
    for (std::size_t n = 0; n < blocks_.size(); ++n) {
        if (!pull.empty()) {
            for (std::size_t diagonal : {0, 3, 5}) {
                blocks_[n][diagonal] += pull[n];
            }
        }
        const Symmetric3<double> inverse = bounded_inverse(blocks_[n], potential.held()[n], 1e-6, 1);
        const std::size_t place = body.index_of(n);
        for (std::size_t e = 0; e < 6; ++e) {
            inverse_[e][place] = static_cast<T>(inverse[e]);
        }
    }
}

template <class T>
void BlockJacobi<T>::apply(const NodeVector<T>& r, NodeVector<T>& z) {
    const T* b[6];
    for (std::size_t e = 0; e < 6; ++e) {
        b[e] = inverse_[e].data();
    }
    const auto multiply = [&](std::size_t place, const T* in[3], T* out[3], std::size_t at) {
        const T x = in[0][at], y = in[1][at], w = in[2][at];
        out[0][at] = b[0][place] * x + b[1][place] * y + b[2][place] * w;
        out[1][at] = b[1][place] * x + b[3][place] * y + b[4][place] * w;
        out[2][at] = b[2][place] * x + b[4][place] * y + b[5][place] * w;
    };
    const T* in[3];
    T* out[3];
    for (std::size_t c = 0; c < 3; ++c) {
        in[c] = component(r.field, c).first;
        out[c] = component(z.field, c).first;
    }
    const auto stride = static_cast<std::size_t>(component(r.field, 0).stride);
    constexpr std::size_t kPiece = 2048;
    const std::size_t places = inverse_[0].size();
    potential_->body().workers().run((places + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
        const std::size_t end = std::min((piece + 1) * kPiece, places);
        if (stride == 1) {
            for (std::size_t p = piece * kPiece; p < end; ++p) {
                multiply(p, in, out, p);
            }
        } else {
            for (std::size_t p = piece * kPiece; p < end; ++p) {
                multiply(p, in, out, p * stride);
            }
        }
    });
}

template class BlockJacobi<float>;
template class BlockJacobi<double>;

} // namespace hybmss
