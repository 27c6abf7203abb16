#pragma once

#include "solvers/preconditioner.hpp"

namespace hybmss {

/// The inverse of each node's 3x3 block, made positive definite.
template <class T>
class BlockJacobi final : public Preconditioner<T> {
public:
    void update(const Potential<T>& potential) override;
    void apply(const NodeVector<T>& r, NodeVector<T>& z) override;
    std::string_view name() const override { return "block-jacobi"; }

private:
    const Potential<T>* potential_ = nullptr;
    std::vector<Symmetric3<double>> blocks_; ///< by the body's nodes
    AlignedArray<T> inverse_[6];             ///< by places in the layout; zero where there is no node
};

extern template class BlockJacobi<float>;
extern template class BlockJacobi<double>;

} // namespace hybmss
