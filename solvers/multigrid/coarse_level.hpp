#pragma once

#include "solvers/multigrid/cell_patterns.hpp"
#include "solvers/multigrid/cell_rotations.hpp"
#include "solvers/multigrid/chebyshev.hpp"

#include <algorithm>
#include <memory>
#include <optional>

namespace hybmss {

/// One level of coarse cells: its matrix as 14 blocks a node, and its smoother.
class CoarseLevel {
public:
    /// `rotations`: smooth over the cells' rotations too.
    CoarseLevel(const PaddedGrid& grid, bool rotations, const Workers& workers);

    const PaddedGrid& grid() const { return grid_; }
    /// Of the level's cells; where the rotations are smoothed, to be set before assemble().
    CellGradients& gradients() { return gradients_; }
    /// Takes the matrices of the cells: layer(k, add) calls add(i, j, matrices, count) for all that are at height k,
    /// `count` neighbours from (i, j) along x at a time. Layers are asked for side by side.
    template <class Layer>
    void assemble(const Layer& layer) {
        std::fill(stencil_.begin(), stencil_.end(), 0.0f);
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

    /// Improves x towards K x = b.
    void smooth(bool from_zero, const GridVector& b, GridVector& x, int degree, double low_part);
    /// r = b - K x
    void residual(const GridVector& b, const GridVector& x, GridVector& r);

    // What chebyshev() asks for.
    void multiply(const GridVector& p, GridVector& out);
    void correct(const GridVector& from, const GridVector* product, double keep, double add,
                 ChebyshevVectors<GridVector>& vectors, GridVector& x);
    template <class Map, class... Vectors>
    void for_each(const Map& map, Vectors&... vectors) const {
        const auto planes = static_cast<std::size_t>(grid_.cells[2] + 3);
        run(planes, [&](std::size_t k) {
            for (std::size_t c = 0; c < 3; ++c) {
                for (std::size_t n = k * grid_.plane(); n < (k + 1) * grid_.plane(); ++n) {
                    map(vectors.c[c][n]...);
                }
            }
        });
    }

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
    void precondition(const GridVector& r, GridVector& z);

    PaddedGrid grid_;
    const Workers* workers_;
    /// Entry (itself and 13 neighbours that come after, 9 entries, nodes); those before see the node as it sees them.
    std::vector<float> stencil_;
    std::array<std::vector<float>, 6> inverse_;
    CellGradients gradients_;
    std::optional<CellRotations> rotations_;
    ChebyshevVectors<GridVector> vectors_;
    double highest_ = 2;
};

/// The coarsest level, solved directly.
class DirectLevel {
public:
    explicit DirectLevel(const PaddedGrid& grid);
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
    void solve(const GridVector& b, GridVector& x);

    GridVector right_side, solution;

private:
    struct Factors;
    void clear();
    void add(int i, int j, int k, const CellMatrices& matrices, std::size_t count);
    void factor();
    PaddedGrid grid_;
    CellGradients gradients_;
    std::unique_ptr<Factors> factors_;
};

} // namespace hybmss
