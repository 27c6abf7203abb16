#include "hybmss/skin.hpp"

#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <vector>

namespace hybmss {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::vector<std::array<double, 3>>;

constexpr double kSize = 0.2;

Lattice full_of_holes(unsigned seed, double filled) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> draw(0, 1);
    std::vector<float> scales(6 * 5 * 7);
    for (float& scale : scales) {
        scale = draw(engine) < filled ? 1.0f : 0.0f;
    }
    scales[17] = 1;
    return Lattice::from_cells(6, 5, 7, kSize, scales);
}

/// Vertices in and around the grid, with a triangle for each three.
TriangleMesh random_mesh(std::size_t vertices, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> draw(-0.3, 1.7);
    TriangleMesh mesh;
    for (std::size_t n = 0; n < vertices; ++n) {
        mesh.vertices.push_back({draw(engine), draw(engine), draw(engine)});
    }
    for (std::uint32_t n = 0; n + 2 < vertices; n += 3) {
        mesh.triangles.push_back({n, n + 1, n + 2});
    }
    return mesh;
}

Vector3d vector(const std::array<double, 3>& v) {
    return {v[0], v[1], v[2]};
}

/// One vector a node, from its rest position.
template <class Displacement>
std::vector<double> at_nodes(const Lattice& lattice, const Displacement& displacement) {
    std::vector<double> u;
    for (const std::uint32_t node : lattice.nodes()) {
        const Vector3d at = displacement(vector(lattice.rest_position(node)));
        u.insert(u.end(), at.data(), at.data() + 3);
    }
    return u;
}

struct Moved {
    std::vector<double> positions, normals;
    Vector3d position(std::size_t n) const { return Eigen::Map<const Vector3d>(positions.data() + 3 * n); }
    Vector3d normal(std::size_t n) const { return Eigen::Map<const Vector3d>(normals.data() + 3 * n); }
};

Moved moved(const Skin<double>& skin, const std::vector<double>& u) {
    Moved result{std::vector<double>(3 * skin.vertex_count(), -7), std::vector<double>(3 * skin.vertex_count(), -7)};
    skin.update(VectorField<const double>::aos(u.data(), skin.node_count()),
                VectorField<double>::aos(result.positions.data(), skin.vertex_count()),
                VectorField<double>::aos(result.normals.data(), skin.vertex_count()));
    return result;
}

/// Of a mesh of triangles apart.
void expect_affine(const Moved& now, const TriangleMesh& mesh, const Matrix3d& f, const Vector3d& shift) {
    const Matrix3d cofactor = f.determinant() * f.inverse().transpose();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vector3d a = vector(mesh.vertices[3 * t]), b = vector(mesh.vertices[3 * t + 1]),
                       c = vector(mesh.vertices[3 * t + 2]);
        const Vector3d normal = (cofactor * (b - a).cross(c - a)).normalized();
        for (std::size_t n = 3 * t; n < 3 * t + 3; ++n) {
            EXPECT_LT((now.position(n) - f * vector(mesh.vertices[n]) - shift).norm(), 1e-14 * 10) << n;
            EXPECT_LT((now.normal(n) - normal).norm(), 1e-12) << n;
        }
    }
}

TEST(Skin, FollowsAffineMotionsExactlyInAndBesideTheBody) {
    const Lattice lattice = full_of_holes(2, 0.4);
    const TriangleMesh mesh = random_mesh(300, 3);
    Matrix3d f;
    f << 1.2, 0.3, -0.1, 0.05, 0.8, 0.2, -0.3, 0.1, 1.1;
    const Vector3d shift(0.5, -2, 3);
    const std::vector<double> u =
        at_nodes(lattice, [&](const Vector3d& x) { return Vector3d((f - Matrix3d::Identity()) * x + shift); });
    for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(name(set));
        PlanOptions options;
        options.instruction_set = set;
        expect_affine(moved(Skin<double>(lattice, mesh, options), u), mesh, f, shift);
    }
}

TEST(Skin, IsTheSameForAllInstructionSetsToRounding) {
    // Cells of no, some and very many vertices, in them and beside.
    const Lattice lattice = full_of_holes(5, 0.5);
    const TriangleMesh mesh = random_mesh(3000, 8);
    const std::vector<double> u =
        at_nodes(lattice, [](const Vector3d& x) { return Vector3d(0.1 * x[1] * x[2], std::sin(x[0]), x[2] * x[0]); });
    std::vector<float> floats(u.begin(), u.end());
    PlanOptions options;
    options.instruction_set = InstructionSet::sse2;
    const Moved first = moved(Skin<double>(lattice, mesh, options), u);
    for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(name(set));
        options.instruction_set = set;
        const Moved now = moved(Skin<double>(lattice, mesh, options), u);
        const Skin<float> skin(lattice, mesh, options);
        std::vector<float> x(9000), n(9000);
        skin.update(VectorField<const float>::aos(floats.data(), skin.node_count()),
                    VectorField<float>::aos(x.data(), 3000), VectorField<float>::aos(n.data(), 3000));
        for (std::size_t i = 0; i < 9000; ++i) {
            ASSERT_NEAR(now.positions[i], first.positions[i], 1e-13) << i;
            ASSERT_NEAR(now.normals[i], first.normals[i], 1e-13) << i;
            ASSERT_NEAR(static_cast<double>(x[i]), first.positions[i], 2e-5) << i; // far beside cells
            ASSERT_NEAR(static_cast<double>(n[i]), first.normals[i], 1e-5) << i;
        }
    }
}
TEST(Skin, InterpolatesTrilinearlyInsideItsCell) {
    const Lattice lattice = Lattice::box(3, 2, 2, kSize);
    // A field that is trilinear all over the box.
    const auto field = [](const Vector3d& x) {
        return Vector3d(x[0] * x[1] * x[2], x[0] * x[1] - x[2], x[1] * x[2] + 2 * x[0] * x[2] + 1);
    };
    TriangleMesh mesh;
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> draw(0, 0.4);
    for (int n = 0; n < 100; ++n) {
        mesh.vertices.push_back({1.5 * draw(engine), draw(engine), draw(engine)});
    }
    const Skin<double> skin(lattice, mesh);
    const std::vector<double> u = at_nodes(lattice, field);
    std::vector<double> positions(300);
    skin.update(VectorField<const double>::aos(u.data(), skin.node_count()),
                VectorField<double>::aos(positions.data(), 100));
    for (std::size_t n = 0; n < 100; ++n) {
        const Vector3d x = vector(mesh.vertices[n]);
        EXPECT_LT((Eigen::Map<const Vector3d>(positions.data() + 3 * n) - x - field(x)).norm(), 1e-14) << n;
    }
}

TEST(Skin, GoesOnLinearlyBesideTheBody) {
    const Lattice lattice = Lattice::box(1, 1, 1, kSize);
    const auto field = [](const Vector3d& x) {
        return Vector3d(5 * x[0] * x[1] * x[2], x[0] * x[1] - x[2] * x[0], 7 * x[1] * x[2] * x[0] + 2 * x[1] * x[2]);
    };
    TriangleMesh mesh;
    std::mt19937 engine(4);
    std::uniform_real_distribution<double> draw(-0.2, 0.4);
    for (int n = 0; n < 50; ++n) {
        mesh.vertices.push_back({draw(engine), draw(engine), draw(engine)});
    }
    const Moved now = moved(Skin<double>(lattice, mesh), at_nodes(lattice, field));
    for (std::size_t n = 0; n < 50; ++n) {
        const Vector3d x = vector(mesh.vertices[n]), nearest = x.cwiseMax(0).cwiseMin(kSize), away = x - nearest;
        constexpr double kStep = 1e-4; // the field is linear along each axis
        Vector3d expected = x + field(nearest);
        for (Eigen::Index a = 0; a < 3; ++a) {
            const Vector3d step = kStep * Vector3d::Unit(a);
            expected += away[a] / kStep * (field(nearest + step) - field(nearest));
        }
        EXPECT_LT((now.position(n) - expected).norm(), 1e-11) << n;
    }
}

TEST(Skin, NormalsTurnAsSmallTrianglesOnTheDeformedSurfaceDo) {
    const Lattice lattice = Lattice::box(2, 2, 2, kSize);
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> draw(-0.05, 0.05);
    std::vector<double> u(3 * 27);
    for (double& x : u) {
        x = draw(engine);
    }
    TriangleMesh mesh;
    for (const Vector3d& middle : {Vector3d(0.07, 0.13, 0.31), Vector3d(0.33, 0.05, 0.09), Vector3d(0.01, 0.39, 0.1)}) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vector3d& d : {Vector3d(1, 0, 0), Vector3d(-0.5, 0.8, 0.1), Vector3d(-0.5, -0.8, -0.1)}) {
            const Vector3d x = middle + 1e-5 * d;
            mesh.vertices.push_back({x[0], x[1], x[2]});
        }
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    const Moved now = moved(Skin<double>(lattice, mesh), u);
    for (std::size_t n = 0; n < 9; n += 3) {
        const Vector3d a = now.position(n), b = now.position(n + 1), c = now.position(n + 2);
        const Vector3d normal = (b - a).cross(c - a).normalized();
        EXPECT_LT((now.normal(n) - normal).norm(), 1e-3) << n;
    }
}

TEST(Skin, BesideTheBodyMovesWithTheNearestCell) {
    for (const double filled : {0.02, 0.1, 0.5}) {
        const Lattice lattice = full_of_holes(7, filled);
        const TriangleMesh mesh = random_mesh(60, 11);
        const Skin<double> skin(lattice, mesh);
        const std::vector<std::uint32_t> nodes = lattice.nodes();
        for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
            const Vector3d x = vector(mesh.vertices[n]);
            std::vector<std::pair<double, std::array<int, 3>>> cells;
            for (int k = 0; k < 7; ++k) {
                for (int j = 0; j < 5; ++j) {
                    for (int i = 0; i < 6; ++i) {
                        if (lattice.cell_scale(i, j, k) > 0) {
                            const Vector3d low = kSize * Vector3d(i, j, k);
                            cells.emplace_back((x - x.cwiseMax(low).cwiseMin(low + Vector3d::Constant(kSize))).norm(),
                                               std::array<int, 3>{i, j, k});
                        }
                    }
                }
            }
            std::sort(cells.begin(), cells.end());
            if (cells.size() > 1 && cells[1].first - cells[0].first < 1e-9) {
                continue; // as near as another
            }
            std::vector<double> u(3 * nodes.size(), 0.0);
            const auto& [i, j, k] = cells[0].second;
            for (int c = 0; c < 8; ++c) {
                const std::size_t node = lattice.grid_node_index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                const auto number = std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin();
                u[static_cast<std::size_t>(3 * number)] = 1;
            }
            EXPECT_LT((moved(skin, u).position(n) - x - Vector3d(1, 0, 0)).norm(), 1e-12) << n << " of " << filled;
        }
    }
}

TEST(Skin, TheBoundaryIsClosedTurnsOutwardsAndEnclosesTheCells) {
    for (const double filled : {0.1, 0.5, 1.0}) {
        const Lattice lattice = full_of_holes(4, filled);
        const TriangleMesh mesh = boundary_mesh(lattice);
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        double volume = 0;
        for (const auto& [a, b, c] : mesh.triangles) {
            ++edges[{a, b}];
            ++edges[{b, c}];
            ++edges[{c, a}];
            volume += vector(mesh.vertices[a]).cross(vector(mesh.vertices[b])).dot(vector(mesh.vertices[c])) / 6;
        }
        for (const auto& [edge, count] : edges) {
            EXPECT_EQ(count, edges.at({edge.second, edge.first}));
        }
        EXPECT_NEAR(volume, static_cast<double>(lattice.cell_count()) * std::pow(kSize, 3), 1e-12);

        // Its vertices are nodes.
        const Moved now = moved(Skin<double>(lattice, mesh), at_nodes(lattice, [](const Vector3d& x) {
                                    return Vector3d(std::sin(3 * x[0]), x[1] * x[2], std::cos(x[2] - x[0]));
                                }));
        for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
            const Vector3d x = vector(mesh.vertices[n]);
            const Vector3d u(std::sin(3 * x[0]), x[1] * x[2], std::cos(x[2] - x[0]));
            EXPECT_LT((now.position(n) - x - u).norm(), 1e-13);
        }
    }
    EXPECT_EQ(boundary_mesh(Lattice::box(3, 3, 3, 1)).vertices.size(), 56u);
    EXPECT_EQ(boundary_mesh(Lattice::box(3, 3, 3, 1)).triangles.size(), 108u);
}

/// The volume that closed triangles enclose.
double enclosed(const TriangleMesh& mesh) {
    double volume = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        volume += vector(mesh.vertices[a]).cross(vector(mesh.vertices[b])).dot(vector(mesh.vertices[c])) / 6;
    }
    return volume;
}

/// Cells of a ball of radius `cells` about the middle of a grid, with the fills that a surface would give them: what is
/// inside, less what is shared with the cells further in.
Lattice ball(int cells, bool fractions) {
    const int n = 2 * cells + 4;
    const auto at = [n](int i, int j, int k) { return static_cast<std::size_t>((k * n + j) * n + i); };
    std::vector<float> scales(at(0, 0, n), 0.0f);
    std::vector<double> volume(scales.size()), fill(scales.size());
    constexpr int kSamples = 8;
    for (int k = 0; k < n; ++k) {
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) {
                Vector3d first = Vector3d::Zero();
                int count = 0;
                for (int s = 0; s < kSamples * kSamples * kSamples; ++s) {
                    const Vector3d in((s % kSamples + 0.5) / kSamples, (s / kSamples % kSamples + 0.5) / kSamples,
                                      (s / kSamples / kSamples + 0.5) / kSamples);
                    if ((Vector3d(i, j, k) + in - Vector3d::Constant(0.5 * n)).norm() < cells) {
                        ++count;
                        first += in - Vector3d::Constant(0.5);
                    }
                }
                if (count == 0 || (!fractions && 2 * count < kSamples * kSamples * kSamples)) {
                    continue;
                }
                scales[at(i, j, k)] = 1;
                // Shared linearly along each axis, as the centre of mass lies between the centres.
                const double t = count / std::pow(kSamples, 3);
                const Vector3d off = first / count;
                for (int c = 0; c < 8; ++c) {
                    double part = t;
                    std::array<int, 3> to = {i, j, k};
                    for (Eigen::Index a = 0; a < 3; ++a) {
                        const bool next = (c >> a & 1) != 0;
                        part *= next ? std::abs(off[a]) : 1 - std::abs(off[a]);
                        to[static_cast<std::size_t>(a)] += next ? (off[a] > 0 ? 1 : -1) : 0;
                    }
                    fill[at(to[0], to[1], to[2])] += part;
                }
            }
        }
    }
    Lattice lattice = Lattice::from_cells(n, n, n, kSize, scales);
    if (fractions) {
        std::vector<float> fills(fill.begin(), fill.end());
        for (std::size_t c = 0; c < fills.size(); ++c) {
            fills[c] = scales[c] > 0 ? std::max(fills[c], 1e-3f) : 1.0f;
        }
        lattice.set_fills(fills);
    }
    return lattice;
}

TEST(SmoothBoundary, LiesOnTheSurfaceThatTheFillsAreOf) {
    for (const int cells : {6, 12}) {
        for (const bool fractions : {false, true}) {
            SCOPED_TRACE(std::to_string(cells) + (fractions ? " fractions" : " whole cells"));
            const Lattice lattice = ball(cells, fractions);
            const TriangleMesh mesh = smooth_boundary_mesh(lattice), steps = boundary_mesh(lattice);
            const Vector3d middle = Vector3d::Constant(0.5 * kSize * lattice.cells()[0]);
            double greatest = 0, squares = 0;
            for (const auto& x : mesh.vertices) {
                const double off = (vector(x) - middle).norm() / kSize - cells;
                greatest = std::max(greatest, std::abs(off));
                squares += off * off;
            }
            const double mean = std::sqrt(squares / static_cast<double>(mesh.vertices.size()));
            EXPECT_LT(greatest, fractions ? 0.12 : 0.4);
            EXPECT_LT(mean, fractions ? 0.06 : 0.14) << greatest;
            const double volume = 4 * std::numbers::pi / 3 * std::pow(cells * kSize, 3);
            // Vertices lie in the middle of points of the surface, and so a little inside: by the square of a cell.
            EXPECT_NEAR(enclosed(mesh), volume, (fractions ? 1.6 / (cells * cells) : 0.05) * volume);
            std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
            for (const auto& [a, b, c] : mesh.triangles) {
                ++edges[{a, b}];
                ++edges[{b, c}];
                ++edges[{c, a}];
            }
            for (const auto& [edge, count] : edges) {
                EXPECT_EQ(count, edges.at({edge.second, edge.first}));
            }
            if (!fractions) {
                EXPECT_EQ(mesh.triangles, steps.triangles);
            }
        }
    }
}

TEST(SmoothBoundary, IsExactForAPlaneAcrossAnAxis) {
    for (const double part : {0.1, 0.4, 0.6, 0.9}) {
        Lattice lattice = Lattice::box(7, 7, 4, kSize);
        std::vector<float> fills(7 * 7 * 4, 1.0f);
        for (std::size_t c = 0; c < 49; ++c) { // the highest layer is filled by a part, from below
            fills[3 * 49 + c] = static_cast<float>(part * (1 + part) / 2);
            fills[2 * 49 + c] = static_cast<float>(1 + part * (1 - part) / 2);
        }
        lattice.set_fills(fills);
        int across = 0;
        for (const auto& x : smooth_boundary_mesh(lattice).vertices) {
            const bool middle = std::abs(x[0] / kSize - 3.5) < 2 && std::abs(x[1] / kSize - 3.5) < 2;
            if (middle && x[2] > kSize) {
                ++across;
                EXPECT_NEAR(x[2], kSize * (3 + part), 1e-6) << part;
            }
        }
        EXPECT_EQ(across, 16) << part;
    }
    const Lattice one = Lattice::box(1, 1, 1, kSize); // what is there stays near its nodes
    EXPECT_EQ(smooth_boundary_mesh(one).vertices.size(), 8u);
    EXPECT_GT(enclosed(smooth_boundary_mesh(one)), 0.005 * std::pow(kSize, 3));
}

TEST(Skin, IsTheSameForAnyThreadsAndCloseInFloat) {
    const Lattice lattice = full_of_holes(3, 0.6);
    const TriangleMesh mesh = random_mesh(9000, 2);
    const std::vector<double> u =
        at_nodes(lattice, [](const Vector3d& x) { return Vector3d(0.1 * x[1] * x[1], 0.1 * x[0], std::sin(x[2])); });
    PlanOptions one, three;
    one.threads = 1;
    three.threads = 3;
    const Moved a = moved(Skin<double>(lattice, mesh, one), u), b = moved(Skin<double>(lattice, mesh, three), u);
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.normals, b.normals);
    const std::vector<float> floats(u.begin(), u.end());
    const Skin<float> skin(lattice, mesh);
    std::vector<float> x(9000), y(9000), z(9000), normals(4 * 9000);
    skin.update(VectorField<const float>::aos(floats.data(), skin.node_count()),
                VectorField<float>::soa(x.data(), y.data(), z.data(), 9000),
                VectorField<float>::aos(normals.data(), 9000, 4));
    for (std::size_t n = 0; n < 9000; ++n) {
        EXPECT_NEAR(static_cast<double>(y[n]), a.positions[3 * n + 1], 1e-5);
        EXPECT_NEAR(static_cast<double>(normals[4 * n + 2]), a.normals[3 * n + 2], 1e-4);
    }
}

TEST(Skin, LosesTheTrianglesOfCellsThatAreCutAway) {
    Lattice lattice = Lattice::box(4, 1, 1, kSize);
    const TriangleMesh mesh = {{{0.05, 0.05, 0.2}, {0.1, 0.1, 0.2}, {0.05, 0.1, 0.2}, {0.75, 0.1, 0.2}},
                               {{0, 1, 2}, {1, 3, 2}, {3, 0, 1}, {0, 1, 3}}};
    const Skin<double> skin(lattice, mesh);
    EXPECT_EQ(skin.triangles_left(lattice), mesh.triangles);
    lattice.remove_cells(std::vector<std::array<int, 3>>{{3, 0, 0}});
    EXPECT_EQ(skin.triangles_left(lattice), (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}}));
}

TEST(Skin, RefusesWhatDoesNotFit) {
    const Lattice lattice = Lattice::box(2, 1, 1, kSize);
    const TriangleMesh mesh = boundary_mesh(lattice);
    const Skin<double> skin(lattice, mesh);
    std::vector<double> u(36), x(36), n(36);
    const auto in = VectorField<const double>::aos(u.data(), 12);
    const auto out = VectorField<double>::aos(x.data(), 12), normals = VectorField<double>::aos(n.data(), 12);
    skin.update(in, out, normals);
    testing::expect_refusal([&] { skin.update(VectorField<const double>::aos(u.data(), 11), out); },
                            {"vector field of 11 nodes given: the body has 12"});
    testing::expect_refusal([&] { skin.update(in, VectorField<double>::aos(x.data(), 10)); },
                            {"vector field of 10 vertices given: the skin has 12"});
    testing::expect_refusal([&] { skin.update(in, out, VectorField<double>::aos(n.data(), 3)); }, {"3 vertices"});
    testing::expect_refusal([&] { skin.update(in, VectorField<double>::aos(u.data(), 12)); }, {"other memory"});
    std::vector<double> wide(200); // y of the first vertex is x of the last
    testing::expect_refusal(
        [&] {
            skin.update(in, {wide.data(), &wide[33], &wide[100], 3, 12});
        },
        {"x, y and z must be different memory"});
    testing::expect_refusal([&] { skin.update(in, out, out); }, {"other memory"});
    testing::expect_refusal(
        [&] {
            Skin<double>(lattice, {{{0, 0, 0}}, {{0, 0, 1}}});
        },
        {"triangle 0 names vertex 1: there are 1"});
    testing::expect_refusal(
        [&] {
            Skin<double>(lattice, {{{0, 0, std::numeric_limits<double>::quiet_NaN()}}, {}});
        },
        {"a coordinate of vertex 0 = nan is not allowed: it must be at most 1e9 m in size"});
    testing::expect_refusal([&] { Skin<double>(lattice, {{{0, -1e300, 0}}, {}}); }, {"vertex 0 = -1e+300"});
    Skin<double>(lattice, {{{0, -1e9, 1e9}}, {}});
    testing::expect_refusal([&] { Skin<double>(Lattice::from_cells(1, 1, 1, 1, {0.0f}), mesh); },
                            {"at least one cell"});
}

} // namespace
} // namespace hybmss
