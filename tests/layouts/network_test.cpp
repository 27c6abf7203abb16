#include "hybmss/network.hpp"
#include "reference/body.hpp"
#include "reference/volume_energy.hpp"
#include "tests/random_bodies.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace hybmss::testing {
namespace {

// Shares added in another order.
constexpr double kTolerance = 16 * std::numeric_limits<double>::epsilon();

void expect_same_body(const Network& network, const reference::Body& body, double cell_size) {
    ASSERT_EQ(network.rest_positions.size(), body.rest.size());
    ASSERT_EQ(network.masses.size(), body.mass.size());
    for (std::size_t n = 0; n < body.rest.size(); ++n) {
        const auto& x = network.rest_positions[n];
        EXPECT_LE((Vector3d(x[0], x[1], x[2]) - body.rest[n]).norm(), kTolerance * (cell_size + body.rest[n].norm()));
        EXPECT_NEAR(network.masses[n], body.mass[n], kTolerance * body.mass[n]);
    }
    ASSERT_EQ(network.springs.size(), body.springs.size());
    std::map<std::pair<int, int>, const reference::Spring*> expected;
    for (const reference::Spring& spring : body.springs) {
        expected[std::minmax(spring.a, spring.b)] = &spring;
    }
    for (const Network::Spring& spring : network.springs) {
        const auto found = expected.find(std::minmax(spring.a, spring.b));
        ASSERT_NE(found, expected.end()) << spring.a << " - " << spring.b;
        const double sign = spring.a == found->second->a ? 1 : -1;
        const Vector3d r(spring.rest_vector[0], spring.rest_vector[1], spring.rest_vector[2]);
        EXPECT_EQ(sign * r, found->second->rest_vector);
        EXPECT_NEAR(spring.stiffness, found->second->stiffness, kTolerance * spring.stiffness);
        expected.erase(found); // so that no pair comes twice
    }
    ASSERT_EQ(network.cells.size(), body.cells.size());
    for (std::size_t c = 0; c < body.cells.size(); ++c) {
        for (std::size_t corner = 0; corner < 8; ++corner) {
            EXPECT_EQ(network.cells[c].nodes[corner], body.cells[c].nodes[corner]);
        }
        EXPECT_NEAR(network.cells[c].kappa, body.cells[c].kappa, kTolerance * std::abs(body.cells[c].kappa));
    }
    if (!network.cells.empty()) {
        EXPECT_EQ(network.volume_energy, body.volume_energy);
    }
}

TEST(Network, FromLatticeIsTheReferenceAssembly) {
    unsigned seed = 100;
    for (const Material& material : materials()) {
        ++seed;
        SCOPED_TRACE("seed " + std::to_string(seed) + ", " + describe(material));
        Random random(seed);
        const int nx = 1 + static_cast<int>(random.below(4)), ny = 1 + static_cast<int>(random.below(4)),
                  nz = 1 + static_cast<int>(random.below(4));
        const Lattice lattice = random_lattice(nx, ny, nz, 0.3, random, 0.4);
        const Network network = Network::from_lattice(lattice, material);
        EXPECT_NO_THROW(validate(network));
        expect_same_body(network, reference::assemble(lattice, material), 0.3);
        const reference::Body body = reference::assemble(network);
        expect_same_body(network, body, 0.3);
        for (const reference::Cell& cell : body.cells) {
            EXPECT_LE((cell.rest_edges - 0.3 * Matrix3d::Identity()).norm(), 1e-14);
        }
    }
}

void expect_same_means(const reference::Body& body, const reference::Body& expected) {
    std::map<std::pair<int, int>, double> diagonals;
    for (const reference::Spring& s : expected.springs) {
        diagonals[std::minmax(s.a, s.b)] = s.stiffness;
    }
    ASSERT_EQ(body.springs.size(), expected.springs.size());
    for (const reference::Spring& s : body.springs) {
        EXPECT_NEAR(s.stiffness, diagonals.at(std::minmax(s.a, s.b)), kTolerance * s.stiffness);
    }
    ASSERT_EQ(body.mean_springs.size(), expected.mean_springs.size());
    for (std::size_t c = 0; c < body.mean_springs.size(); ++c) {
        const reference::MeanSprings &found = body.mean_springs[c], &cell = expected.mean_springs[c];
        EXPECT_EQ(found.nodes, cell.nodes);
        const reference::HourglassStiffness &a = found.hourglass, &b = cell.hourglass;
        for (const auto& [x, y] : {std::pair{found.cell_size, cell.cell_size},
                                   {found.stiffness[0], cell.stiffness[0]},
                                   {found.stiffness[1], cell.stiffness[1]},
                                   {a.bending, b.bending},
                                   {a.coupling, b.coupling},
                                   {a.twisting, b.twisting},
                                   {a.twist_sum, b.twist_sum},
                                   {a.fourth, b.fourth}}) {
            EXPECT_NEAR(x, y, kTolerance * std::abs(y));
        }
    }
}

TEST(Network, OfALatticeOnMeansIsCellsAlone) {
    unsigned seed = 200;
    for (const Material& m : materials()) {
        const Material material = with_springs_on(SpringForm::means, m);
        Random random(++seed);
        SCOPED_TRACE("seed " + std::to_string(seed) + ", " + describe(material));
        const Lattice lattice = random_lattice(4, 3, 2, 0.25, random, 0.4);
        const Network network = Network::from_lattice(lattice, material);
        EXPECT_NO_THROW(validate(network));
        EXPECT_TRUE(network.springs.empty());
        EXPECT_EQ(network.cells.size(), lattice.cell_count());
        const reference::Body body = reference::assemble(network), expected = reference::assemble(lattice, material);
        expect_same_means(body, expected);
        ASSERT_EQ(body.cells.size(), expected.cells.size());
        for (std::size_t c = 0; c < body.cells.size(); ++c) {
            EXPECT_NEAR(body.cells[c].kappa, expected.cells[c].kappa, kTolerance * std::abs(body.cells[c].kappa));
        }
    }
}

TEST(Network, VolumeEnergyAutomaticAndNone) {
    const Lattice lattice = Lattice::box(2, 1, 1, 1);
    EXPECT_EQ(Network::from_lattice(lattice, {1e4, 0.4}).volume_energy, VolumeEnergy::quadratic);
    EXPECT_EQ(Network::from_lattice(lattice, {1e4, 0.1}).volume_energy, VolumeEnergy::mean_stretch);
    for (const Material& m : {Material{1e4, 0.25}, Material{1e4, 0.4, 1000, 1, VolumeEnergy::none}}) {
        const Network network = Network::from_lattice(lattice, m);
        EXPECT_TRUE(network.cells.empty());
        EXPECT_TRUE(reference::assemble(network).cells.empty());
        EXPECT_TRUE(reference::assemble(lattice, m).cells.empty());
        EXPECT_NO_THROW(validate(network));
    }
}

TEST(Network, SharesAndMassesOfATwoCellRow) {
    // Scales 1 and 3: the shared face's edges carry (1 + 3) k_e/4, its diagonals (1 + 3) k_f/2; masses ignore the
    // scale.
    const Material material{1e4, 0.25, 800, 1};
    const SpringConstants k = spring_constants(material, 0.5);
    const reference::Body body = reference::assemble(Lattice::from_cells(2, 1, 1, 0.5, {1, 3}), material);
    const auto stiffness = [&](int a, int b) {
        for (const reference::Spring& s : body.springs) {
            if (s.a == a && s.b == b) {
                return s.stiffness;
            }
        }
        return -1.0;
    };
    EXPECT_DOUBLE_EQ(stiffness(0, 1), k.edge / 4);
    EXPECT_DOUBLE_EQ(stiffness(1, 2), 3 * k.edge / 4);
    EXPECT_DOUBLE_EQ(stiffness(1, 4), k.edge);               // in y, on the shared face
    EXPECT_DOUBLE_EQ(stiffness(1, 10), 2 * k.face_diagonal); // in y and z, on the shared face
    EXPECT_DOUBLE_EQ(stiffness(0, 4), k.face_diagonal / 2);
    EXPECT_DOUBLE_EQ(stiffness(0, 10), k.cube_diagonal);
    EXPECT_DOUBLE_EQ(stiffness(1, 11), 3 * k.cube_diagonal);
    const double share = 800 * 0.125 / 8;
    EXPECT_DOUBLE_EQ(body.mass[0], share);
    EXPECT_DOUBLE_EQ(body.mass[1], 2 * share);
    EXPECT_DOUBLE_EQ(body.mass[2], share);
}

TEST(Network, RefusesWhatIsOutOfRange) {
    const Network good = Network::from_lattice(Lattice::box(1, 1, 1, 1), {1e4, 0.4});
    const auto with = [&](auto change, std::initializer_list<const char*> parts) {
        Network network = good;
        change(network);
        expect_refusal([&] { validate(network); }, parts);
    };
    const double nan = std::nan("");
    with([](Network& n) { n.masses.pop_back(); }, {"7 masses", "8 nodes"});
    with([](Network& n) { n.masses[3] = 0; }, {"mass of node 3", "above 0"});
    with([&](Network& n) { n.masses[2] = nan; }, {"mass of node 2", "finite"});
    with([&](Network& n) { n.rest_positions[5][1] = nan; }, {"rest position of node 5", "finite"});
    with([](Network& n) { n.springs[4].b = 8; }, {"spring 4", "8", "[0, 8)"});
    with([](Network& n) { n.springs[4].a = -1; }, {"spring 4", "-1", "[0, 8)"});
    with([](Network& n) { n.springs[1].b = n.springs[1].a; }, {"spring 1", "differ"});
    with([](Network& n) { n.springs[2].stiffness = -1; }, {"spring 2", "stiffness", "at least 0"});
    with([&](Network& n) { n.springs[2].stiffness = nan; }, {"spring 2", "stiffness", "finite"});
    with([](Network& n) { n.springs[0].rest_vector = {0, 0, 0}; }, {"spring 0", "rest vector", "not zero"});
    with([](Network& n) { n.cells[0].nodes[7] = 9; }, {"cell 0", "9", "[0, 8)"});
    with([](Network& n) { n.cells[0].nodes[7] = n.cells[0].nodes[0]; }, {"cell 0", "twice"});
    with([](Network& n) { std::swap(n.cells[0].nodes[0], n.cells[0].nodes[7]); }, {"cell 0", "rest volume"});
    with([&](Network& n) { n.cells[0].kappa = nan; }, {"cell 0", "kappa", "finite"});
    with([](Network& n) { n.volume_energy = VolumeEnergy::automatic; }, {"volume_energy", "quadratic or mean_stretch"});
    with([](Network& n) { n.cells[0].scale = -1; }, {"cell 0", "scale", "at least 0"});
    with([](Network& n) { n.cells[0].scale = 1; }, {"cube_diagonal = 0", "above 0"});
}

TEST(Network, RefusesSpringsOnMeansOfWhatIsNoUprightCube) {
    const Material material{.poisson_ratio = 0.4, .springs = SpringForm::means};
    const Network good = Network::from_lattice(Lattice::box(1, 1, 1, 0.1), material);
    const auto with = [&](auto change, std::initializer_list<const char*> parts) {
        Network network = good;
        change(network);
        expect_refusal([&] { validate(network); }, parts);
    };
    with([](Network& n) { n.rest_positions[5][1] += 1e-6; }, {"cell 0", "cube", "along x, y and z"});
    with(
        [](Network& n) {
            for (auto& x : n.rest_positions) {
                x[2] *= 2;
            }
        },
        {"cell 0", "cube"});
    with([](Network& n) { n.cells[0].scale = std::numeric_limits<double>::infinity(); }, {"cell 0", "scale", "finite"});
    with([](Network& n) { n.means.springs.edge = -1; }, {"means: edge = -1", "at least 0"});
    with([](Network& n) { n.means.patterns.coupling = 1.5; }, {"coupling = 1.5", "-1 to 1"});
    with([](Network& n) { n.volume_energy = VolumeEnergy::none; }, {"volume_energy", "quadratic or mean_stretch"});
    Network springs_alone = good;
    springs_alone.volume_energy = VolumeEnergy::none;
    springs_alone.cells[0].kappa = 0;
    EXPECT_NO_THROW(validate(springs_alone));
    for (auto& x : springs_alone.rest_positions) {
        x[0] += 1e3; // rounds by more than an epsilon of the edge
    }
    EXPECT_NO_THROW(validate(springs_alone));
}

} // namespace
} // namespace hybmss::testing
