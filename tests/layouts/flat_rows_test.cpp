// The layout flat-rows: what a sweep reads of each plane, shared or not.

#include "layouts/lattice/lattice_arrays.hpp"

#include <gtest/gtest.h>

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

TEST(FlatRowsLayout, ABoxHoldsThreePlanesOfStiffness) {
    const Material material;
    for (const std::array<int, 3>& cells : {std::array{5, 4, 6}, {4, 4, 24}, {3, 9, 2}, {1, 1, 1}, {2, 1, 2}}) {
        const Lattice lattice = Lattice::box(cells[0], cells[1], cells[2], 0.5);
        LatticeArrays<double> layout = flat_rows<double>(lattice, material);
        EXPECT_EQ(planes_held(layout), std::min<std::size_t>(layout.planes, 3));
        expect_stiffness_of(lattice, material, layout);
        layout.separate_planes();
        EXPECT_EQ(planes_held(layout), layout.planes);
        expect_stiffness_of(lattice, material, layout);
    }
}

TEST(FlatRowsLayout, PlanesWithOtherCellsBesideThemHaveTheirOwn) {
    Lattice lattice = Lattice::box(6, 8, 7, 0.5);
    ASSERT_EQ(flat_rows<double>(lattice, Material{}).axes[2], 2u);
    lattice.set_cell_scale(3, 5, 4, 2.0f); // beside the planes 4 and 5
    const LatticeArrays<double> layout = flat_rows<double>(lattice, Material{});
    EXPECT_EQ(planes_held(layout), 6u); // 0, 1 to 3, 4, 5, 6, 7
    expect_stiffness_of(lattice, Material{}, layout);
}

TEST(FlatRowsLayout, SharedPlanesTakeTheirMemoryOnce) {
    const Lattice lattice = Lattice::box(8, 8, 40, 0.5);
    LatticeArrays<double> layout = flat_rows<double>(lattice, Material{});
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
    LatticeArrays<double> layout = flat_rows<double>(lattice, Material{});
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
