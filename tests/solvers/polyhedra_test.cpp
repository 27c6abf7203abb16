#include "hybmss/equilibrium.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/force_plan.hpp"
#include "hybmss/polyhedra.hpp"
#include "reference/forces.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using reference::Body;

constexpr double kEdge = 0.5;

Material material(double poisson_ratio) {
    Material made;
    made.young_modulus = 1e4;
    made.poisson_ratio = poisson_ratio;
    return made;
}

struct Lattices {
    const char* name;
    Network network;
};
std::vector<Lattices> lattices(const std::array<int, 3>& n, double poisson_ratio) {
    return {{"tetrahedra", tetrahedron_lattice(n, kEdge, material(poisson_ratio))},
            {"pyramids", pyramid_lattice(n, kEdge, material(poisson_ratio))},
            {"prisms", prism_lattice(n, kEdge, 0.9 * kEdge, material(poisson_ratio))}};
}

std::vector<Vector3d> random_field(std::size_t nodes, double size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-size, size);
    std::vector<Vector3d> field;
    for (std::size_t n = 0; n < nodes; ++n) {
        const double x = uniform(random), y = uniform(random), z = uniform(random);
        field.emplace_back(x, y, z);
    }
    return field;
}

/// Where nodes are off their lattice places too.
Network jittered(Network network) {
    const std::vector<Vector3d> by = random_field(network.masses.size(), 0.08 * kEdge, 5);
    for (std::size_t n = 0; n < by.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            network.rest_positions[n][c] += by[n][static_cast<Eigen::Index>(c)];
        }
    }
    for (Network::Spring& s : network.springs) {
        for (std::size_t c = 0; c < 3; ++c) {
            s.rest_vector[c] = network.rest_positions[static_cast<std::size_t>(s.b)][c] -
                               network.rest_positions[static_cast<std::size_t>(s.a)][c];
        }
    }
    return network;
}

std::vector<Vector3d> affine(const Network& network, const Matrix3d& gradient) {
    std::vector<Vector3d> u;
    for (const auto& x : network.rest_positions) {
        u.emplace_back(gradient * Vector3d(x[0], x[1], x[2]));
    }
    return u;
}

double volume_of(const Body& body) {
    double sum = 0;
    for (const reference::Polyhedron& polyhedron : body.polyhedra) {
        sum += polyhedron.rest_volume;
    }
    return sum;
}

TEST(Polyhedra, PyramidsFillAHexahedronWithBilinearFaces) {
    reference::Corners corners;
    const std::vector<Vector3d> off = random_field(9, 0.15, 3);
    for (std::size_t c = 0; c < 8; ++c) {
        corners[c] = Vector3d((c & 1) != 0, (c >> 1 & 1) != 0, (c >> 2) != 0) + off[c];
    }
    Network network;
    for (const Vector3d& x : corners) {
        network.rest_positions.push_back({x[0], x[1], x[2]});
    }
    network.rest_positions.push_back({0.5 + off[8][0], 0.5 + off[8][1], 0.5 + off[8][2]});
    network.masses.assign(9, 1.0);
    for (const auto& f :
         {std::array{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}) {
        network.polyhedra.push_back({CellShape::pyramid, {f[0], f[1], f[2], f[3], 8, 0}, 1});
    }
    EXPECT_NO_THROW(validate(network));
    EXPECT_NEAR(volume_of(reference::assemble(network)), reference::trilinear_volume(corners), 1e-14);
}

TEST(Polyhedra, APrismHasTheVolumeOfItsInterpolation) {
    const std::vector<Vector3d> off = random_field(6, 0.2, 4);
    const Vector3d at[6] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
    Network network;
    for (std::size_t c = 0; c < 6; ++c) {
        network.rest_positions.push_back({at[c][0] + off[c][0], at[c][1] + off[c][1], at[c][2] + off[c][2]});
    }
    network.masses.assign(6, 1.0);
    network.polyhedra = {{CellShape::prism, {0, 1, 2, 3, 4, 5}, 1}};
    // x = sum of L_i ((1 - t) x_i + t x_(i + 3)): Gauss in t, and the middles of the sides in the triangle, are exact.
    const auto x = [&](int c) { return Vector3d(at[c] + off[static_cast<std::size_t>(c)]); };
    double volume = 0;
    for (const double t : {0.5 - std::sqrt(1.0 / 12), 0.5 + std::sqrt(1.0 / 12)}) {
        const auto level = [&](int c) { return Vector3d((1 - t) * x(c) + t * x(c + 3)); };
        for (int side = 0; side < 3; ++side) {
            Matrix3d gradient;
            gradient.col(0) = level(1) - level(0);
            gradient.col(1) = level(2) - level(0);
            gradient.col(2) = 0.5 * (x(side + 3) - x(side) + x((side + 1) % 3 + 3) - x((side + 1) % 3));
            volume += gradient.determinant() / 12;
        }
    }
    EXPECT_NEAR(volume_of(reference::assemble(network)), volume, 1e-14);
}

TEST(Polyhedra, ForcesAndSecondDerivativesAreThoseOfTheEnergy) {
    for (const double poisson_ratio : {0.4, 0.1}) { // quadratic, mean stretch
        for (const bool nodal : {false, true}) {
            for (auto& [name, network] : lattices({2, 1, 2}, poisson_ratio)) {
                SCOPED_TRACE(name + std::string(nodal ? ", volumes of nodes" : ""));
                Network off = jittered(network);
                off.nodal_volumes = nodal;
                const Body body = reference::assemble(off);
                const std::vector<Vector3d> u = random_field(body.rest.size(), 0.05 * kEdge, 7),
                                            p = random_field(body.rest.size(), 1, 8);
                const auto moved = [&](double by) {
                    std::vector<Vector3d> at = u;
                    for (std::size_t n = 0; n < at.size(); ++n) {
                        at[n] += by * p[n];
                    }
                    return at;
                };
                constexpr double kStep = 1e-5 * kEdge;
                const double slope =
                    (energy(body, moved(kStep)).total() - energy(body, moved(-kStep)).total()) / (2 * kStep);
                const std::vector<Vector3d> f = forces(body, u), product = hessian_product(body, u, p),
                                            high = forces(body, moved(kStep)), low = forces(body, moved(-kStep));
                double along = 0, scale = 0, worst = 0;
                Vector3d total = Vector3d::Zero(), torque = Vector3d::Zero();
                for (std::size_t n = 0; n < f.size(); ++n) {
                    along -= f[n].dot(p[n]);
                    scale = std::max(scale, product[n].norm());
                    worst = std::max(worst, (product[n] + (high[n] - low[n]) / (2 * kStep)).norm());
                    total += f[n];
                    torque += (body.rest[n] + u[n]).cross(f[n]);
                }
                EXPECT_NEAR(slope, along, 1e-7 * std::abs(along));
                EXPECT_LT(worst, 1e-7 * scale);
                EXPECT_LT(total.norm() + torque.norm(), 1e-9);
                const auto matrix = hessian(body, u);
                const std::vector<Matrix3d> blocks = hessian_diagonal(body, u);
                for (std::size_t n = 0; n < blocks.size(); ++n) {
                    const auto at = static_cast<Eigen::Index>(3 * n);
                    EXPECT_LT((Matrix3d(matrix.block(at, at, 3, 3)) - blocks[n]).norm(), 1e-12 * blocks[n].norm());
                }
            }
        }
    }
}

TEST(Polyhedra, PlansAgreeWithTheReference) {
    for (const double poisson_ratio : {0.4, 0.1}) {
        for (const bool nodal : {false, true}) {
            for (auto& [name, network] : lattices({5, 4, 3}, poisson_ratio)) {
                Network off = jittered(network);
                off.nodal_volumes = nodal;
                const Body body = reference::assemble(off);
                const std::size_t nodes = body.rest.size();
                const std::vector<Vector3d> u = random_field(nodes, 0.03 * kEdge, 7), p = random_field(nodes, 1, 8);
                std::vector<double> given(3 * nodes), direction(3 * nodes);
                for (std::size_t i = 0; i < given.size(); ++i) {
                    given[i] = u[i / 3][static_cast<Eigen::Index>(i % 3)];
                    direction[i] = p[i / 3][static_cast<Eigen::Index>(i % 3)];
                }
                for (const char* layout : {"packed-xyzw", "coloured-soa"}) {
                    SCOPED_TRACE(std::string(name) + ", " + layout + (nodal ? ", volumes of nodes" : ""));
                    const ForcePlan<double> plan(off, {.layout = layout});
                    std::vector<double> f(3 * nodes), product(3 * nodes), blocks(6 * nodes);
                    const auto in = VectorField<const double>::aos(given.data(), nodes);
                    plan.add_forces(in, VectorField<double>::aos(f.data(), nodes));
                    plan.add_hessian_product(in, VectorField<const double>::aos(direction.data(), nodes),
                                             VectorField<double>::aos(product.data(), nodes));
                    plan.hessian_diagonal(in, blocks);
                    const auto expected = forces(body, u), of_product = hessian_product(body, u, p);
                    const auto diagonal = hessian_diagonal(body, u);
                    const auto scale = force_scale(body, u), product_scale = hessian_product_scale(body, u, p);
                    for (std::size_t i = 0; i < f.size(); ++i) {
                        const auto c = static_cast<Eigen::Index>(i % 3);
                        ASSERT_NEAR(f[i], expected[i / 3][c], 1e-14 * scale[i / 3]);
                        ASSERT_NEAR(product[i], of_product[i / 3][c], 1e-14 * product_scale[i / 3]);
                        ASSERT_NEAR(blocks[6 * (i / 3) + i % 3], diagonal[i / 3](c, c), 1e-13 * diagonal[i / 3].norm());
                        ASSERT_NEAR(blocks[6 * (i / 3) + 3 + i % 3], diagonal[i / 3](c == 2 ? 1 : 0, c == 0 ? 1 : 2),
                                    1e-13 * diagonal[i / 3].norm());
                    }
                    const double stored = energy(body, u).volume;
                    EXPECT_NEAR(plan.energy(in).volume, stored, 1e-12 * std::abs(stored));
                    // A bound, and no more than three times below.
                    const std::vector<double> none(3 * nodes);
                    const double largest =
                        plan.estimate_critical_time_step(VectorField<const double>::aos(none.data(), nodes));
                    EXPECT_LT(plan.critical_time_step(), largest);
                    EXPECT_GT(plan.critical_time_step(), largest / 3);
                }
            }
        }
    }
}

// Of cubes in number alike along all axes, or any prisms: W / V = lambda/2 (tr e)^2 + G e:e for every small strain.
TEST(Polyhedra, LatticesAreIsotropic) {
    for (const double poisson_ratio : {0.0, 0.25, 0.45}) {
        for (const bool nodal : {false, true}) {
            for (auto& [name, given] : lattices({3, 3, 3}, poisson_ratio)) {
                SCOPED_TRACE(name + std::string(nodal ? ", volumes of nodes" : ""));
                Network network = given;
                network.nodal_volumes = nodal;
                const Body body = reference::assemble(network);
                const double volume = std::string(name) == "prisms" ? 27 * std::sqrt(0.75) * 0.9 * std::pow(kEdge, 3)
                                                                    : 27 * std::pow(kEdge, 3);
                double mass = 0;
                for (const double m : body.mass) {
                    mass += m;
                }
                EXPECT_NEAR(mass, 1000 * volume, 1e-9 * mass);
                const double G = 1e4 / (2 * (1 + poisson_ratio)),
                             lambda = 2 * G * poisson_ratio / (1 - 2 * poisson_ratio);
                std::mt19937 random(11);
                std::normal_distribution<double> normal;
                for (int direction = 0; direction < 20; ++direction) {
                    const auto unit = [&] {
                        return Vector3d(normal(random), normal(random), normal(random)).normalized();
                    };
                    const Vector3d n = unit(), m = n.cross(unit()).normalized();
                    for (const bool shear : {false, true}) {
                        constexpr double kStrain = 1e-5;
                        const Matrix3d strain =
                            kStrain * (shear ? Matrix3d(0.5 * (n * m.transpose() + m * n.transpose()))
                                             : Matrix3d(n * n.transpose()));
                        const double expected =
                            volume * (lambda / 2 * std::pow(strain.trace(), 2) + G * strain.squaredNorm());
                        // Twice the second derivative along the strain: exact, where energies have a third order too.
                        const std::vector<Vector3d> none(body.rest.size(), Vector3d::Zero()),
                            u = affine(network, strain);
                        const std::vector<Vector3d> product = hessian_product(body, none, u);
                        double stored = 0;
                        for (std::size_t i = 0; i < u.size(); ++i) {
                            stored += 0.5 * u[i].dot(product[i]);
                        }
                        ASSERT_NEAR(stored, expected, 1e-10 * expected);
                    }
                }
                // In the inside, large homogeneous deformations are equilibria: the lattices are their own mirror
                // image about each of their nodes.
                const Matrix3d large = (Matrix3d() << 0.2, 0.1, 0, -0.1, 0.3, 0.2, 0.05, 0, -0.1).finished();
                const std::vector<Vector3d> u = affine(network, large), f = forces(body, u);
                const std::vector<double> scale = force_scale(body, u);
                int inside = 0;
                for (std::size_t i = 0; i < f.size(); ++i) {
                    const Vector3d x = body.rest[i];
                    bool deep = true;
                    if (std::string(name) == "prisms") {
                        const double j = x[1] / (std::sqrt(0.75) * kEdge), a = x[0] / kEdge - 0.5 * j,
                                     k = x[2] / (0.9 * kEdge);
                        for (const double at : {a, j, k}) {
                            deep = deep && at > 0.9 && at < 2.1;
                        }
                    } else {
                        for (Eigen::Index c = 0; c < 3; ++c) {
                            deep = deep && x[c] > 1.1 * kEdge && x[c] < 1.9 * kEdge;
                        }
                    }
                    if (deep) {
                        ++inside;
                        EXPECT_LT(f[i].norm(), 1e-12 * scale[i]);
                    }
                }
                EXPECT_GT(inside, 0);
            }
        }
    }
}

TEST(Polyhedra, LatticesAreStable) {
    for (const double poisson_ratio : {-0.2, 0.25, 0.45}) {
        for (const bool nodal : {false, true}) {
            for (auto& [name, given] : lattices({2, 2, 2}, poisson_ratio)) {
                SCOPED_TRACE(name + std::string(nodal ? ", volumes of nodes" : ""));
                Network network = given;
                network.nodal_volumes = nodal;
                const Body body = reference::assemble(network);
                const std::vector<Vector3d> none(body.rest.size(), Vector3d::Zero());
                const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(
                                                   Eigen::MatrixXd(hessian(body, none)), Eigen::EigenvaluesOnly)
                                                   .eigenvalues();
                const double unit = 1e4 * kEdge;
                EXPECT_LT(std::abs(values[5]), 1e-9 * unit); // rigid motions
                EXPECT_GT(values[6], 0.01 * unit);
            }
        }
    }
}

/// The force on the plate of a clamped cube of the edge `size`, pressed by 2 %.
double plate_force(const Network& network, double size) {
    EquilibriumSolver<double> solver(network);
    const std::size_t nodes = network.masses.size();
    Loading loading;
    for (std::size_t n = 0; n < nodes; ++n) {
        const double y = network.rest_positions[n][1];
        if (y < 1e-9 || y > size - 1e-9) {
            loading.supports.push_back(
                {static_cast<std::uint32_t>(n), 7, {0, y > 1e-9 ? -0.02 * size : 0.0, 0}, {0, 0, 0}});
        }
    }
    std::vector<double> u(3 * nodes), f(3 * nodes);
    const auto field = VectorField<double>::aos(u.data(), nodes);
    EquilibriumOptions options;
    options.tolerance = 1e-7;
    const EquilibriumResult result = solver.solve(loading, field, options);
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    solver.get_forces(field, VectorField<double>::aos(f.data(), nodes));
    double sum = 0;
    for (std::size_t n = 0; n < nodes; ++n) {
        sum += network.rest_positions[n][1] > size - 1e-9 ? f[3 * n + 1] : 0;
    }
    return sum;
}

TEST(Polyhedra, TetrahedraWithVolumesOfNodesDoNotLock) {
    constexpr int kCells = 5;
    const Material soft = material(0.499);
    const double cubes =
        plate_force(Network::from_lattice(Lattice::box(kCells, kCells, kCells, kEdge), soft), kCells * kEdge);
    Network tetrahedra = tetrahedron_lattice({kCells, kCells, kCells}, kEdge, soft);
    const double locked = plate_force(tetrahedra, kCells * kEdge);
    tetrahedra.nodal_volumes = true;
    const double nodal = plate_force(tetrahedra, kCells * kEdge);
    EXPECT_NEAR(nodal, cubes, 0.05 * cubes);
    EXPECT_GT(locked, 1.1 * cubes);
    std::printf("cubes %.6g N, tetrahedra %.6g, with volumes of nodes %.6g\n", cubes, locked, nodal);
}

TEST(Polyhedra, AStepIsBitIdenticalForAnyThreads) {
    for (const bool nodal : {false, true}) {
        Network network = tetrahedron_lattice({12, 11, 10}, kEdge, material(0.45));
        network.nodal_volumes = nodal;
        std::vector<std::vector<float>> ends;
        for (const char* layout : {"packed-xyzw", "coloured-soa"}) {
            for (const int threads : {1, 2, 3}) {
                ExplicitDynamics<float> body(network, {.layout = layout, .threads = threads});
                std::vector<float> u(3 * network.masses.size());
                std::mt19937 random(1);
                for (float& x : u) {
                    x = std::uniform_real_distribution<float>(-0.02f, 0.02f)(random);
                }
                const auto field = VectorField<float>::aos(u.data(), network.masses.size());
                body.set_displacements(field);
                const double before = body.potential_energy().total();
                body.step({.time_step = 0.5 * body.critical_time_step()}, 50);
                EXPECT_NEAR(body.potential_energy().total() + body.kinetic_energy(), before, 0.1 * before);
                body.get_displacements(field);
                if (threads == 1) {
                    ends.push_back(u);
                }
                EXPECT_EQ(u, ends.back()) << layout << " " << threads;
            }
        }
    }
}

TEST(Polyhedra, RefusesWhatIsNone) {
    Network network = tetrahedron_lattice({1, 1, 1}, kEdge, material(0.4));
    const Network::Polyhedron good = network.polyhedra[0];
    const auto message = [&](auto change) {
        network.polyhedra[0] = good;
        change(network.polyhedra[0]);
        try {
            validate(network);
        } catch (const std::invalid_argument& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    EXPECT_EQ(message([](auto&) {}), "accepted");
    EXPECT_EQ(message([](auto& p) { p.nodes[1] = 99; }), "polyhedron 0: node 99 is outside [0, 9)");
    EXPECT_EQ(message([](auto& p) { p.nodes[1] = p.nodes[0]; }),
              "polyhedron 0: node " + std::to_string(good.nodes[0]) + " appears twice");
    EXPECT_EQ(message([](auto& p) { std::swap(p.nodes[0], p.nodes[2]); }),
              "polyhedron 0: its rest volume is not above 0 (are its nodes in the order of Network::Polyhedron?)");
    EXPECT_EQ(message([](auto& p) { p.shape = static_cast<CellShape>(8); }),
              "polyhedron 0: its shape must be tetrahedron, pyramid or prism");
    EXPECT_EQ(message([](auto& p) { p.kappa = std::nan(""); }), "polyhedron 0: its kappa must be finite");
    EXPECT_THROW(prism_lattice({1, 1, 1}, 1, 1.3, {}), std::invalid_argument);
    EXPECT_THROW(pyramid_lattice({1, 1, 1}, 1, {.springs = SpringForm::means}), std::invalid_argument);
}

/// |C - wanted| / |wanted| around nodes, root mean square by volume, entry by entry.
double misfit(const Network& network) {
    const Body body = reference::assemble(network);
    const double G = 1e4 / 2.6;
    std::vector<double> volume(body.rest.size(), 0.0);
    for (const reference::Polyhedron& p : body.polyhedra) {
        for (const int node : p.nodes) {
            volume[static_cast<std::size_t>(node)] += p.rest_volume / static_cast<double>(p.nodes.size());
        }
    }
    double square = 0, size = 0, total = 0;
    std::vector<std::array<double, 81>> sums(body.rest.size());
    const auto entry = [](int e) { return std::array<Eigen::Index, 4>{e % 3, e / 3 % 3, e / 9 % 3, e / 27}; };
    for (const reference::Spring& s : body.springs) {
        const Vector3d n = s.rest_vector.normalized();
        for (int e = 0; e < 81; ++e) {
            const auto [i, j, k, l] = entry(e);
            const double half = s.stiffness * s.rest_vector.squaredNorm() / 2 * n[i] * n[j] * n[k] * n[l];
            sums[static_cast<std::size_t>(s.a)][static_cast<std::size_t>(e)] += half;
            sums[static_cast<std::size_t>(s.b)][static_cast<std::size_t>(e)] += half;
        }
    }
    for (std::size_t n = 0; n < sums.size(); ++n) {
        total += volume[n];
        for (int e = 0; e < 81; ++e) {
            const auto [i, j, k, l] = entry(e);
            const double wanted = G * ((i == j && k == l) + (i == k && j == l) + (i == l && j == k));
            square += volume[n] * std::pow(sums[n][static_cast<std::size_t>(e)] / volume[n] - wanted, 2);
            size += n == 0 ? wanted * wanted : 0;
        }
    }
    return std::sqrt(square / total / size);
}

TEST(Polyhedra, SpringsAreFittedToAnyMesh) {
    for (const auto& [name, given] : lattices({3, 3, 3}, 0.3)) {
        SCOPED_TRACE(name);
        const FittedCells fitted = fit_springs({given.rest_positions, given.polyhedra}, material(0.3));
        EXPECT_NEAR(fitted.misfit, misfit(fitted.network), 1e-9);
        EXPECT_LT(fitted.misfit, misfit(given)); // exact in the inside alone
        EXPECT_LT(fitted.anisotropy, 0.1);
        EXPECT_NEAR(fitted.modulus_error, 0, 0.1);
        double mass = 0, expected = 0;
        for (std::size_t n = 0; n < given.masses.size(); ++n) {
            mass += fitted.network.masses[n];
            expected += given.masses[n];
        }
        EXPECT_NEAR(mass, expected, 1e-12 * expected);
        // None lowers the misfit, up or down.
        Network changed = fitted.network;
        for (Network::Spring& s : changed.springs) {
            EXPECT_GT(s.stiffness, 0);
            for (const double by : {0.99, 1.01}) {
                const double kept = s.stiffness;
                s.stiffness *= by;
                EXPECT_GT(misfit(changed), fitted.misfit - 1e-9);
                s.stiffness = kept;
            }
        }
    }
    const Network centred = tetrahedron_lattice({4, 4, 4}, kEdge, material(0.3));
    const FittedCells near = fit_springs({centred.rest_positions, centred.polyhedra}, material(0.3));
    EXPECT_TRUE(near.network.nodal_volumes);
    // A single flat tetrahedron is far from isotropic, either way round.
    CellMesh flat{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 0.1}},
                  {{CellShape::tetrahedron, {0, 2, 1, 3, 0, 0}, 0}}};
    try {
        fit_springs(flat, material(0.3));
        FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("a mesh whose springs are far from isotropic given: anisotropy "),
                  std::string::npos)
            << error.what();
    }
    EXPECT_NO_THROW(fit_springs(flat, material(0.3), 10));
    flat.nodes.push_back({5, 5, 5});
    EXPECT_THROW(fit_springs(flat, material(0.3), 10), std::invalid_argument);
}

TEST(Polyhedra, TetrahedraAreRead) {
    const std::string path = testing::TempDir() + "polyhedra_test_mesh";
    const auto read = [&](const std::string& text) {
        std::ofstream(path) << text;
        return read_tetrahedra(path);
    };
    const std::string gmsh2 =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 0 1 0\n7 0 0 1\n"
        "8 1 1 1\n9 9 9 9\n$EndNodes\n$Elements\n3\n1 2 2 0 1 1 2 3\n2 4 2 0 1 1 2 3 7\n3 4 2 0 1 "
        "2 3 7 8\n$EndElements\n";
    const std::string gmsh4 =
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 6 1 9\n3 1 0 4\n1\n2\n3\n7\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 2 0 "
        "2\n8\n9\n1 1 1\n9 9 9\n$EndNodes\n$Elements\n2 3 1 3\n2 1 2 1\n1 1 2 3\n3 1 4 2\n2 1 2 3 7\n3 2 3 7 "
        "8\n$EndElements\n";
    const std::string vtk =
        "# vtk DataFile Version 3.0\nany title\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 6 double\n0 0 "
        "0 1 0 0 0 1 0\n0 0 1 1 1 1 9 9 9\nCELLS 3 14\n3 0 1 2\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 3\n5 "
        "10 10\n";
    for (const std::string& text : {gmsh2, gmsh4, vtk}) {
        const CellMesh mesh = read(text);
        ASSERT_EQ(mesh.cells.size(), 2u);
        ASSERT_EQ(mesh.nodes.size(), 5u); // no triangle's, no stray one
        EXPECT_EQ(mesh.cells[1].shape, CellShape::tetrahedron);
        EXPECT_EQ(mesh.nodes[static_cast<std::size_t>(mesh.cells[1].nodes[3])], (std::array<double, 3>{1, 1, 1}));
    }
    const auto message = [&](std::string text, const std::string& what, const std::string& by) {
        text.replace(text.find(what), what.size(), by);
        try {
            read(text);
        } catch (const std::invalid_argument& error) {
            return std::string(error.what()).substr(path.size());
        }
        return std::string("accepted");
    };
    EXPECT_EQ(message(gmsh2, "2.2 0", "2.2 1"), ":2: a binary file given: plain text is wanted");
    EXPECT_EQ(message(gmsh2, "2.2", "3"), ":2: \"3\" given as version: 2.2 or 4.1 is wanted");
    EXPECT_EQ(message(gmsh2, "2 3 7 8", "2 3 7 6"), ":17: a tetrahedron has the node 6, which is not there");
    EXPECT_EQ(message(gmsh2, "1 0 0\n3", "1 nan 0\n3"), ":7: \"nan\" given, a finite number wanted");
    EXPECT_EQ(message(gmsh2, "$Elements", "$Other"), ":18: no $Elements given");
    EXPECT_EQ(message(vtk, "ASCII", "BINARY"), ":3: a binary file given: plain text is wanted");
    EXPECT_EQ(message(vtk, "10 10", "5 5"), ":13: no tetrahedra given: some are wanted");
    EXPECT_EQ(message(vtk, "# vtk", "% vtk"),
              ":1: \"%\" given where a file begins: Gmsh's .msh ($MeshFormat) or VTK's legacy .vtk (# vtk) is wanted");
    std::filesystem::remove(path);
    EXPECT_THROW(read_tetrahedra(path), std::invalid_argument);
}

TEST(Polyhedra, MixedCellsAreRead) {
    const std::string path = testing::TempDir() + "polyhedra_test_mixed";
    const auto read = [&](const std::string& text) {
        std::ofstream(path) << text;
        return read_cells(path);
    };
    // A prism, a pyramid on its side x = 1 (as it were), and a tetrahedron; triangles and points beside.
    const std::string gmsh =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n7\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 0 1\n6 0 1 1\n"
        "7 2 2 0.5\n$EndNodes\n$Elements\n5\n1 15 2 0 1 1\n2 2 2 0 1 1 2 3\n3 6 2 0 1 1 2 3 4 5 6\n"
        "4 7 2 0 1 2 3 6 5 7\n5 4 2 0 1 1 3 2 7\n$EndElements\n";
    const std::string vtk = "# vtk DataFile Version 3.0\nany\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 7 double\n"
                            "0 0 0 1 0 0 0 1 0 0 0 1 1 0 1 0 1 1 2 2 0.5\nCELLS 4 22\n3 0 1 2\n6 0 1 2 3 4 5\n"
                            "5 1 2 5 4 6\n4 0 2 1 6\nCELL_TYPES 4\n5\n13\n14\n10\n";
    for (const std::string& text : {gmsh, vtk}) {
        const CellMesh mesh = read(text);
        ASSERT_EQ(mesh.cells.size(), 3u);
        ASSERT_EQ(mesh.nodes.size(), 7u);
        EXPECT_EQ(mesh.cells[0].shape, CellShape::prism);
        EXPECT_EQ(mesh.cells[1].shape, CellShape::pyramid);
        EXPECT_EQ(mesh.nodes[static_cast<std::size_t>(mesh.cells[1].nodes[4])], (std::array<double, 3>{2, 2, 0.5}));
        // Whatever the orientation in the file: a volume and a mass above zero.
        const FittedCells fitted = fit_springs(mesh, material(0.3), 10);
        double mass = 0;
        for (const double m : fitted.network.masses) {
            mass += m;
        }
        CellMesh mirrored = mesh;
        for (auto& x : mirrored.nodes) {
            x[0] = -x[0];
        }
        const FittedCells other = fit_springs(mirrored, material(0.3), 10);
        EXPECT_NEAR(other.misfit, fitted.misfit, 1e-4 * fitted.misfit);
        for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
            EXPECT_NEAR(other.network.masses[n], fitted.network.masses[n], 1e-9 * mass);
        }
        EXPECT_GT(mass, 500);
        EXPECT_EQ(read_tetrahedra(path).cells.size(), 1u);
    }
    std::string cube = vtk;
    cube.replace(cube.find("13\n14"), 2, "12");
    try {
        read(cube);
        FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what())
                      .find(":14: solid cells of type 12 given: tetrahedra, pyramids and prisms "
                            "with nodes at their corners are wanted"),
                  std::string::npos)
            << error.what();
    }
    std::filesystem::remove(path);
}

} // namespace
} // namespace hybmss
