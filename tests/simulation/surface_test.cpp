/// Bodies from closed surfaces: STL and OBJ, shells within shells, rays through edges and vertices, and open ones.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/geometry/triangle_surface.hpp"
#include "simulation/run/boundary_conditions.hpp"
#include "simulation/scene/scene_body.hpp"
#include "tests/program.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>
#include <sstream>

namespace hybmss {
namespace {

using Vertex = std::array<double, 3>;

void append(TriangleSurface& surface, const TriangleSurface& more) {
    const auto first = static_cast<std::uint32_t>(surface.vertices.size());
    surface.vertices.insert(surface.vertices.end(), more.vertices.begin(), more.vertices.end());
    for (const auto& t : more.triangles) {
        surface.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
}

TriangleSurface turned(TriangleSurface surface) {
    for (auto& t : surface.triangles) {
        std::swap(t[0], t[1]);
    }
    return surface;
}

/// An octahedron with its faces quartered again and again, blown up to a sphere; outer sides outwards.
TriangleSurface sphere(double radius, const Vertex& center = {0, 0, 0}, int levels = 5) {
    std::vector<std::array<Vertex, 3>> faces;
    for (int octant = 0; octant < 8; ++octant) {
        const Vertex x = {octant & 1 ? 1.0 : -1.0, 0, 0}, y = {0, octant & 2 ? 1.0 : -1.0, 0},
                     z = {0, 0, octant & 4 ? 1.0 : -1.0};
        const bool even =
            std::array{false, true, true, false, true, false, false, true}[static_cast<std::size_t>(octant)];
        faces.push_back(even ? std::array{x, y, z} : std::array{y, x, z});
    }
    const auto middle = [](const Vertex& a, const Vertex& b) {
        const Vertex m = {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
        const double length = std::hypot(m[0], m[1], m[2]);
        return Vertex{m[0] / length, m[1] / length, m[2] / length};
    };
    for (; levels > 0; --levels) {
        std::vector<std::array<Vertex, 3>> finer;
        for (const auto& [a, b, c] : faces) {
            const Vertex ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            for (const auto& face :
                 {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}, std::array{ab, bc, ca}}) {
                finer.push_back(face);
            }
        }
        faces = std::move(finer);
    }
    TriangleSurface surface;
    for (const auto& face : faces) {
        const auto n = static_cast<std::uint32_t>(surface.vertices.size());
        surface.triangles.push_back({n, n + 1, n + 2});
        for (const Vertex& v : face) {
            surface.vertices.push_back(
                {center[0] + radius * v[0], center[1] + radius * v[1], center[2] + radius * v[2]});
        }
    }
    return surface;
}

/// The faces of a box as pairs of triangles: diagonals pass through cell centres.
TriangleSurface box(const Vertex& low, const Vertex& high) {
    TriangleSurface surface;
    for (int corner = 0; corner < 8; ++corner) {
        surface.vertices.push_back(
            {corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1], corner & 4 ? high[2] : low[2]});
    }
    constexpr std::uint32_t kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& [a, b, c, d] : kFaces) {
        surface.triangles.push_back({a, b, c});
        surface.triangles.push_back({a, c, d});
    }
    return surface;
}

SceneBody voxels(TriangleSurface surface, double cell_size) {
    weld(surface);
    return voxelised(surface, require_closed(surface), cell_size);
}

double volume(const SceneBody& body) {
    const auto filled =
        body.labels.size() - static_cast<std::size_t>(std::count(body.labels.begin(), body.labels.end(), 0));
    return static_cast<double>(filled) * std::pow(body.cell_size, 3);
}

double ball(double radius) {
    return 4 * std::numbers::pi / 3 * radius * radius * radius;
}

TEST(Surface, sphere_has_its_volume) {
    const SceneBody body = voxels(sphere(1), 0.05);
    EXPECT_EQ(body.cells, (std::array<std::int64_t, 3>{40, 40, 40}));
    EXPECT_NEAR(volume(body), ball(1), 0.01 * ball(1));
    // Each cell for itself, but where its centre lies between the facets and the sphere: the facets of 1/20 leave
    // it by less than a thousandth.
    for (std::size_t cell = 0; cell < body.labels.size(); ++cell) {
        const auto at = [&](std::size_t c) { return (static_cast<double>(c) + 0.5) * 0.05 - 1; };
        const double r = std::hypot(at(cell % 40), at(cell / 40 % 40), at(cell / 1600));
        if (std::abs(r - 0.998) > 0.003) {
            EXPECT_EQ(body.labels[cell], r < 1) << cell;
        }
    }
}

/// Rays through edges, diagonals and vertices: nothing slips through, nothing counts twice.
TEST(Surface, box_is_filled_exactly) {
    for (const int n : {1, 2, 4, 7, 10}) {
        const SceneBody body = voxels(box({0.1, -3, 2}, {1.1, -2, 4}), 1.0 / n);
        EXPECT_EQ(body.cells, (std::array<std::int64_t, 3>{n, n, 2 * n}));
        EXPECT_EQ(std::count(body.labels.begin(), body.labels.end(), 1), 2 * n * n * n) << n;
        EXPECT_NEAR(body.origin[0], 0.1, 1e-12);
        EXPECT_NEAR(body.origin[1], -3, 1e-12);
        EXPECT_NEAR(body.origin[2], 2, 1e-12);
    }
    // An octahedron on a grid through all its vertices and edges: |x| + |y| + |z| < 3 around the middle cell.
    const SceneBody octahedron = voxels(sphere(3.5, {0, 0, 0}, 0), 1);
    ASSERT_EQ(octahedron.cells[0], 7);
    for (std::size_t cell = 0; cell < octahedron.labels.size(); ++cell) {
        const auto far = [](std::size_t c) { return std::abs(static_cast<int>(c) - 3); };
        EXPECT_EQ(octahedron.labels[cell], far(cell % 7) + far(cell / 7 % 7) + far(cell / 49) < 3.5) << cell;
    }
}

TEST(Surface, shells_within_shells_and_mixed_orientation) {
    TriangleSurface hollow = sphere(1);
    append(hollow, turned(sphere(0.6)));
    EXPECT_NEAR(volume(voxels(hollow, 0.05)), ball(1) - ball(0.6), 0.01 * ball(1));
    TriangleSurface overlapping = sphere(1);
    append(overlapping, sphere(0.6, {0.9, 0, 0}));
    const double both = volume(voxels(overlapping, 0.05));
    EXPECT_GT(both, 1.01 * ball(1));
    EXPECT_LT(both, ball(1) + 0.9 * ball(0.6));
    TriangleSurface mixed = sphere(1);
    for (std::size_t t = 0; t < mixed.triangles.size(); t += 3) {
        std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
    }
    EXPECT_EQ(voxels(mixed, 0.05).labels, voxels(sphere(1), 0.05).labels);
    EXPECT_EQ(voxels(turned(sphere(1)), 0.05).labels, voxels(sphere(1), 0.05).labels);
}

// -- fill = "fraction"

SceneBody filled_body(TriangleSurface surface, double cell_size) {
    weld(surface);
    return filled(surface, require_closed(surface), cell_size);
}

/// Turned about two axes, and moved.
TriangleSurface askew(TriangleSurface surface, const Vertex& by) {
    for (Vertex& v : surface.vertices) {
        const auto [x, y, z] = v;
        const double c = std::cos(0.5), s = std::sin(0.5), p = c * x - s * y, q = s * x + c * y;
        v = {by[0] + p, by[1] + c * q - s * z, by[2] + s * q + c * z};
    }
    return surface;
}

/// Volume, centre of mass and mean square of the distance from it of what cells hold by their fills: those of the
/// surface's inside, wherever it runs. The last tells whether cut cells kept their own centres of mass: by their
/// volumes alone it would be larger by half a cell's square.
void expect_moments(const char* what, const TriangleSurface& surface, const Vertex& center, double square,
                    double cell_size) {
    const SceneBody body = filled_body(surface, cell_size);
    double sum = 0;
    Vertex moment{};
    double squares = 0;
    std::size_t cut = 0;
    for (std::size_t cell = 0; cell < body.fills.size(); ++cell) {
        const double fill = static_cast<double>(body.fills[cell]);
        EXPECT_EQ(fill > 0, body.labels[cell] == 1) << what;
        EXPECT_LT(fill, 2) << what;
        cut += fill > 0 && fill < 0.99;
        sum += fill;
        const auto nx = static_cast<std::size_t>(body.cells[0]), ny = static_cast<std::size_t>(body.cells[1]);
        const std::size_t place[3] = {cell % nx, cell / nx % ny, cell / nx / ny};
        for (std::size_t a = 0; a < 3; ++a) {
            const double x = body.origin[a] + (static_cast<double>(place[a]) + 0.5) * cell_size;
            moment[a] += fill * x;
            squares += fill * ((x - center[a]) * (x - center[a]) + cell_size * cell_size / 12);
        }
    }
    EXPECT_NEAR(squares / sum, square, 0.2 * cell_size * cell_size) << what;
    const double volume = enclosed_volume(surface);
    EXPECT_NEAR(sum * std::pow(cell_size, 3), volume, 1e-6 * volume) << what;
    EXPECT_GT(cut, 20u) << what;
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(moment[a] / sum, center[a], 2e-3 * cell_size) << what; // slivers keep no moment
    }
}

TEST(Filled, volume_and_centre_of_mass_are_those_of_the_inside) {
    const TriangleSurface block = box({-1, -0.6, -0.8}, {1, 0.6, 0.8});
    EXPECT_NEAR(enclosed_volume(block), 2 * 1.2 * 1.6, 1e-12);
    for (const double cell_size : {0.31, 0.1}) {
        expect_moments("ball", sphere(1, {3, 0.2, -0.07}), {3, 0.2, -0.07}, 0.6, cell_size);
        expect_moments("box between cells", box({0, 0, 0}, {2.05, 1.44, 1.66}), {1.025, 0.72, 0.83},
                       (2.05 * 2.05 + 1.44 * 1.44 + 1.66 * 1.66) / 12, cell_size);
        expect_moments("box askew", askew(block, {0.03, 5, -2}), {0.03, 5, -2}, (4 + 1.44 + 2.56) / 12, cell_size);
    }
    // Turned inside out, hollow, and with shells that overlap.
    EXPECT_EQ(filled_body(turned(sphere(1)), 0.1).fills, filled_body(sphere(1), 0.1).fills);
    const auto volume_of = [](const TriangleSurface& surface) {
        const SceneBody body = filled_body(surface, 0.1);
        return std::accumulate(body.fills.begin(), body.fills.end(), 0.0) * 1e-3;
    };
    TriangleSurface hollow = sphere(1);
    append(hollow, turned(sphere(0.6)));
    EXPECT_NEAR(volume_of(hollow), enclosed_volume(hollow), 1e-6);
    TriangleSurface doubled = sphere(1);
    append(doubled, box({-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}));
    EXPECT_NEAR(volume_of(doubled), enclosed_volume(sphere(1)), 1e-6);
}

/// Along the grid's planes there is nothing to cut: the very body that centres give.
TEST(Filled, box_along_cells_is_whole) {
    for (const int n : {1, 2, 7}) {
        TriangleSurface block = box({0.1, -3, 2}, {1.1, -2, 4});
        for (Vertex& v : block.vertices) {
            for (double& x : v) {
                x = static_cast<double>(static_cast<float>(x)); // as STL holds it
            }
        }
        const SceneBody whole = voxels(block, 1.0 / n), body = filled_body(block, 1.0 / n);
        EXPECT_EQ(body.labels, whole.labels);
        EXPECT_EQ(body.cells, whole.cells);
        EXPECT_EQ(body.origin, whole.origin);
        EXPECT_EQ(std::count(body.fills.begin(), body.fills.end(), 1.0f), 2 * n * n * n);
    }
}

std::string ascii_stl(const TriangleSurface& surface) {
    std::ostringstream text;
    text.precision(9);
    text << "solid made by hand\n";
    for (const auto& t : surface.triangles) {
        text << "facet normal 0 0 0\nouter loop\n";
        for (const std::uint32_t v : t) {
            text << "vertex " << surface.vertices[v][0] << " " << surface.vertices[v][1] << " "
                 << surface.vertices[v][2] << "\n";
        }
        text << "endloop\nendfacet\n";
    }
    return text.str() + "endsolid\n";
}

std::string ply(const TriangleSurface& surface) {
    std::ostringstream text;
    text << "ply\nformat ascii 1.0\nelement vertex " << surface.vertices.size()
         << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << surface.triangles.size()
         << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto& x : surface.vertices) {
        text << x[0] << ' ' << x[1] << ' ' << x[2] << '\n';
    }
    for (const auto& t : surface.triangles) {
        text << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
    }
    return text.str();
}

/// glTF in one binary file; its one node is placed by `place`.
std::string glb(const TriangleSurface& surface, const char* place) {
    const auto append = [](std::string& to, const auto& value) {
        to.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    std::string bytes;
    std::array<double, 3> least = surface.vertices.front(), most = least;
    for (const auto& x : surface.vertices) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            append(bytes, static_cast<float>(x[axis]));
            least[axis] = std::min(least[axis], x[axis]);
            most[axis] = std::max(most[axis], x[axis]);
        }
    }
    const std::size_t of_vertices = bytes.size(), corners = 3 * surface.triangles.size();
    for (const auto& t : surface.triangles) {
        for (const std::uint32_t corner : t) {
            append(bytes, corner);
        }
    }
    std::ostringstream text;
    text
        << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{)" << place
        << R"("mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":)"
        << bytes.size() << R"(}],"bufferViews":[{"buffer":0,"byteLength":)" << of_vertices
        << R"(},{"buffer":0,"byteOffset":)" << of_vertices << R"(,"byteLength":)" << 4 * corners
        << R"(}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" << surface.vertices.size()
        << R"(,"min":[)" << least[0] << ',' << least[1] << ',' << least[2] << R"(],"max":[)" << most[0] << ','
        << most[1] << ',' << most[2] << R"(]},{"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" << corners
        << "}]}";
    std::string json = text.str();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string file = "glTF";
    append(file, std::uint32_t{2});
    append(file, static_cast<std::uint32_t>(28 + json.size() + bytes.size()));
    append(file, static_cast<std::uint32_t>(json.size()));
    file += "JSON";
    file += json;
    append(file, static_cast<std::uint32_t>(bytes.size()));
    file.append("BIN\0", 4);
    return file + bytes;
}

std::string binary_stl(const TriangleSurface& surface) {
    std::string bytes(80, 'x');
    const auto add = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
    add(static_cast<std::uint32_t>(surface.triangles.size()));
    for (const auto& t : surface.triangles) {
        bytes.append(12, '\0'); // the normal
        for (const std::uint32_t v : t) {
            for (const double x : surface.vertices[v]) {
                add(static_cast<float>(x));
            }
        }
        bytes.append(2, '\0');
    }
    return bytes;
}

std::string obj(const TriangleSurface& surface) {
    std::ostringstream text;
    text.precision(9);
    for (const auto& v : surface.vertices) {
        text << "v " << v[0] << " " << v[1] << " " << v[2] << "\n";
    }
    for (const auto& t : surface.triangles) {
        text << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
    }
    return text.str();
}

std::string scene_text(const std::string& file, const std::string& cell_size, const std::string& where) {
    return "[body]\nsurface = \"" + file + "\"\ncell_size = " + cell_size +
           "\n[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n[[fix]]\nwhere = " + where +
           "\n[solver]\nmethod = \"static\"\n[gravity]\nacceleration = [0, -1, 0]\n"
           "[[probe]]\nname = \"foot\"\nwhere = " +
           where + "\n";
}

class SurfaceFile : public testing::Test {
protected:
    void SetUp() override {
        test::write_text(directory.path() / "probe.stl", ascii_stl(box({0, 0, 0}, {1, 1, 1})));
        try {
            read_surface(directory.path() / "probe.stl");
        } catch (const std::runtime_error& error) {
            if (std::strstr(error.what(), "without assimp")) {
                GTEST_SKIP() << error.what();
            }
        }
    }
    std::string error_of(const std::string& file, const std::string& bytes, const std::string& cell_size = "0.1") {
        test::write_text(directory.path() / file, bytes);
        const std::string path = directory.path() / "s.toml";
        try {
            const Simulation simulation(parse_scene(scene_text(file, cell_size, "\"y-min\""), path));
            return "";
        } catch (const SceneError& error) {
            const std::string message = error.what();
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            const std::string start = path + ":2:11: body.surface = \"" + file + "\": ";
            EXPECT_EQ(message.rfind(start, 0), 0u) << message;
            return message.substr(std::min(start.size(), message.size()));
        }
    }
    test::TemporaryDirectory directory;
};

TEST_F(SurfaceFile, every_format_gives_the_same_cells) {
    const std::vector<std::uint8_t> expected = voxels(sphere(1, {3, 0, 0}), 0.1).labels;
    const std::pair<const char*, std::string> files[] = {{"a.stl", ascii_stl(sphere(1, {3, 0, 0}))},
                                                         {"b.STL", binary_stl(sphere(1, {3, 0, 0}))},
                                                         {"c.obj", obj(sphere(1, {3, 0, 0}))},
                                                         {"d.ply", ply(sphere(1, {3, 0, 0}))},
                                                         {"e.glb", glb(sphere(1, {3, 0, 0}), "")},
                                                         {"moved.glb", glb(sphere(1), "\"translation\":[3,0,0],")},
                                                         {"quads.obj",
                                                          "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
                                                          "v 1 0 1\nv 1 1 1\nv 0 1 1\nf 4 3 2 1\nf 5 6 7 8\n"
                                                          "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"}};
    for (const auto& [file, bytes] : files) {
        test::write_text(directory.path() / file, bytes);
        const TriangleSurface surface = read_surface(directory.path() / file);
        const SceneBody body = voxels(surface, 0.1);
        if (std::string(file) == "moved.glb") { // where its node puts it, not about the origin
            for (const Vertex& x : surface.vertices) {
                EXPECT_TRUE(x[0] >= 1.999 && x[0] <= 4.001) << x[0];
            }
        }
        if (body.labels.size() == 1000) {
            EXPECT_EQ(std::count(body.labels.begin(), body.labels.end(), 1), 1000) << file;
        } else {
            EXPECT_EQ(body.labels, expected) << file;
        }
    }
}

/// Regions are in the surface's own coordinates, and the support carries the weight.
TEST_F(SurfaceFile, scene_stands_where_the_surface_is) {
    test::write_text(directory.path() / "b.stl", binary_stl(box({5, 5, 5}, {6, 7, 6})));
    const std::string path = directory.path() / "s.toml";
    Simulation simulation(parse_scene(scene_text("b.stl", "0.25", "{box = [[5, 5, 5], [6, 5, 6]]}"), path));
    EXPECT_EQ(simulation.lattice().cell_count(), 4u * 8 * 4);
    const Summary summary = simulation.run();
    ASSERT_TRUE(summary.converged) << summary.failure;
    EXPECT_NEAR(summary.probes.at(0).force[1], 2000, 1e-3);
}

TEST_F(SurfaceFile, what_is_no_closed_surface_is_told) {
    TriangleSurface open = box({0, 0, 0}, {1, 1, 1});
    open.triangles.pop_back();
    EXPECT_EQ(
        error_of("open.stl", binary_stl(open)).rfind("it is not closed: 3 of its edges belong to an odd number", 0),
        0u);
    EXPECT_EQ(error_of("none.obj", "v 0 0 0\nv 1 0 0\n").rfind("it ", 0), 0u);
    EXPECT_EQ(error_of("text.stl", "no surface at all").rfind("it ", 0), 0u);
    EXPECT_EQ(error_of("cut.stl", binary_stl(sphere(1)).substr(0, 5000)).rfind("it ", 0), 0u);
    EXPECT_EQ(error_of("empty.stl", "").rfind("it ", 0), 0u);
    EXPECT_EQ(error_of("a.vtk", "").rfind("its name must end in .stl, .obj, .ply, .gltf or .glb", 0), 0u);
    for (const char* file : {"empty.ply", "empty.glb", "empty.gltf"}) {
        EXPECT_EQ(error_of(file, "").rfind("it cannot be read: ", 0), 0u) << file;
    }
    EXPECT_EQ(error_of("cut.glb", glb(sphere(1), "").substr(0, 3000)).rfind("it cannot be read: ", 0), 0u);
    EXPECT_NE(error_of("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "");
    EXPECT_EQ(error_of("fine.stl", binary_stl(sphere(1)), "1e-6").rfind("its grid is 2000000 x 2000000 x 2000000", 0),
              0u);
    EXPECT_EQ(error_of("turned.stl", binary_stl(turned(sphere(1, {0, 0, 0}, 0))), "0.5"), "");
    EXPECT_EQ(error_of("small.stl", binary_stl(box({0, 0, 0}, {1, 1, 1})), "1"), "");
    EXPECT_EQ(error_of("far_too_small.stl", binary_stl(box({0, 0, 0}, {1, 2, 1})), "1e6")
                  .rfind("it is 2 m across, less than one cell: cell_size must be at most that", 0),
              0u);
    EXPECT_NE(error_of("small.obj", obj(box({0, 0, 0}, {1, 1, 0})), "0.5").find("the body is empty"),
              std::string::npos);
}

/// A bar whose sides cut cells, pulled along: stiffness, mass and stress are those of the bar.
TEST_F(SurfaceFile, cut_bar_has_its_own_stiffness_mass_and_stress) {
    constexpr double kWidth = 0.45, kDepth = 0.375, kLength = 1, kStrain = 1e-6;
    test::write_text(directory.path() / "bar.stl", binary_stl(box({0, 0, 0}, {kWidth, kLength, kDepth})));
    for (const char* springs : {"nodes", "means"}) {
        const std::string text =
            "[body]\nsurface = \"bar.stl\"\ncell_size = 0.1\nfill = \"fraction\"\n"
            "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\nsprings = \"" +
            std::string(springs) +
            "\"\n[[fix]]\nwhere = \"y-min\"\naxes = \"y\"\n[[fix]]\nwhere = {node = 0}\naxes = \"xz\"\n"
            "[[fix]]\nwhere = {node = 4}\naxes = \"z\"\n"
            "[[move]]\nwhere = \"y-max\"\ntranslate = [0, 1e-6, 0]\naxes = \"y\"\n"
            "[solver]\nmethod = \"static\"\ntolerance = 1e-10\n[output]\nstress = true\n"
            "[[probe]]\nname = \"plate\"\nwhere = \"y-max\"\n";
        Simulation simulation(parse_scene(text, directory.path() / "s.toml"));
        const std::span<const double> masses = simulation.masses();
        EXPECT_NEAR(std::accumulate(masses.begin(), masses.end(), 0.0), 1000 * kWidth * kDepth * kLength, 1e-4);
        const Summary summary = simulation.run();
        ASSERT_TRUE(summary.converged) << summary.failure;
        EXPECT_NEAR(summary.probes.at(0).force[1], 1e4 * kWidth * kDepth * kStrain,
                    1e-5 * 1e4 * kWidth * kDepth * kStrain)
            << springs;
        for (const CellStress& stress : simulation.cell_stresses()) {
            EXPECT_NEAR(stress.cauchy[1], 1e4 * kStrain, 1e-4 * 1e4 * kStrain) << springs;
        }
        EXPECT_NEAR(summary.stress.value().mean_cauchy[1], 1e4 * kStrain, 1e-4 * 1e4 * kStrain) << springs;
    }
}

/// Parts of cells inside a second surface: also where it reaches out of the grid.
TEST(Filled, parts_inside_another_surface_are_exact) {
    TriangleSurface outer = box({0, 0, 0}, {1, 0.8, 0.6});
    const SceneBody grid = filled_body(outer, 0.1);
    const auto sum = [&](TriangleSurface inner) {
        weld(inner);
        const std::vector<float> parts = parts_inside(inner, require_closed(inner), grid);
        EXPECT_EQ(parts.size(), grid.labels.size());
        return std::accumulate(parts.begin(), parts.end(), 0.0) * 1e-3;
    };
    const TriangleSurface tumour = sphere(0.22, {0.45, 0.37, 0.31});
    TriangleSurface welded = tumour;
    weld(welded);
    EXPECT_NEAR(sum(tumour), enclosed_volume(welded), 1e-6);
    EXPECT_NEAR(sum(turned(tumour)), enclosed_volume(welded), 1e-6);
    // Halves and eighths of a ball about the grid's faces and corners are inside.
    for (const Vertex& centre : {Vertex{0.5, 0.4, 0}, {0.5, 0.4, 0.6}, {0, 0.4, 0.3}, {1, 0.4, 0.3}, {0.5, 0.8, 0.3}}) {
        EXPECT_NEAR(sum(sphere(0.22, centre)), enclosed_volume(welded) / 2, 1e-5) << centre[0] << " " << centre[2];
    }
    EXPECT_NEAR(sum(sphere(0.22, {1, 0.8, 0.6})), enclosed_volume(welded) / 8, 1e-5);
    EXPECT_NEAR(sum(box({-1, -1, -1}, {2, 2, 2})), 0.48, 1e-6);
    EXPECT_EQ(sum(box({0.2, 0.2, 1}, {0.4, 0.4, 2})), 0); // above, and below
    EXPECT_EQ(sum(box({0.2, 0.2, -2}, {0.4, 0.4, -1})), 0);
}

/// A bar of two materials side by side, parted within cells: E A is the sum of both, and so is the mass.
TEST_F(SurfaceFile, cells_that_a_label_cuts_are_mixed) {
    constexpr double kLength = 1, kPart = 0.2375; // of 0.5: the plane halves no cell
    test::write_text(directory.path() / "bar.stl", binary_stl(box({0, 0, 0}, {0.5, kLength, 0.4})));
    test::write_text(directory.path() / "in.stl", binary_stl(box({-1, -1, -1}, {kPart, 2, 2})));
    const std::string body = "[body]\nsurface = \"bar.stl\"\ncell_size = 0.1\nfill = \"fraction\"\n";
    const std::string rest =
        "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\nsprings = \"means\"\n"
        "[[label]]\nvalue = 7\nsurface = \"in.stl\"\nyoung_modulus = 3e4\ndensity = 1200\n"
        "[[fix]]\nwhere = \"y-min\"\n[[move]]\nwhere = \"y-max\"\ntranslate = [0, 1e-6, 0]\n"
        "[solver]\nmethod = \"static\"\ntolerance = 1e-10\n[[probe]]\nname = \"plate\"\nwhere = \"y-max\"\n";
    Simulation mixed(parse_scene(body + rest, directory.path() / "s.toml"));
    const std::span<const double> masses = mixed.masses();
    const double other = 0.5 - kPart, mass = 0.4 * kLength * (1200 * kPart + 1000 * other);
    EXPECT_NEAR(std::accumulate(masses.begin(), masses.end(), 0.0), mass, 200 * 0.1 * 0.4 / 128);
    const std::vector<std::uint8_t>& labels = mixed.scene().body.labels;
    EXPECT_EQ(std::count(labels.begin(), labels.end(), 7), 2 * 10 * 4); // less than half of the third is inside
    EXPECT_EQ(mixed.scene().body.inclusion_part[2], 24);                // 3/8
    // A cell's modulus is the mean of both by their parts; of its scale by the volume.
    const Lattice& lattice = mixed.lattice();
    EXPECT_NEAR(lattice.cell_scale(0, 0, 0), 3, 1e-6);
    EXPECT_NEAR(lattice.cell_scale(2, 5, 1), 1 + 2 * 0.375, 1e-6);
    EXPECT_NEAR(lattice.cell_scale(3, 5, 1), 1, 1e-6);

    // Of another Poisson's ratio the moduli of shear and volume are the means.
    std::string bulky = body + rest;
    bulky.replace(bulky.find("springs = \"means\""), 17, "");
    bulky.replace(bulky.find("density = 1200"), 14, "poisson_ratio = 0.45");
    const Lattice third = Simulation(parse_scene(bulky, directory.path() / "s.toml")).lattice();
    const auto tissue = third.tissues()[third.cell_tissue(third.cell_index(2, 5, 1)) - 1];
    const double g0 = 1e4 / 2.6, g1 = 3e4 / 2.9, k0 = 1e4 / 1.2, k1 = 3e4 / 0.3, g = g0 + 0.375 * (g1 - g0),
                 k = k0 + 0.375 * (k1 - k0);
    EXPECT_NEAR(third.cell_scale(2, 5, 1), g / g0, 1e-6);
    EXPECT_NEAR(tissue.poisson_ratio, (3 * k - 2 * g) / (6 * k + 2 * g), 1e-12);

    // A label without stiffness is a hole.
    std::string hollow = body + rest;
    hollow.replace(hollow.find("young_modulus = 3e4"), 19, "young_modulus = 0");
    const Lattice less = Simulation(parse_scene(hollow, directory.path() / "s.toml")).lattice();
    EXPECT_EQ(less.cell_scale(0, 0, 0), 0);
    EXPECT_NEAR(less.cell_scale(2, 5, 1), 0.625, 1e-6);
    EXPECT_NEAR(less.cell_fill(less.cell_index(2, 5, 1)), 0.625, 1e-6);

    // Of a box, and of whole cells, by their centres.
    const std::string whole = "[body]\ncells = [5, 10, 4]\ncell_size = 0.1\n";
    const Lattice centres = Simulation(parse_scene(whole + rest, directory.path() / "s.toml")).lattice();
    EXPECT_NEAR(centres.cell_scale(1, 5, 1), 3, 1e-6);
    EXPECT_NEAR(centres.cell_scale(2, 5, 1), 1, 1e-6);

    const auto refused = [&](std::string text, const char* from, const char* to) {
        text.replace(text.find(from), std::strlen(from), to);
        try {
            const Simulation simulation(parse_scene(text, directory.path() / "s.toml"));
            return std::string("accepted");
        } catch (const SceneError& error) {
            return std::string(error.what());
        }
    };
    const std::string missing = refused(whole + rest, "in.stl", "no.stl");
    EXPECT_NE(missing.find("label.surface = \"no.stl\": it cannot be read"), std::string::npos) << missing;
    test::write_text(directory.path() / "far.stl", binary_stl(box({8, 8, 8}, {9, 9, 9})));
    EXPECT_NE(refused(body + rest, "in.stl", "far.stl").find("none of the body's cells is inside"), std::string::npos);
}

/// What a traction of 1 Pa along an axis gives to nodes, their sum, and the sum of their places by it.
struct Carried {
    std::vector<double> areas;
    double area = 0;
    Vertex moment{};
};

Carried carried(const Scene& scene) {
    const Lattice lattice = scene_lattice(scene);
    const std::vector<Vector3> rest = rest_positions(lattice, scene.body.origin);
    Carried sum;
    for (const Vector3& force : nodal_loads(scene, loaded_nodes(scene, lattice, rest), rest.size(), 0)) {
        const Vector3& x = rest[sum.areas.size()];
        sum.areas.push_back(force[1]);
        sum.area += force[1];
        for (std::size_t a = 0; a < 3; ++a) {
            sum.moment[a] += force[1] * x[a];
        }
    }
    return sum;
}

/// On the faces of cells a traction is the force that its area makes.
TEST(Traction, on_a_box_is_spread_as_a_force) {
    Scene scene;
    scene.body.cells = {3, 5, 4};
    scene.body.cell_size = 0.1;
    Load load = {FaceRegion{1, true}, {0, 0.3 * 0.4, 0}};
    scene.loads = {load};
    const Carried by_force = carried(scene);
    scene.loads[0] = {load.where, {0, 1, 0}, {}, LoadKind::traction};
    const Carried by_area = carried(scene);
    for (std::size_t n = 0; n < by_force.areas.size(); ++n) {
        EXPECT_NEAR(by_area.areas[n], by_force.areas[n], 1e-15);
    }
    scene.loads[0].where = RegionWithout{{BoxRegion{{-1, -1, -1}, {2, 2, 2}}}, {FaceRegion{0, false}}};
    EXPECT_NEAR(carried(scene).area, 2 * (0.3 * 0.4 + 0.3 * 0.5) + 0.4 * 0.5, 1e-12);
}

/// On a surface that cuts cells it carries the very area, and its first moments: the work of every linear motion.
TEST(Traction, on_a_cut_surface_has_its_area_and_moments) {
    const Vertex center = {0.4, -3, 0.05};
    for (const bool fractions : {false, true}) {
        Scene scene;
        const TriangleSurface ball = sphere(1, center, 4);
        scene.body = fractions ? filled_body(ball, 0.15) : voxels(ball, 0.15);
        scene.body.mesh = ball;
        double area = 0;
        for (const auto& t : ball.triangles) {
            const Vertex &p = ball.vertices[t[0]], &q = ball.vertices[t[1]], &r = ball.vertices[t[2]];
            const Vertex n = {(q[1] - p[1]) * (r[2] - p[2]) - (q[2] - p[2]) * (r[1] - p[1]),
                              (q[2] - p[2]) * (r[0] - p[0]) - (q[0] - p[0]) * (r[2] - p[2]),
                              (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])};
            area += std::hypot(n[0], n[1], n[2]) / 2;
        }
        for (Vertex& vertex : scene.body.mesh.vertices) {
            for (std::size_t a = 0; a < 3; ++a) {
                vertex[a] -= scene.body.origin[a];
            }
        }
        scene.loads = {{BoxRegion{{-9, -9, -9}, {9, 9, 9}}, {0, 1, 0}, {}, LoadKind::traction}};
        const Carried whole = carried(scene);
        EXPECT_NEAR(whole.area, area, 1e-12 * area);
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(whole.moment[a], area * center[a], 1e-10 * area);
        }
        scene.loads[0].where = BoxRegion{{-9, center[1], -9}, {9, 9, 9}};
        EXPECT_NEAR(carried(scene).area, area / 2, 0.05 * area);
    }
}

/// Mass and stiffness of a cell go together, so the step is that of whole cells, and holds.
TEST_F(SurfaceFile, cut_cells_do_not_shorten_the_step) {
    test::write_text(directory.path() / "ball.stl", binary_stl(sphere(1, {0.02, 0.03, 0.01}, 4)));
    const auto simulation_of = [&](const std::string& fill, const std::string& solver) {
        return Simulation(parse_scene("[body]\nsurface = \"ball.stl\"\ncell_size = 0.2\n" + fill +
                                          "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n"
                                          "[[start]]\nangular_velocity = [0.05, 0.1, 0.2]\n[solver]\n" +
                                          solver,
                                      directory.path() / "s.toml"));
    };
    const double whole = simulation_of("", "duration = 1\n").critical_time_step();
    const std::string step = "fill = \"fraction\"\n";
    EXPECT_NEAR(simulation_of(step, "duration = 1\n").critical_time_step(), whole, 1e-6 * whole);
    Simulation spinning = simulation_of(step, "time_step = " + std::to_string(0.99 * whole) + "\nduration = 40\n");
    const double kinetic = spinning.energies().kinetic;
    const Summary summary = spinning.run();
    EXPECT_EQ(summary.failure, "");
    EXPECT_GT(summary.steps, 1000);
    EXPECT_LT(summary.energies.kinetic + summary.energies.springs + summary.energies.volume, 1.01 * kinetic);
}

TEST_F(SurfaceFile, fractions_are_written_explained_and_refused) {
    test::write_text(directory.path() / "ball.stl", binary_stl(sphere(1, {0, 0, 0}, 3)));
    const std::string path = directory.path() / "s.toml";
    const std::string fraction = "\"ball.stl\"\nfill = \"fraction\"";
    std::string text = scene_text("ball.stl", "0.2", "\"y-min\"");
    text.replace(text.find("\"ball.stl\""), 10, fraction);
    const Scene scene = parse_scene(text, path);
    EXPECT_EQ(parse_scene(to_toml(scene), path), scene);
    EXPECT_NEAR(scene.body.surface_volume, enclosed_volume(sphere(1, {0, 0, 0}, 3)), 1e-6);

    const auto refused = [&](const std::string& body) {
        try {
            parse_scene(body + text.substr(text.find("\n[material]")), path);
        } catch (const SceneError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(refused("[body]\ncells = [1, 1, 1]\ncell_size = 1\nfill = \"fraction\"").find("only a surface"),
              std::string::npos);
    EXPECT_NE(refused("[body]\nsurface = \"ball.stl\"\ncell_size = 0.2\nfill = \"half\"").find("\"centre\" or"),
              std::string::npos);
    TriangleSurface mixed = sphere(1, {0, 0, 0}, 3);
    std::swap(mixed.triangles[5][0], mixed.triangles[5][1]);
    test::write_text(directory.path() / "mixed.stl", binary_stl(mixed));
    EXPECT_NE(refused("[body]\nsurface = \"mixed.stl\"\ncell_size = 0.2\nfill = \"fraction\"")
                  .find("some of its triangles are turned outwards and some inwards"),
              std::string::npos);
    TriangleSurface apart = box({0, 0, 0}, {1, 1, 1}); // each part alike, but not the two
    append(apart, turned(box({2, 0, 0}, {2.8, 0.8, 0.8})));
    test::write_text(directory.path() / "apart.stl", binary_stl(apart));
    EXPECT_NE(refused("[body]\nsurface = \"apart.stl\"\ncell_size = 0.2\nfill = \"fraction\"")
                  .find("a part of it is turned inwards"),
              std::string::npos);
}

} // namespace
} // namespace hybmss
