// The layout flat-rows: what a sweep reads of each plane, shared or not.

#include "layouts/lattice/lattice_arrays.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <set>

namespace hybmss {
namespace {

std::size_t planes_held(const LatticeArrays<double>& layout) {
    EXPECT_EQ(layout.stiffness_begin.size(), layout.planes);
    return std::set(layout.stiffness_begin.begin(), layout.stiffness_begin.end()).size();
}

/// Every plane has, where its stiffness is said to begin, what the cells around its nodes give.
void expect_stiffness_of(const Lattice& lattice, const Material& material, const LatticeArrays<double>& layout) {
    const CellShares shares(lattice, material, layout.axes);
    const auto rows = static_cast<std::size_t>(lattice.cells()[layout.axes[1]]) + 1;
    for (std::size_t k = 0; k < layout.planes; ++k) {
        for (std::size_t j = 0; j < rows; ++j) {
            for (std::size_t i = 0; i < layout.row; ++i) {
                const CellShares::Node node = shares.at({i, j, k});
                const std::size_t n = j * layout.row + i;
                for (std::size_t kind = 0; kind < 7; ++kind) {
                    ASSERT_EQ(layout.stiffness[kind][layout.stiffness_begin[k] + n], node.stiffness[kind])
                        << "node " << i << ' ' << j << ' ' << k << ", kind " << kind;
                }
                ASSERT_EQ(layout.inverse_mass[layout.begin[k] + n],
                          node.cells > 0 ? shares.inverse_mass(node.cells) : 0);
            }
        }
    }
}

LatticeArrays<double> plain_rows(const Lattice& lattice) {
    return flat_rows<double>(lattice, Material{}, plain_axes(lattice));
}

TEST(FlatRowsLayout, ABoxHoldsThreePlanesOfStiffness) {
    const Material material;
    for (const std::array<int, 3>& cells : {std::array{5, 4, 6}, {4, 4, 24}, {3, 9, 2}, {1, 1, 1}, {2, 1, 2}}) {
        const Lattice lattice = Lattice::box(cells[0], cells[1], cells[2], 0.5);
        for (const LatticeAxes& axes : axes_by_cost(lattice, false)) {
            LatticeArrays<double> layout = flat_rows<double>(lattice, material, axes);
            EXPECT_EQ(planes_held(layout), std::min<std::size_t>(layout.planes, 3));
            expect_stiffness_of(lattice, material, layout);
            layout.separate_planes();
            EXPECT_EQ(planes_held(layout), layout.planes);
            expect_stiffness_of(lattice, material, layout);
        }
    }
}

/// The body's nodes, x fastest, are where the axes put them; one run holds each row of a box along x at most.
TEST(FlatRowsLayout, NodesLieAlongAnyAxes) {
    Lattice lattice = Lattice::box(3, 4, 5, 0.5);
    for (const bool full : {true, false}) {
        for (const LatticeAxes& axes : axes_by_cost(lattice, false)) {
            const LatticeArrays<double> layout = flat_rows<double>(lattice, Material{}, axes);
            EXPECT_EQ(layout.axes, axes);
            EXPECT_LE(layout.runs.size(), full ? 30u : 60u) << word_of(axes);
            const std::vector<std::uint32_t> nodes = lattice.nodes();
            ASSERT_EQ(layout.masses.size(), nodes.size());
            for (std::size_t n = 0; n < nodes.size(); ++n) {
                const std::size_t place[3] = {nodes[n] % 4, nodes[n] / 4 % 5, nodes[n] / 20};
                EXPECT_EQ(index_in(layout.runs, n),
                          place[axes[0]] + place[axes[1]] * layout.row + place[axes[2]] * layout.plane)
                    << word_of(axes) << " " << n;
            }
        }
        for (const int x : {0, 1}) { // a corner without nodes, and one in the middle
            lattice.set_cell_scale(x, 0, 0, 0);
        }
    }
}

TEST(FlatRowsLayout, RowsLieAlongWhatIsLong) {
    const auto best = [](int x, int y, int z) { return axes_by_cost(Lattice::box(x, y, z, 1.0), true).front(); };
    for (const std::array<int, 3>& bar : {std::array{24, 4, 4}, {4, 24, 4}, {4, 4, 24}, {10, 10, 60}, {1, 1, 500}}) {
        const auto longest = static_cast<std::size_t>(std::max_element(bar.begin(), bar.end()) - bar.begin());
        EXPECT_EQ(best(bar[0], bar[1], bar[2])[0], longest) << bar[0] << "x" << bar[1] << "x" << bar[2];
    }
    // Little is to be gained, and rows along x are a caller's.
    EXPECT_EQ(best(20, 20, 20), (LatticeAxes{0, 1, 2}));
    EXPECT_EQ(best(64, 64, 64), (LatticeAxes{0, 1, 2}));
    // A plate has layers to share only along its edges.
    EXPECT_GE(Lattice::box(3, 40, 40, 1.0).cells()[best(3, 40, 40)[2]], 8);
    EXPECT_EQ(best(40, 40, 3), (LatticeAxes{0, 2, 1}));
    EXPECT_EQ(best(96, 96, 8), (LatticeAxes{0, 2, 1}));
    EXPECT_EQ(best(96, 96, 16), (LatticeAxes{0, 1, 2}));
    EXPECT_EQ(axes_by_cost(Lattice::box(3, 40, 40, 1.0), false).size(), 6u);
    EXPECT_LT(axes_by_cost(Lattice::box(3, 40, 40, 1.0), true).size(), 6u);
}

TEST(FlatRowsLayout, PlanesWithOtherCellsBesideThemHaveTheirOwn) {
    Lattice lattice = Lattice::box(6, 8, 7, 0.5);
    ASSERT_EQ(plain_rows(lattice).axes[2], 2u);
    lattice.set_cell_scale(3, 5, 4, 2.0f); // beside the planes 4 and 5
    const LatticeArrays<double> layout = plain_rows(lattice);
    EXPECT_EQ(planes_held(layout), 6u); // 0, 1 to 3, 4, 5, 6, 7
    expect_stiffness_of(lattice, Material{}, layout);
}

TEST(FlatRowsLayout, SharedPlanesTakeTheirMemoryOnce) {
    const Lattice lattice = Lattice::box(8, 8, 40, 0.5);
    LatticeArrays<double> layout = plain_rows(lattice);
    const std::size_t shared = layout.bytes();
    layout.separate_planes();
    EXPECT_GE(layout.bytes() - shared, 7 * (layout.planes - 3) * layout.plane * sizeof(double));
}

/// Gives memory so many times, then no more.
struct ShortMemory {
    int left;
    static void* allocate(std::size_t bytes, std::size_t alignment, void* user) {
        return static_cast<ShortMemory*>(user)->left-- > 0 ? std::aligned_alloc(alignment, padded_to(bytes, alignment))
                                                           : nullptr;
    }
    static void release(void* memory, std::size_t, std::size_t, void*) { std::free(memory); }
    static std::size_t padded_to(std::size_t bytes, std::size_t unit) { return (bytes + unit - 1) / unit * unit; }
};

TEST(FlatRowsLayout, PlanesStayTogetherWhereMemoryDoesNotSuffice) {
    const Lattice lattice = Lattice::box(4, 5, 9, 0.5);
    LatticeArrays<double> layout = plain_rows(lattice);
    for (int allocations = 0; allocations < 7; ++allocations) {
        ShortMemory memory{allocations};
        set_allocator({&ShortMemory::allocate, &ShortMemory::release, &memory});
        EXPECT_THROW(layout.separate_planes(), std::bad_alloc);
        set_allocator({});
        EXPECT_EQ(planes_held(layout), 3u);
        expect_stiffness_of(lattice, Material{}, layout);
    }
    layout.separate_planes();
    EXPECT_EQ(planes_held(layout), layout.planes);
    expect_stiffness_of(lattice, Material{}, layout);
}

} // namespace
} // namespace hybmss
