#pragma once

#include "solvers/newton/potential.hpp"

#include <string_view>

namespace hybmss {

/// An approximate inverse of a potential's second derivatives on its free components: symmetric and positive definite
/// even where the derivatives are not, as conjugate gradients and the trust region's norm ask for.
template <class T>
class Preconditioner {
public:
    virtual ~Preconditioner() = default;

    /// Takes the potential at its last linearisation.
    virtual void update(const Potential<T>& potential) = 0;
    /// z = B r; both zero on held components and in the padding.
    virtual void apply(const NodeVector<T>& r, NodeVector<T>& z) = 0;
    virtual std::string_view name() const = 0;
};

} // namespace hybmss
