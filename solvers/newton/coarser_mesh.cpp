#include "solvers/newton/coarser_mesh.hpp"

#include <algorithm>

namespace hybmss {
namespace {

using Place = std::array<int, 3>;

std::vector<std::int32_t> numbers(const Lattice& lattice, std::span<const std::uint32_t> nodes) {
    std::vector<std::int32_t> number(lattice.grid_node_count(), -1);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        number[nodes[n]] = static_cast<std::int32_t>(n);
    }
    return number;
}

Place place_of(std::uint32_t grid_node, const std::array<int, 3>& cells) {
    const auto row = static_cast<std::uint32_t>(cells[0] + 1), rows = static_cast<std::uint32_t>(cells[1] + 1);
    return {static_cast<int>(grid_node % row), static_cast<int>(grid_node / row % rows),
            static_cast<int>(grid_node / row / rows)};
}

Lattice merged(const Lattice& fine) {
    const auto [nx, ny, nz] = fine.cells();
    std::vector<float> scales;
    std::vector<std::uint8_t> tissues; // of most of what a cell is merged of
    scales.reserve(fine.cell_scales().size() / 8);
    tissues.reserve(scales.capacity());
    for (int k = 0; k < nz; k += 2) {
        for (int j = 0; j < ny; j += 2) {
            for (int i = 0; i < nx; i += 2) {
                float sum = 0;
                std::array<std::uint8_t, 8> of_filled{};
                std::size_t filled = 0;
                for (int corner = 0; corner < 8; ++corner) {
                    const std::size_t cell =
                        fine.cell_index(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
                    sum += fine.cell_scales()[cell];
                    if (fine.cell_scales()[cell] > 0) {
                        of_filled[filled++] = static_cast<std::uint8_t>(fine.cell_tissue(cell));
                    }
                }
                const auto count = [&](std::uint8_t tissue) {
                    return std::count(of_filled.begin(), of_filled.begin() + filled, tissue);
                };
                scales.push_back(sum / 8);
                tissues.push_back(
                    *std::max_element(of_filled.begin(), of_filled.end(),
                                      [&](std::uint8_t a, std::uint8_t b) { return count(a) < count(b); }));
            }
        }
    }
    Lattice coarse = Lattice::from_cells(nx / 2, ny / 2, nz / 2, 2 * fine.cell_size(), std::move(scales));
    if (!fine.tissues().empty()) {
        coarse.set_tissues({fine.tissues().begin(), fine.tissues().end()}, std::move(tissues));
    }
    return coarse;
}

} // namespace

bool CoarserMesh::pays(const Lattice& fine) {
    // A smaller body is solved before its coarse one is set up.
    constexpr std::size_t kFewCells = 4000;
    const auto& cells = fine.cells();
    return fine.cell_count() >= kFewCells &&
           std::all_of(cells.begin(), cells.end(), [](int n) { return n % 2 == 0 && n >= 8; });
}

CoarserMesh::CoarserMesh(const Lattice& fine)
    : fine_cells_(fine.cells()), fine_nodes_(fine.nodes()), fine_number_(numbers(fine, fine_nodes_)),
      lattice_(merged(fine)), nodes_(lattice_.nodes()), number_(numbers(lattice_, nodes_)) {}

template <class Visit>
void CoarserMesh::for_each_source(std::size_t fine_node, const Visit& visit) const {
    const Place at = place_of(fine_nodes_[fine_node], fine_cells_);
    const int between = at[0] % 2 | at[1] % 2 << 1 | at[2] % 2 << 2; // axes along which it lies between two
    const double weight = 1.0 / (1 << (at[0] % 2 + at[1] % 2 + at[2] % 2));
    for (int corner = 0; corner < 8; ++corner) {
        if ((corner & ~between) == 0) {
            const std::size_t grid = lattice_.grid_node_index(at[0] / 2 + (corner & 1), at[1] / 2 + (corner >> 1 & 1),
                                                              at[2] / 2 + (corner >> 2));
            visit(static_cast<std::size_t>(number_[grid]), weight);
        }
    }
}

Loading CoarserMesh::restricted(const Loading& loading, std::span<const double> masses) const {
    Loading coarse;
    const auto& a = loading.acceleration;
    const bool heavy = a[0] != 0 || a[1] != 0 || a[2] != 0;
    if (heavy || !loading.forces.empty()) {
        coarse.forces.assign(nodes_.size(), {0, 0, 0});
        for (std::size_t n = 0; n < fine_nodes_.size(); ++n) {
            for_each_source(n, [&](std::size_t node, double weight) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const double own = loading.forces.empty() ? 0 : loading.forces[n][c];
                    coarse.forces[node][c] += weight * (own + masses[n] * a[c]);
                }
            });
        }
    }
    // By fine nodes: a node may be named for each axis apart.
    std::vector<std::vector<const PrescribedNode*>> held(fine_nodes_.size());
    for (const PrescribedNode& support : loading.supports) {
        held[support.node].push_back(&support);
    }
    const auto [nx, ny, nz] = fine_cells_;
    const auto fine_at = [&, nx = nx, ny = ny](int i, int j, int k) {
        return fine_number_[static_cast<std::size_t>(i) +
                            static_cast<std::size_t>(nx + 1) *
                                (static_cast<std::size_t>(j) +
                                 static_cast<std::size_t>(ny + 1) * static_cast<std::size_t>(k))];
    };
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const Place at = place_of(nodes_[n], lattice_.cells());
        std::array<double, 3> sum{};
        std::array<int, 3> count{};
        const auto add = [&](std::int32_t fine_node) {
            for (const PrescribedNode* support : held[static_cast<std::size_t>(fine_node)]) {
                for (std::size_t c = 0; c < 3; ++c) {
                    if (support->axes >> c & 1) {
                        sum[c] += support->displacement[c];
                        ++count[c];
                    }
                }
            }
        };
        if (const std::int32_t same = fine_at(2 * at[0], 2 * at[1], 2 * at[2]); same >= 0) {
            add(same);
        } else {
            for (int around = 0; around < 27; ++around) {
                const int i = 2 * at[0] + around % 3 - 1, j = 2 * at[1] + around / 3 % 3 - 1,
                          k = 2 * at[2] + around / 9 - 1;
                if (i < 0 || j < 0 || k < 0 || i > nx || j > ny || k > nz) {
                    continue;
                }
                if (const std::int32_t near = fine_at(i, j, k); near >= 0) {
                    add(near);
                }
            }
        }
        PrescribedNode support{static_cast<std::uint32_t>(n), 0};
        for (std::size_t c = 0; c < 3; ++c) {
            if (count[c] > 0) {
                support.axes = static_cast<std::uint8_t>(support.axes | 1u << c);
                support.displacement[c] = sum[c] / count[c];
            }
        }
        if (support.axes != 0) {
            coarse.supports.push_back(support);
        }
    }
    return coarse;
}

std::vector<double> CoarserMesh::injected(std::span<const double> fine) const {
    std::vector<double> coarse(3 * nodes_.size(), 0.0);
    for (std::size_t n = 0; n < fine_nodes_.size(); ++n) {
        const Place at = place_of(fine_nodes_[n], fine_cells_);
        if (at[0] % 2 == 0 && at[1] % 2 == 0 && at[2] % 2 == 0) {
            const std::size_t grid = lattice_.grid_node_index(at[0] / 2, at[1] / 2, at[2] / 2);
            std::copy_n(fine.data() + 3 * n, 3, coarse.data() + 3 * static_cast<std::size_t>(number_[grid]));
        }
    }
    return coarse;
}

std::vector<double> CoarserMesh::interpolated(std::span<const double> coarse) const {
    std::vector<double> fine(3 * fine_nodes_.size(), 0.0);
    for (std::size_t n = 0; n < fine_nodes_.size(); ++n) {
        for_each_source(n, [&](std::size_t node, double weight) {
            for (std::size_t c = 0; c < 3; ++c) {
                fine[3 * n + c] += weight * coarse[3 * node + c];
            }
        });
    }
    return fine;
}

} // namespace hybmss
