// The matrices of the levels: every coarse cell is the sum of the cells that it holds, each spread over its corners.
#include "solvers/multigrid/cell_merging.hpp"
#include "solvers/multigrid/multigrid.hpp"

namespace hybmss {

template <class T>
void Multigrid<T>::merge_finest(const Potential<T>& potential) {
    const PaddedGrid& coarse = levels_.empty() ? direct_->grid() : levels_[0]->grid();
    const std::array<int, 3>& cells = grid_.cells;
    const auto count = [](const PaddedGrid& grid) {
        return static_cast<std::size_t>(grid.cells[0]) * static_cast<std::size_t>(grid.cells[1]) *
               static_cast<std::size_t>(grid.cells[2]);
    };
    merged_.resize(count(coarse));
    const NodeField<T>& u = potential.displacement();
    const Component<const T> component_of[3] = {component(u, 0), component(u, 1), component(u, 2)};
    const std::span<const double> pull = potential.pull_stiffness();
    const std::span<const std::uint8_t> held = potential.held();
    const int merged[3] = {coarse.cells[0] != cells[0], coarse.cells[1] != cells[1], coarse.cells[2] != cells[2]};

    const auto evaluate = [&](int i, int j, int k, CellMatrix& matrix) {
        const auto cell =
            static_cast<std::size_t>(i) +
            static_cast<std::size_t>(cells[0]) *
                (static_cast<std::size_t>(j) + static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(k));
        if (!(scales_[cell] > 0)) {
            return false;
        }
        const std::size_t low = grid_.index(i, j, k);
        double displacement[8][3];
        std::uint32_t node[8];
        for (std::size_t a = 0; a < 8; ++a) {
            node[a] = node_at_[low + grid_.corner_offset(a)];
            const auto place = static_cast<std::ptrdiff_t>(places_[node[a]]);
            for (std::size_t c = 0; c < 3; ++c) {
                displacement[a][c] = unit_ * static_cast<double>(component_of[c].first[place * component_of[c].stride]);
            }
        }
        CellShape shape;
        stiffness_.evaluate(displacement, static_cast<double>(scales_[cell]), matrix, shape);
        for (std::size_t a = 0; a < 8; ++a) {
            if (!pull.empty()) {
                const auto share = static_cast<float>(pull[node[a]]) / touching_[node[a]];
                for (const std::size_t e : {0u, 4u, 8u}) {
                    matrix.block[a][a][e] += share;
                }
            }
            for (std::size_t c = 0; held[node[a]] != 0 && c < 3; ++c) {
                if (held[node[a]] >> c & 1) {
                    for (std::size_t b = 0; b < 8; ++b) {
                        for (std::size_t e = 0; e < 3; ++e) {
                            matrix.block[a][b][3 * c + e] = 0;
                            matrix.block[b][a][3 * e + c] = 0;
                        }
                    }
                }
            }
        }
        if (rotations_) {
            shapes_[cell] = shape;
            rotations_->present()[low] = 1;
            for (std::size_t e = 0; e < 9; ++e) {
                rotations_->gradient()[e][low] = shape.gradient[e];
            }
        }
        return true;
    };
    workers_->run(static_cast<std::size_t>(coarse.cells[2]), [&](std::size_t layer, std::size_t) {
        const int ck = static_cast<int>(layer);
        std::size_t n = layer * static_cast<std::size_t>(coarse.cells[0]) * static_cast<std::size_t>(coarse.cells[1]);
        CellMatrix one, pair, quad;
        for_each_place({0, 0, ck}, {coarse.cells[0] - 1, coarse.cells[1] - 1, ck}, [&](int ci, int cj, int) {
            CellMatrix& sum = merged_[n++];
            sum = {};
            for (int z = 0; z <= merged[2]; ++z) {
                quad = {};
                for (int y = 0; y <= merged[1]; ++y) {
                    pair = {};
                    for (int x = 0; x <= merged[0]; ++x) {
                        const int i = (1 + merged[0]) * ci + x, j = (1 + merged[1]) * cj + y,
                                  k = (1 + merged[2]) * ck + z;
                        if (i < cells[0] && j < cells[1] && k < cells[2] && evaluate(i, j, k, one)) {
                            if (merged[0]) {
                                spread_half(one, 0, x == 1);
                            }
                            add(one, pair);
                        }
                    }
                    if (merged[1]) {
                        spread_half(pair, 1, y == 1);
                    }
                    add(pair, quad);
                }
                if (merged[2]) {
                    spread_half(quad, 2, z == 1);
                }
                add(quad, sum);
            }
        });
    });
}

template <class T>
void Multigrid<T>::merge(std::span<const CellMatrix> fine_cells, const PaddedGrid& fine, const PaddedGrid& coarse) {
    merged_next_.resize(static_cast<std::size_t>(coarse.cells[0]) * static_cast<std::size_t>(coarse.cells[1]) *
                        static_cast<std::size_t>(coarse.cells[2]));
    const int merged[3] = {coarse.cells[0] != fine.cells[0], coarse.cells[1] != fine.cells[1],
                           coarse.cells[2] != fine.cells[2]};
    workers_->run(static_cast<std::size_t>(coarse.cells[2]), [&](std::size_t layer, std::size_t) {
        const int ck = static_cast<int>(layer);
        std::size_t n = layer * static_cast<std::size_t>(coarse.cells[0]) * static_cast<std::size_t>(coarse.cells[1]);
        CellMatrix one;
        for_each_place({0, 0, ck}, {coarse.cells[0] - 1, coarse.cells[1] - 1, ck}, [&](int ci, int cj, int) {
            CellMatrix& sum = merged_next_[n++];
            sum = {};
            for_each_place({0, 0, 0}, {merged[0], merged[1], merged[2]}, [&](int x, int y, int z) {
                const int i = (1 + merged[0]) * ci + x, j = (1 + merged[1]) * cj + y, k = (1 + merged[2]) * ck + z;
                if (i < fine.cells[0] && j < fine.cells[1] && k < fine.cells[2]) {
                    one = fine_cells[static_cast<std::size_t>(i) +
                                     static_cast<std::size_t>(fine.cells[0]) *
                                         (static_cast<std::size_t>(j) +
                                          static_cast<std::size_t>(fine.cells[1]) * static_cast<std::size_t>(k))];
                    const int half[3] = {x, y, z};
                    for (unsigned c = 0; c < 3; ++c) {
                        if (merged[c]) {
                            spread_half(one, c, half[c] == 1);
                        }
                    }
                    add(one, sum);
                }
            });
        });
    });
}

template void Multigrid<float>::merge_finest(const Potential<float>&);
template void Multigrid<float>::merge(std::span<const CellMatrix>, const PaddedGrid&, const PaddedGrid&);
template void Multigrid<double>::merge_finest(const Potential<double>&);
template void Multigrid<double>::merge(std::span<const CellMatrix>, const PaddedGrid&, const PaddedGrid&);

} // namespace hybmss
