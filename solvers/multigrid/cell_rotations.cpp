#include "solvers/multigrid/cell_rotations.hpp"

#include "kernels/grid_arguments.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <utility>

namespace hybmss {

CellRotations::CellRotations(const CellGradients& gradients, const kernels::KernelTable<float>& table,
                             const SharedGrid* shared)
    : gradients_(&gradients), table_(&table), shared_(shared) {
    for (auto& entries : inverse_) {
        entries.assign(gradients.grid().size() + kBeyond, 0.0f);
    }
}

void CellRotations::invert(std::size_t cell, std::size_t count, const Lanes (&stiffness)[6], double smallest) {
    for (std::size_t lane = 0; lane < count; ++lane) {
        std::array<double, 6> entries;
        for (std::size_t e = 0; e < 6; ++e) {
            entries[e] = static_cast<double>(stiffness[e][lane]);
        }
        const std::array<double, 6> kept = shared_ ? entries : bounded_pseudoinverse(entries, smallest);
        for (std::size_t e = 0; e < 6; ++e) {
            inverse_[e][cell + lane] = static_cast<float>(kept[e]);
        }
    }
}

void CellRotations::finish(double smallest) {
    if (!shared_) {
        return;
    }
    shared_->give_back(inverse_);
    for_each_place({-1, -1, -1}, gradients_->grid().cells, [&](int i, int j, int k) {
        const std::size_t cell = gradients_->grid().index(i, j, k);
        std::array<double, 6> entries;
        for (std::size_t e = 0; e < 6; ++e) {
            entries[e] = static_cast<double>(inverse_[e][cell]);
        }
        const std::array<double, 6> inverse = bounded_pseudoinverse(entries, smallest);
        for (std::size_t e = 0; e < 6; ++e) {
            inverse_[e][cell] = static_cast<float>(inverse[e]);
        }
    });
}

// A cell gives sx X + sy Y + sz Z to its corners. A node takes that of the two cells along x first, then of those along
// y, then adds it to its plane and to the one above.
void CellRotations::add_correction(const GridVector& r, GridVector& z, const Workers& workers) const {
    const PaddedGrid& grid = gradients_->grid();
    const auto [nx, ny, nz] = grid.cells;
    const auto nodes = static_cast<std::size_t>(nx + 1);
    const std::size_t width = nodes + 1 + kBeyond;
    kernels::CellTurns<float> turns;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        turns.corner[corner] = static_cast<std::ptrdiff_t>(grid.corner_offset(corner));
    }
    const auto turn = table_->turn_cells();
    const auto add = table_->add_turned();
    const auto layer = [&, ny = ny, nz = nz](int k, std::vector<float>& scratch) {
        scratch.resize(18 * width);
        float *before = scratch.data(), *now = before + 9 * width;
        kernels::CellTurns<float> row = turns;
        kernels::TurnedRows<float> rows;
        for (int j = -1; j <= ny; ++j) {
            const std::size_t first = grid.index(-1, j, k), node = first + 1;
            for (std::size_t e = 0; e < 9; ++e) {
                row.gradient[e] = gradients_->entries()[e].data() + first;
                row.turned[e] = now + e * width;
                rows.before[e] = before + e * width;
                rows.now[e] = now + e * width;
            }
            for (std::size_t e = 0; e < 6; ++e) {
                row.inverse[e] = inverse_[e].data() + first;
            }
            for (std::size_t c = 0; c < 3; ++c) {
                row.residual[c] = r.c[c].data() + first;
                rows.below[c] = k >= 0 ? z.c[c].data() + node : nullptr;
                rows.above[c] = k < nz ? z.c[c].data() + node + grid.plane() : nullptr;
            }
            turn(row, 0, static_cast<kernels::Range>(nodes + 1));
            if (j >= 0) {
                add(rows, static_cast<kernels::Range>(nodes));
            }
            std::swap(before, now);
        }
    };
    // A layer of cells writes two planes of nodes: every other layer at a time.
    const auto layers = static_cast<std::size_t>(nz + 2);
    for (std::size_t parity = 0; parity < 2; ++parity) {
        workers.run((layers + 1 - parity) / 2, [&](std::size_t piece, std::size_t) {
            thread_local std::vector<float> scratch;
            layer(static_cast<int>(2 * piece + parity) - 1, scratch);
        });
    }
}

} // namespace hybmss
