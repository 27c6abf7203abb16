#include "solvers/newton/vector_space.hpp"

#include <algorithm>

namespace hybmss {

template <class T>
VectorSpace<T>::VectorSpace(const Body<T>& body) : workers_(&body.workers()) {
    constexpr std::size_t kPiece = 4096;
    const State<T> sample = body.make_state(false);
    for (std::size_t c = 0; c < 3; ++c) {
        sizes_[c] = sample.displacement[c].size();
        for (std::size_t begin = 0; begin < sizes_[c]; begin += kPiece) {
            pieces_.push_back({c, begin, std::min(kPiece, sizes_[c] - begin)});
        }
    }
    partial_.resize(pieces_.size());
}

template <class T>
NodeVector<T> VectorSpace<T>::make() const {
    NodeVector<T> vector;
    for (std::size_t c = 0; c < 3; ++c) {
        vector.field[c] = AlignedArray<T>(sizes_[c]);
    }
    return vector;
}

template class VectorSpace<float>;
template class VectorSpace<double>;

} // namespace hybmss
