// Bodies cut along faces: whole ones as networks know them, parts as if each had been built alone, and a slit cell by
// cell.

#include "hybmss/separation.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/random_bodies.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hybmss::testing {
namespace {

using reference::Vector3d;
using Faces = std::vector<std::array<std::uint32_t, 2>>;

constexpr double kEdge = 0.3;

std::uint32_t cell(const Lattice& lattice, int i, int j, int k) {
    return static_cast<std::uint32_t>(lattice.cell_index(i, j, k));
}

/// The faces across x between the cells i and i + 1, those with j < `depth`.
Faces across_x(const Lattice& lattice, int i, int depth) {
    Faces faces;
    for (int k = 0; k < lattice.cells()[2]; ++k) {
        for (int j = 0; j < depth; ++j) {
            faces.push_back({cell(lattice, i, j, k), cell(lattice, i + 1, j, k)});
        }
    }
    return faces;
}

/// What every cell as a body of its own does to its nodes, added up.
std::vector<Vector3d> by_cells(const Lattice& lattice, const Material& material, const Network& network,
                               const std::vector<Vector3d>& u) {
    std::vector<Vector3d> forces(u.size(), Vector3d::Zero());
    for (const Network::Cell& each : network.cells) {
        const Vector3d low(network.rest_positions[static_cast<std::size_t>(each.nodes[0])].data());
        const auto at = (low / kEdge).array().round().cast<int>().eval();
        Lattice alone = Lattice::box(1, 1, 1, kEdge);
        alone.set_cell_scale(0, 0, 0, lattice.cell_scale(at[0], at[1], at[2]));
        std::vector<Vector3d> own;
        for (const std::int32_t node : each.nodes) {
            own.push_back(u[static_cast<std::size_t>(node)]);
        }
        const std::vector<Vector3d> f = reference::forces(reference::assemble(alone, material), own);
        for (std::size_t c = 0; c < 8; ++c) {
            forces[static_cast<std::size_t>(each.nodes[c])] += f[c];
        }
    }
    return forces;
}

/// The largest of |a - b|, and of |a|.
double largest_difference(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
    double largest = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        largest = std::max(largest, (a[n] - b[n]).norm());
    }
    return largest;
}
double largest(const std::vector<Vector3d>& a) {
    return largest_difference(a, std::vector<Vector3d>(a.size(), Vector3d::Zero()));
}

double mass_of(const Network& network) {
    return std::accumulate(network.masses.begin(), network.masses.end(), 0.0);
}

TEST(Separation, WithoutFacesIsTheNetworkOfTheLattice) {
    Lattice lattice = Lattice::box(3, 2, 4, kEdge);
    lattice.set_cell_scale(1, 1, 1, 0);
    lattice.set_cell_scale(2, 0, 3, 2.5F);
    for (const SpringForm form : {SpringForm::nodes, SpringForm::means}) {
        const Material material = with_springs_on(form, {1e4, 0.3, 1000, 1});
        const Network whole = Network::from_lattice(lattice, material);
        const SeparatedNetwork same = separate(lattice, material, {});
        ASSERT_EQ(same.network.rest_positions, whole.rest_positions);
        EXPECT_EQ(same.network.springs.size(), whole.springs.size());
        for (std::size_t n = 0; n < whole.masses.size(); ++n) {
            EXPECT_NEAR(same.network.masses[n], whole.masses[n], 1e-15 * whole.masses[n]);
            EXPECT_EQ(same.lattice_nodes[n], n);
        }
        for (const Network::Spring& spring : whole.springs) {
            const auto found = std::find_if(same.network.springs.begin(), same.network.springs.end(),
                                            [&](const Network::Spring& other) {
                                                return std::minmax(other.a, other.b) == std::minmax(spring.a, spring.b);
                                            });
            ASSERT_NE(found, same.network.springs.end());
            EXPECT_NEAR(found->stiffness, spring.stiffness, 1e-14 * spring.stiffness);
        }
        EXPECT_NO_THROW(validate(same.network));
    }
}

TEST(Separation, ForcesAreThoseOfTheCellsAndMassIsKept) {
    Random random(4);
    Lattice lattice = Lattice::box(4, 3, 3, kEdge);
    lattice.set_cell_scale(3, 1, 1, 0);
    lattice.set_cell_scale(0, 0, 0, 2);
    for (const SpringForm form : {SpringForm::nodes, SpringForm::means}) {
        const Material material = with_springs_on(form, {1e4, 0.3, 1000, 1});
        const double whole = mass_of(Network::from_lattice(lattice, material));
        for (const int depth : {0, 2, 3}) {
            const SeparatedNetwork cut = separate(lattice, material, across_x(lattice, 1, depth));
            // A slit opens 4 nodes a row but the rim's; a cut through, all of them.
            const std::size_t opened = depth == 3 ? 16 : static_cast<std::size_t>(4 * depth);
            EXPECT_EQ(cut.network.rest_positions.size(), lattice.nodes().size() + opened);
            EXPECT_NEAR(mass_of(cut.network), whole, 1e-14 * whole);
            const std::vector<Vector3d> u = random_displacement(cut.network.rest_positions.size(), 0.1 * kEdge, random);
            const std::vector<Vector3d> found = reference::forces(reference::assemble(cut.network), u),
                                        expected = by_cells(lattice, material, cut.network, u);
            EXPECT_LE(largest_difference(found, expected), 1e-12 * largest(expected)) << depth;
        }
    }
}

/// Cut through, both sides are what boxes of their sizes are.
TEST(Separation, PartsAreBodiesBuiltAlone) {
    Random random(5);
    const Material material{1e4, 0.3, 1000, 1};
    const Lattice lattice = Lattice::box(5, 2, 3, kEdge);
    const SeparatedNetwork cut = separate(lattice, material, across_x(lattice, 1, 2));
    const std::vector<Vector3d> u = random_displacement(cut.network.rest_positions.size(), 0.1 * kEdge, random);
    const std::vector<Vector3d> forces = reference::forces(reference::assemble(cut.network), u);
    // Which side a node is on, by the cells that have it.
    std::vector<int> side(u.size(), -1);
    for (const Network::Cell& each : cut.network.cells) {
        const double low = cut.network.rest_positions[static_cast<std::size_t>(each.nodes[0])][0];
        for (const std::int32_t node : each.nodes) {
            int& own = side[static_cast<std::size_t>(node)];
            EXPECT_NE(own, low < 2 * kEdge - 1e-9 ? 1 : 0);
            own = low < 2 * kEdge - 1e-9 ? 0 : 1;
        }
    }
    for (const int which : {0, 1}) {
        const Lattice alone = Lattice::box(which == 0 ? 2 : 3, 2, 3, kEdge);
        std::vector<Vector3d> own, f;
        for (std::size_t n = 0; n < u.size(); ++n) {
            if (side[n] == which) {
                own.push_back(u[n]);
                f.push_back(forces[n]);
            }
        }
        ASSERT_EQ(own.size(), alone.nodes().size());
        const reference::Body body = reference::assemble(alone, material);
        EXPECT_LE(largest_difference(f, reference::forces(body, own)), 1e-12 * largest(f));
    }
}

TEST(Separation, RefusesCellsThatShareNoFace) {
    Lattice lattice = Lattice::box(3, 2, 2, kEdge);
    lattice.set_cell_scale(2, 0, 0, 0);
    const auto refused = [&](std::uint32_t a, std::uint32_t b) {
        expect_refusal([&] { separate(lattice, {}, Faces{{a, b}}); }, {"share no face"});
    };
    refused(0, 0);
    refused(0, 4);
    refused(2, 3); // the end of a row and the beginning of the next
    refused(1, 2); // which is not there
    refused(0, 100);
    EXPECT_NO_THROW(separate(lattice, {}, Faces{{1, 0}}));
}

} // namespace
} // namespace hybmss::testing
