#include "solvers/newton/block_jacobi.hpp"

#include "solvers/multigrid/bounded_inverse.hpp"

#include <algorithm>

namespace hybmss {
namespace {

/// Eigenvalues of a block below this part of its largest count as that. (A corner node with a single, nearly
/// incompressible cell has a ratio of G / kappa.)
constexpr double kSmallest = 1e-6;

} // namespace
template <class T>
void BlockJacobi<T>::update(const Potential<T>& potential) {
    const Body<T>& body = potential.body();
    if (potential_ != &potential) {
        potential_ = &potential;
        places_.resize(body.node_count());
        for (std::size_t n = 0; n < places_.size(); ++n) {
            places_[n] = static_cast<std::uint32_t>(body.index_of(n));
        }
    }
    potential.diagonal(inverse_);
    const std::span<const double> pull = potential.pull_stiffness();
    constexpr std::size_t kPiece = 2048;
    body.workers().run((places_.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
        for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, places_.size()); ++n) {
            const std::size_t place = places_[n];
            const auto entry = [&](std::size_t e) { return static_cast<double>(inverse_[e][place]); };
            const double more = pull.empty() ? 0 : pull[n];
            const std::array<double, 6> inverse =
                bounded_inverse({entry(0) + more, entry(3), entry(4), entry(1) + more, entry(5), entry(2) + more},
                                potential.held()[n], kSmallest, 1);
            constexpr std::size_t kOrder[6] = {0, 3, 4, 1, 5, 2};
            for (std::size_t e = 0; e < 6; ++e) {
                inverse_[kOrder[e]][place] = static_cast<T>(inverse[e]);
            }
        }
    });
}

template <class T>
void BlockJacobi<T>::apply(const NodeVector<T>& r, NodeVector<T>& z) {
    const T* b[6];
    for (std::size_t e = 0; e < 6; ++e) {
        b[e] = inverse_[e].data();
    }
    const auto multiply = [&](std::size_t place, const T* in[3], T* out[3], std::size_t at) {
        const T x = in[0][at], y = in[1][at], w = in[2][at];
        out[0][at] = b[0][place] * x + b[3][place] * y + b[4][place] * w;
        out[1][at] = b[3][place] * x + b[1][place] * y + b[5][place] * w;
        out[2][at] = b[4][place] * x + b[5][place] * y + b[2][place] * w;
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
