#pragma once

#include "solvers/multigrid/cell_stiffness.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace hybmss {

/// A symmetric, positive semidefinite matrix whose entries lie near the diagonal, and its Cholesky factors.
class BandMatrix {
public:
    /// `width`: the greatest distance of an entry from the diagonal.
    BandMatrix(std::size_t size, std::size_t width);

    void clear();
    /// Of row i, column j; j <= i <= j + width.
    double& at(std::size_t i, std::size_t j) { return entries_[i * (width_ + 1) + j + width_ - i]; }
    /// Replaces the matrix by its factors. A pivot below this part of its diagonal entry counts as that entry: what is
    /// singular is held there.
    void factor(double smallest_pivot);
    /// x = K^-1 x
    void solve(std::vector<double>& x) const;

private:
    std::size_t size_, width_;
    std::vector<double> entries_; ///< by rows, from the column `width` before the diagonal to it
};

/// The Cholesky factors of a slender lattice's matrix, its nodes numbered along the longest axis.
///
/// A rod of n cells is softer in bending than its cells by n^4: no merging of cells keeps that, for merged cells lock,
/// and polynomials smooth only what is stiff. But its matrix is a narrow band. It is that of Multigrid's cells,
/// positive semidefinite cell by cell, in double.
template <class T>
class Banded final : public Preconditioner<T> {
public:
    Banded(const Body<T>& body, const Lattice& lattice, const Material& material);

    void update(const Potential<T>& potential) override;
    void apply(const NodeVector<T>& r, NodeVector<T>& z) override;
    std::string_view name() const override { return "banded"; }

private:
    struct Cell {
        std::array<std::uint32_t, 8> nodes; ///< of the body, by corner
        double scale;                       ///< times unit_
        std::size_t tissue;
    };

    const Potential<T>* potential_ = nullptr;
    CellStiffness stiffness_;
    double unit_; ///< the body's unit of length by the cell's edge
    std::vector<Cell> cells_;
    std::vector<std::uint32_t> places_; ///< of the body's nodes in the layout
    std::vector<std::uint32_t> number_; ///< likewise along the axis
    std::optional<BandMatrix> matrix_;
    std::vector<double> values_;
};

extern template class Banded<float>;
extern template class Banded<double>;

/// Whether the band's factors are likely to take less time than multigrid's cycles for the lattice.
bool banded_pays(const Lattice& lattice);

} // namespace hybmss
