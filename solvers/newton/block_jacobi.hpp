#pragma once

#include "solvers/newton/preconditioner.hpp"

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
    AlignedArray<T> inverse_[6];        ///< xx, yy, zz, xy, xz, yz by places in the layout; zero where there is no node
    std::vector<std::uint32_t> places_; ///< of the body's nodes
};

extern template class BlockJacobi<float>;
extern template class BlockJacobi<double>;

} // namespace hybmss
