#pragma once

#include "solvers/multigrid/cell_rotations.hpp"
#include "solvers/multigrid/cell_stiffness.hpp"
#include "solvers/multigrid/chebyshev.hpp"

#include <memory>
#include <optional>
#include <span>

namespace hybmss {

/// One level of coarse cells: its matrix as 27 blocks a node, and its smoother.
class CoarseLevel {
public:
    /// `rotations`: smooth over the cells' rotations too.
    CoarseLevel(const PaddedGrid& grid, bool rotations, const Workers& workers);

    const PaddedGrid& grid() const { return grid_; }
    /// Takes the matrices of the cells (x fastest, then y, then z; zero where there is none).
    void assemble(std::span<const CellMatrix> cells);
    /// Where the rotations are to be told each cell's deformation; null without rotations. Call before assemble().
    CellRotations* rotations() { return rotations_ ? &*rotations_ : nullptr; }
    /// Estimates the spectrum's upper end, after assemble().
    void estimate_spectrum();

    /// Improves x towards K x = b.
    void smooth(bool from_zero, const GridVector& b, GridVector& x, int degree, double low_part);
    /// r = b - K x
    void residual(const GridVector& b, const GridVector& x, GridVector& r);

    // What chebyshev() asks for.
    void multiply(const GridVector& p, GridVector& out);
    void precondition(const GridVector& r, GridVector& z);
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
    void invert_diagonal();
    void invert_rotations();

    PaddedGrid grid_;
    const Workers* workers_;
    std::vector<float> stencil_; ///< entry (27 neighbours, 9 entries, nodes)
    std::array<std::vector<float>, 6> inverse_;
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
    void assemble(std::span<const CellMatrix> cells);
    void solve(const GridVector& b, GridVector& x);

    GridVector right_side, solution;

private:
    struct Factors;
    PaddedGrid grid_;
    std::unique_ptr<Factors> factors_;
};

} // namespace hybmss
