#pragma once

#include "solvers/multigrid/cell_patterns.hpp"
#include "solvers/multigrid/cell_rotations.hpp"
#include "solvers/multigrid/chebyshev.hpp"

#include "plan/bodies/body.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

namespace hybmss {

/// One level of coarse cells: its matrix as 14 blocks a node, and its smoother.
class CoarseLevel {
public:
    /// `rotations`: smooth over the cells' rotations too. With the workers and the kernels of `body`. `ranks`: where
    /// the cells are those of a rank alone; else null.
    CoarseLevel(const PaddedGrid& grid, bool rotations, const Body<float>& body, const Ranks* ranks);

    const PaddedGrid& grid() const { return grid_; }
    /// Of the level's cells; where the rotations are smoothed, to be set before assemble().
    CellGradients& gradients() { return gradients_; }
    /// Takes the matrices of the cells: layer(k, add) calls add(i, j, matrices, count) for all that are at height k,
    /// `count` neighbours from (i, j) along x at a time. Layers are asked for side by side.
    template <class Layer>
    void assemble(const Layer& layer) {
        std::fill_n(stencil_.data(), stencil_.size(), 0.0f);
        const auto layers = static_cast<std::size_t>(grid_.cells[2]);
        // A layer of cells adds to two planes of nodes: every other layer at a time.
        for (std::size_t parity = 0; parity < 2; ++parity) {
            run((layers + 1 - parity) / 2, [&](std::size_t piece) {
                const auto k = static_cast<int>(2 * piece + parity);
                layer(k, [&](int i, int j, const CellMatrices& matrices, std::size_t count) {
                    add(grid_.index(i, j, k), matrices, count);
                });
            });
        }
        invert();
    }
    /// Estimates the spectrum's upper end, after assemble().
    void estimate_spectrum();

    /// Null where no other rank has cells.
    const SharedGrid* shared() const { return shared_ ? &*shared_ : nullptr; }
    /// Improves x towards K x = b.
    void smooth(bool from_zero, const GridVector& b, GridVector& x, int degree, double low_part);
    /// r = b - K x
    void residual(const GridVector& b, const GridVector& x, GridVector& r);

    // What chebyshev() asks for.
    void multiply(const GridVector& p, GridVector& out);
    void correct(const GridVector& from, const GridVector* product, double keep, double add,
                 ChebyshevVectors<GridVector>& vectors, GridVector& x);

    GridVector right_side, solution, rest; ///< what the cycle keeps at this level

private:
    template <class Visit>
    void run(std::size_t count, const Visit& visit) const {
        if (grid_.size() < 4096) {
            for (std::size_t i = 0; i < count; ++i) {
                visit(i);
            }
        } else {
            workers_->run(count, [&](std::size_t i, std::size_t) { visit(i); });
        }
    }
    void add(std::size_t low, const CellMatrices& matrices, std::size_t count);
    void invert();
    void invert_rotations();
    /// visit(begin, end) of pieces of all nodes, or of those that are no padding but between them; whole vectors.
    template <class Visit>
    void for_each_piece(std::size_t begin, std::size_t end, const Visit& visit) const {
        constexpr std::size_t kPiece = 2048;
        run((end - begin + kPiece - 1) / kPiece, [&](std::size_t piece) {
            const std::size_t from = begin + piece * kPiece;
            visit(static_cast<kernels::Range>(from), static_cast<kernels::Range>(std::min(from + kPiece, end)));
        });
    }
    /// By node. That of the first node is aligned.
    const float* entries(std::size_t entry) const {
        return stencil_.data() + padded(first_) - first_ + entry * stride_;
    }
    float* entries(std::size_t entry) { return const_cast<float*>(std::as_const(*this).entries(entry)); }
    /// out = K p, or from - K p where that is not null.
    void apply_stencil(const GridVector& p, const GridVector* from, GridVector& out) const;
    void pass_blocks(kernels::BlockUse use, const GridVector& from, double keep, double add, GridVector& r,
                     GridVector& d, GridVector& x) const;
    void precondition(const GridVector& r, GridVector& z);

    double norm(const GridVector& vector) const;

    PaddedGrid grid_;
    const Ranks* ranks_;
    std::optional<SharedGrid> shared_;
    const Workers* workers_;
    const kernels::KernelTable<float>* table_;
    std::size_t stride_, first_; ///< from one entry of the stencil to the next; the first node
    /// Entry (itself and 13 neighbours that come after, 9 entries, nodes); those before see the node as it sees them.
    AlignedArray<float> stencil_;
    std::array<std::vector<float>, 6> inverse_;
    CellGradients gradients_;
    std::optional<CellRotations> rotations_;
    ChebyshevVectors<GridVector> vectors_;
    double highest_ = 2;
};

/// The coarsest level, solved directly.
class DirectLevel {
public:
    /// `box`: of the level's cells; `grid` is what the rank has of them. `ranks` may be null.
    DirectLevel(const PaddedGrid& grid, const RankBox& box, const Ranks* ranks);
    ~DirectLevel();
    const PaddedGrid& grid() const { return grid_; }
    CellGradients& gradients() { return gradients_; }
    /// As CoarseLevel's, one layer after the other.
    template <class Layer>
    void assemble(const Layer& layer) {
        clear();
        for (int k = 0; k < grid_.cells[2]; ++k) {
            layer(k, [&](int i, int j, const CellMatrices& matrices, std::size_t count) {
                add(i, j, k, matrices, count);
            });
        }
        factor();
    }
    /// Of ranks, b is what each has of a sum.
    void solve(const GridVector& b, GridVector& x);

    GridVector right_side, solution;

private:
    struct Factors;
    void clear();
    void add(int i, int j, int k, const CellMatrices& matrices, std::size_t count);
    void factor();
    /// Of a node's first component among the unknowns.
    std::ptrdiff_t unknown(int i, int j, int k) const;
    PaddedGrid grid_;
    RankBox box_;
    const Ranks* ranks_;
    CellGradients gradients_;
    std::unique_ptr<Factors> factors_;
};

} // namespace hybmss
