#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "solvers/newton/potential.hpp"

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

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

/// The inverse of a symmetric 3x3 block (xx, xy, xz, yy, yz, zz) on the axes that are not held (bit 0: x, 1: y, 2: z),
/// zero on the others. Eigenvalues count by their magnitude, at least `smallest` of the largest, so the inverse is
/// positive definite; a block of zeros has the inverse `of_zero` times one.
std::array<double, 6> bounded_inverse(const std::array<double, 6>& block, unsigned held, double smallest,
                                      double of_zero);
/// The same without what is nearly singular: directions below `smallest` of the largest eigenvalue get zero.
std::array<double, 6> bounded_pseudoinverse(const std::array<double, 6>& block, double smallest);

/// The inverse of each node's 3x3 block, made positive definite.
template <class T>
class BlockJacobi final : public Preconditioner<T> {
public:
    explicit BlockJacobi(Curvature curvature = Curvature::whole) : curvature_(curvature) {}

    void update(const Potential<T>& potential) override;
    void apply(const NodeVector<T>& r, NodeVector<T>& z) override;
    /// r = from - (product + pull), or from where that is null; d = keep d + add B r; x += d, or x = d where `product`
    /// is null. `product` is Potential::multiply_body() of d, or of x where keep is 0; the pull is of the same. In one
    /// go; r may hold anything on held components afterwards.
    void correct(const NodeVector<T>& from, const NodeVector<T>* product, double keep, double add, NodeVector<T>& r,
                 NodeVector<T>& d, NodeVector<T>& x);
    std::string_view name() const override { return "block-jacobi"; }

private:
    void pass(kernels::BlockUse use, const NodeVector<T>& from, const NodeVector<T>* product, double keep, double add,
              NodeVector<T>& r, NodeVector<T>& d, NodeVector<T>& x) const;

    Curvature curvature_;
    const Potential<T>* potential_ = nullptr;
    AlignedArray<T> inverse_[6];        ///< xx, yy, zz, xy, xz, yz by places in the layout; zero where there is no node
    std::vector<std::uint32_t> places_; ///< of the body's nodes
};

extern template class BlockJacobi<float>;
extern template class BlockJacobi<double>;

/// kappa / G, the largest of a lattice's tissues; 0 without volume energy.
double volume_to_shear(const Lattice& lattice, const Material& material);

/// Whether multigrid is likely to take less time than block Jacobi for a solve of the lattice.
///
/// A rule in Hessian products, from `hybmss-study bench solvers`: with n cells along the longest edge, more for a
/// slender body, and r = 1 + kappa/G, block Jacobi takes about 9.2 n r^0.44 of them for a static solve, multigrid about
/// 200 + 83 r^0.62, by as much more as the bounding box has more cells than the body.
bool multigrid_pays(const Lattice& lattice, const Material& material);
/// The same of one material, with `present` of a box of cells.
bool multigrid_pays(const std::array<int, 3>& cells, double present, const Material& material);
/// The same of a step of backward Euler, of `reach` critical steps: a node feels no farther than about so many cells.
///
/// By the `euler` rows, in iterations of block Jacobi: that takes about 10 min(reach, 1.65 n r^0.44) of them, multigrid
/// as much time as 30 + 7 r^0.44 do, whatever the step's length, by as much more as above; cells that are merged of
/// less than three across have little of what slender bodies do.
bool multigrid_pays_in_step(const Lattice& lattice, const Material& material, double reach);
/// Those that a static solve takes by this rule, with the preconditioner that takes fewer.
double expected_products(const Lattice& lattice, const Material& material);

} // namespace hybmss
