#include "hybmss/skin.hpp"

#include "hybmss/instruction_set.hpp"
#include "kernels/kernel_table.hpp"
#include "layouts/messages.hpp"
#include "layouts/node_numbers.hpp"
#include "plan/bodies/field_checks.hpp"
#include "plan/threads/workers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss {
namespace {

using Vector3 = std::array<double, 3>;

/// The present cell nearest to a place in units of the grid; cell numbers are those of the grid.
class NearestCell {
public:
    explicit NearestCell(const Lattice& lattice) : lattice_(&lattice) {}

    std::array<int, 3> to(const Vector3& place) const {
        const auto [nx, ny, nz] = lattice_->cells();
        const std::array<int, 3> count = {nx, ny, nz};
        std::array<int, 3> start{}, best{};
        for (std::size_t a = 0; a < 3; ++a) {
            start[a] = static_cast<int>(std::clamp(std::floor(place[a]), 0.0, count[a] - 1.0));
        }
        double least = std::numeric_limits<double>::infinity(), beyond = 0; // squares of distances
        for (std::size_t a = 0; a < 3; ++a) {
            const double outside = place[a] - std::clamp(place[a], 0.0, static_cast<double>(count[a]));
            beyond += outside * outside;
        }
        // Shell by shell about the cell at hand: cells of a shell are at least its number less one farther away.
        const int most = std::max({nx, ny, nz});
        for (int shell = 0; shell <= most && (shell < 2 || least > beyond + (shell - 1.0) * (shell - 1.0)); ++shell) {
            std::array<int, 3> low{}, high{};
            for (std::size_t a = 0; a < 3; ++a) {
                low[a] = std::max(start[a] - shell, 0);
                high[a] = std::min(start[a] + shell, count[a] - 1);
            }
            for (int k = low[2]; k <= high[2]; ++k) {
                for (int j = low[1]; j <= high[1]; ++j) {
                    const bool inside = std::abs(k - start[2]) < shell && std::abs(j - start[1]) < shell;
                    for (int i = low[0]; i <= high[0]; ++i) {
                        if (inside && std::abs(i - start[0]) < shell) {
                            i = std::min(start[0] + shell, high[0] + 1) - 1; // to the shell's other side
                            continue;
                        }
                        const double d = lattice_->cell_scale(i, j, k) > 0 ? distance(place, {i, j, k})
                                                                           : std::numeric_limits<double>::infinity();
                        if (d < least) {
                            least = d;
                            best = {i, j, k};
                        }
                    }
                }
            }
        }
        return best;
    }

private:
    static double distance(const Vector3& place, const std::array<int, 3>& cell) {
        double sum = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const double d = place[a] - std::clamp(place[a], static_cast<double>(cell[a]), cell[a] + 1.0);
            sum += d * d;
        }
        return sum;
    }

    const Lattice* lattice_;
};

/// Unit normals of the vertices: the sum over the triangles around, which are as long as twice their areas.
std::vector<Vector3> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vector3> normals(mesh.vertices.size(), Vector3{});
    for (const auto& [a, b, c] : mesh.triangles) {
        const Vector3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
        const Vector3 u = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, v = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
        const Vector3 area = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        for (const std::uint32_t vertex : {a, b, c}) {
            for (std::size_t i = 0; i < 3; ++i) {
                normals[vertex][i] += area[i];
            }
        }
    }
    for (Vector3& n : normals) {
        const double size = std::hypot(n[0], n[1], n[2]);
        for (double& x : n) {
            x = size > 0 ? x / size : 0;
        }
    }
    return normals;
}

constexpr double kFarthest = 1e9; // m

void validate(const Lattice& lattice, const TriangleMesh& mesh) {
    if (lattice.cell_count() == 0) {
        throw std::invalid_argument("a skin needs a lattice with at least one cell");
    }
    for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
        for (const double x : mesh.vertices[n]) {
            if (!(std::abs(x) <= kFarthest)) {
                refuse_value(("a coordinate of vertex " + std::to_string(n)).c_str(), x, "at most 1e9 m in size");
            }
        }
    }
    for (std::size_t n = 0; n < mesh.triangles.size(); ++n) {
        for (const std::uint32_t vertex : mesh.triangles[n]) {
            if (vertex >= mesh.vertices.size()) {
                throw std::invalid_argument("triangle " + std::to_string(n) + " names vertex " +
                                            std::to_string(vertex) + ": there are " +
                                            std::to_string(mesh.vertices.size()));
            }
        }
    }
}

} // namespace

TriangleMesh boundary_mesh(const Lattice& lattice) {
    const std::vector<std::array<std::size_t, 4>> faces = boundary_faces(lattice);
    std::vector<std::size_t> nodes;
    nodes.reserve(4 * faces.size());
    for (const auto& face : faces) {
        nodes.insert(nodes.end(), face.begin(), face.end());
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    TriangleMesh mesh;
    mesh.vertices.reserve(nodes.size());
    for (const std::size_t node : nodes) {
        mesh.vertices.push_back(lattice.rest_position(node));
    }
    mesh.triangles.reserve(2 * faces.size());
    for (const auto& face : faces) {
        std::array<std::uint32_t, 4> v{};
        for (std::size_t c = 0; c < 4; ++c) {
            v[c] = static_cast<std::uint32_t>(std::lower_bound(nodes.begin(), nodes.end(), face[c]) - nodes.begin());
        }
        mesh.triangles.push_back({v[0], v[1], v[2]});
        mesh.triangles.push_back({v[0], v[2], v[3]});
    }
    return mesh;
}

namespace {

/// The part of a cell's volume that is inside, of its fill (docs/surfaces.md): of t it keeps t (1 + t) / 2 and shares
/// the rest with its neighbour inside, where the surface lies across an axis.
double volume_inside(double fill) {
    return fill < 1 ? (std::sqrt(1 + 8 * fill) - 1) / 2 : 1;
}

/// By how much, in cells, the surface lies off a grid node: the mean over the lines that it crosses, of the twelve
/// between the centres of the eight cells around. Zero where it crosses none.
template <class Inside>
Vector3 off_node(const std::array<int, 3>& node, const Inside& inside) {
    std::array<double, 8> t{};
    for (int c = 0; c < 8; ++c) {
        t[static_cast<std::size_t>(c)] =
            inside(node[0] - 1 + (c & 1), node[1] - 1 + (c >> 1 & 1), node[2] - 1 + (c >> 2));
    }
    Vector3 sum{};
    double crossings = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t low = 0; low < 8; ++low) {
            const std::size_t high = low | std::size_t{1} << axis;
            if (low == high || (t[low] >= 0.5) == (t[high] >= 0.5)) {
                continue;
            }
            const bool up = t[low] >= 0.5; // from the cell inside: what is filled beyond its centre
            const double along = std::clamp(t[low] + t[high] - 0.5, 0.0, 1.0);
            for (std::size_t a = 0; a < 3; ++a) {
                sum[a] += a == axis ? (up ? along - 0.5 : 0.5 - along) : ((low >> a & 1) != 0 ? 0.5 : -0.5);
            }
            ++crossings;
        }
    }
    for (double& x : sum) {
        x = crossings > 0 ? x / crossings : 0;
    }
    return sum;
}

/// Taubin's smoothing: towards the mean of the neighbours, and a little more away again, which leaves the volume.
/// Vertices stay so near their nodes, in cells along each axis, that no cell's faces meet.
void smooth(TriangleMesh& mesh, const std::vector<Vector3>& nodes, double cell_size) {
    constexpr int kRounds = 10;
    constexpr double kIn = 0.5, kOut = -0.53, kReach = 0.4;
    std::vector<Vector3> sums(nodes.size());
    std::vector<double> counts(nodes.size());
    for (int step = 0; step < 2 * kRounds; ++step) {
        std::fill(sums.begin(), sums.end(), Vector3{});
        std::fill(counts.begin(), counts.end(), 0.0);
        for (const auto& [a, b, c] : mesh.triangles) { // each edge is of two of them, and so counts twice
            for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}}) {
                for (std::size_t i = 0; i < 3; ++i) {
                    sums[from][i] += mesh.vertices[to][i];
                    sums[to][i] += mesh.vertices[from][i];
                }
                ++counts[from];
                ++counts[to];
            }
        }
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            for (std::size_t i = 0; i < 3; ++i) {
                double& x = mesh.vertices[n][i];
                x += (step % 2 == 0 ? kIn : kOut) * (sums[n][i] / counts[n] - x);
                x = std::clamp(x, nodes[n][i] - kReach * cell_size, nodes[n][i] + kReach * cell_size);
            }
        }
    }
}

} // namespace

TriangleMesh smooth_boundary_mesh(const Lattice& lattice) {
    const auto [nx, ny, nz] = lattice.cells();
    const auto inside = [&, nx = nx, ny = ny, nz = nz](int i, int j, int k) {
        const bool in_grid = i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz;
        return in_grid && lattice.cell_scale(i, j, k) > 0
                   ? volume_inside(static_cast<double>(lattice.cell_fill(lattice.cell_index(i, j, k))))
                   : 0.0;
    };
    std::vector<std::array<int, 3>> outside;
    for (int k = 0; k < nz && !lattice.fills().empty(); ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                if (const double t = inside(i, j, k); t > 0 && t < 0.5) {
                    outside.push_back({i, j, k});
                }
            }
        }
    }
    Lattice half = lattice;
    half.remove_cells(outside);
    TriangleMesh mesh = boundary_mesh(half);
    const double h = lattice.cell_size();
    const std::vector<Vector3> nodes = mesh.vertices;
    for (Vector3& x : mesh.vertices) {
        std::array<int, 3> node{};
        for (std::size_t a = 0; a < 3; ++a) {
            node[a] = static_cast<int>(std::lround(x[a] / h));
        }
        const Vector3 off = off_node(node, inside);
        for (std::size_t a = 0; a < 3; ++a) {
            x[a] += h * off[a];
        }
    }
    if (lattice.fills().empty()) {
        smooth(mesh, nodes, h);
    }
    return mesh;
}

namespace {

/// The corners of a triangle that has been parted until no edge is longer than `most`.
void add_points(const std::array<Vector3, 3>& corners, double most, std::vector<Vector3>& points) {
    std::size_t longest = 0;
    double length = 0;
    for (std::size_t e = 0; e < 3; ++e) {
        const Vector3 &a = corners[e], &b = corners[(e + 1) % 3];
        if (const double d = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); d > length) {
            length = d;
            longest = e;
        }
    }
    if (!(length > most)) {
        points.insert(points.end(), corners.begin(), corners.end());
        return;
    }
    const Vector3 &a = corners[longest], &b = corners[(longest + 1) % 3], &c = corners[(longest + 2) % 3];
    const Vector3 middle = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
    add_points({a, middle, c}, most, points);
    add_points({middle, b, c}, most, points);
}

} // namespace

std::vector<SkinPoint> skin_points(const Lattice& lattice, const TriangleMesh& mesh,
                                   const std::array<double, 3>& origin) {
    validate(lattice, mesh);
    const double h = lattice.cell_size();
    std::vector<Vector3> points;
    for (const auto& [a, b, c] : mesh.triangles) {
        add_points({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}, 1.5 * h,
                   points); // cells' faces are not parted
    }
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    const NearestCell nearest(lattice);
    const NodeNumbers numbers(lattice, lattice.nodes().size());
    std::vector<SkinPoint> skin;
    for (const Vector3& x : points) {
        const std::array<int, 3> cell = nearest.to({x[0] / h, x[1] / h, x[2] / h});
        std::array<std::array<double, 2>, 3> at{}, slope{}; // of the nearest place, along each axis; and the way on
        Vector3 on{};
        for (std::size_t a = 0; a < 3; ++a) {
            const double place = x[a] / h - cell[a], inside = std::clamp(place, 0.0, 1.0);
            at[a] = {1 - inside, inside};
            slope[a] = {-1, 1};
            on[a] = place - inside;
        }
        SkinPoint& point = skin.emplace_back();
        for (std::size_t c = 0; c < 8; ++c) {
            const std::array<std::size_t, 3> bit = {c & 1, c >> 1 & 1, c >> 2};
            point.nodes[c] = numbers.of(lattice.grid_node_index(cell[0] + static_cast<int>(bit[0]),
                                                                cell[1] + static_cast<int>(bit[1]),
                                                                cell[2] + static_cast<int>(bit[2])));
            point.weights[c] = at[0][bit[0]] * at[1][bit[1]] * at[2][bit[2]];
            for (std::size_t a = 0; a < 3; ++a) { // on linearly
                const std::size_t b = (a + 1) % 3, d = (a + 2) % 3;
                point.weights[c] += on[a] * slope[a][bit[a]] * at[b][bit[b]] * at[d][bit[d]];
            }
        }
        for (std::size_t a = 0; a < 3; ++a) {
            point.rest_position[a] = origin[a] + x[a];
        }
    }
    return skin;
}

template <class T>
struct Skin<T>::Implementation {
    Implementation(const Lattice& lattice, const TriangleMesh& mesh, const PlanOptions& options)
        : nodes(lattice.nodes().size()), cell_size(lattice.cell_size()), triangles(mesh.triangles),
          table(&kernels::kernel_table<T>(resolve(options.instruction_set))),
          workers(useful_threads(options, mesh.vertices.size()), options.task_runner) {
        const NearestCell nearest(lattice);
        std::vector<std::size_t> cell_of(mesh.vertices.size());
        for (std::size_t n = 0; n < cell_of.size(); ++n) {
            Vector3 place = mesh.vertices[n];
            for (double& x : place) {
                x /= cell_size;
            }
            const auto [i, j, k] = nearest.to(place);
            cell_of[n] = lattice.cell_index(i, j, k);
        }
        order.resize(cell_of.size());
        for (std::size_t n = 0; n < order.size(); ++n) {
            order[n] = static_cast<std::uint32_t>(n);
        }
        std::stable_sort(order.begin(), order.end(),
                         [&](std::uint32_t a, std::uint32_t b) { return cell_of[a] < cell_of[b]; });
        for (auto& array : values) {
            array.resize(order.size() + kernels::kMaxWidth, T(0)); // a cell's last ones are moved with others beside
        }
        const NodeNumbers numbers(lattice, nodes);
        const std::vector<Vector3> normals = vertex_normals(mesh);
        for (std::size_t n = 0; n < order.size(); ++n) {
            const std::size_t cell = cell_of[order[n]];
            const auto [nx, ny, nz] = lattice.cells();
            const auto across = static_cast<std::size_t>(nx), deep = static_cast<std::size_t>(ny);
            const std::array<int, 3> at = {static_cast<int>(cell % across), static_cast<int>(cell / across % deep),
                                           static_cast<int>(cell / across / deep)};
            if (cells.empty() || cell_numbers.back() != cell) {
                auto& begun = cells.emplace_back();
                cell_numbers.push_back(cell);
                begun.first = static_cast<kernels::Range>(n);
                begun.inside = 1;
                for (std::size_t a = 0; a < 3; ++a) {
                    begun.middle[a] = static_cast<T>((at[a] + 0.5) * cell_size);
                }
                for (int c = 0; c < 8; ++c) {
                    begun.nodes[c] =
                        numbers.of(lattice.grid_node_index(at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)));
                }
            }
            ++cells.back().count;
            for (std::size_t a = 0; a < 3; ++a) {
                const double place = 2 * (mesh.vertices[order[n]][a] / cell_size - at[a]) - 1;
                values[kernels::kSkinPlace + a][n] = static_cast<T>(place);
                values[kernels::kSkinNearest + a][n] = static_cast<T>(std::clamp(place, -1.0, 1.0));
                values[kernels::kSkinNormal + a][n] = static_cast<T>(normals[order[n]][a]);
                if (std::abs(place) > 1 + 1e-12) { // rounding of what lies on a face
                    cells.back().inside = 0;
                }
            }
        }
    }

    void update_all(const VectorField<const T>& displacement, const VectorField<T>& positions,
                    const VectorField<T>* normals) const {
        kernels::SkinVertices<T> skin{};
        skin.cells = cells.data();
        for (std::size_t i = 0; i < values.size(); ++i) {
            skin.values[i] = values[i].data();
        }
        skin.order = order.data();
        skin.half_size = static_cast<T>(cell_size / 2);
        skin.inverse_half_size = static_cast<T>(2 / cell_size);
        const auto take = [](const auto& field, auto& arrays, std::ptrdiff_t& stride) {
            arrays[0] = field.x;
            arrays[1] = field.y;
            arrays[2] = field.z;
            stride = field.stride;
        };
        take(displacement, skin.displacement, skin.displacement_stride);
        take(positions, skin.positions, skin.positions_stride);
        if (normals) {
            take(*normals, skin.normals, skin.normals_stride);
        }
        const auto move = table->move_skin(normals != nullptr);
        constexpr std::size_t kPiece = 64;
        workers.run((cells.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
            move(skin, static_cast<kernels::Range>(piece * kPiece),
                 static_cast<kernels::Range>(std::min((piece + 1) * kPiece, cells.size())));
        });
    }

    std::size_t nodes;
    double cell_size;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::uint32_t> order; ///< the vertices by their cells
    std::array<std::vector<T>, kernels::kSkinValues> values;
    std::vector<kernels::SkinCell<T>> cells;
    std::vector<std::size_t> cell_numbers; ///< of the grid
    const kernels::KernelTable<T>* table;
    Workers workers;
};

template <class T>
Skin<T>::Skin(const Lattice& lattice, const TriangleMesh& mesh, const PlanOptions& options) {
    validate(lattice, mesh);
    implementation_ = std::make_unique<Implementation>(lattice, mesh, options);
}
template <class T>
Skin<T>::Skin(Skin&&) noexcept = default;
template <class T>
Skin<T>& Skin<T>::operator=(Skin&&) noexcept = default;
template <class T>
Skin<T>::~Skin() = default;

template <class T>
std::size_t Skin<T>::vertex_count() const {
    return implementation_->order.size();
}
template <class T>
std::size_t Skin<T>::node_count() const {
    return implementation_->nodes;
}

template <class T>
void Skin<T>::update(VectorField<const T> displacement, VectorField<T> positions, VectorField<T> normals) const {
    const Implementation& i = *implementation_;
    const bool with_normals = normals.size > 0 || normals.x;
    check_field(displacement, i.nodes, "nodes", "the body");
    check_field(positions, vertex_count(), "vertices", "the skin");
    check_apart(positions, displacement);
    if (with_normals) {
        check_field(normals, vertex_count(), "vertices", "the skin");
        check_apart(normals, displacement);
        check_apart(normals, VectorField<const T>(positions));
    }
    i.update_all(displacement, positions, with_normals ? &normals : nullptr);
}

template <class T>
std::vector<std::array<std::uint32_t, 3>> Skin<T>::triangles_left(const Lattice& cut) const {
    const Implementation& i = *implementation_;
    std::vector<bool> lost(vertex_count(), false);
    for (std::size_t c = 0; c < i.cells.size(); ++c) {
        const std::size_t cell = i.cell_numbers[c];
        if (cell >= cut.cell_scales().size() || !(cut.cell_scales()[cell] > 0)) {
            for (kernels::Range n = i.cells[c].first; n < i.cells[c].first + i.cells[c].count; ++n) {
                lost[i.order[static_cast<std::size_t>(n)]] = true;
            }
        }
    }
    std::vector<std::array<std::uint32_t, 3>> left;
    std::copy_if(i.triangles.begin(), i.triangles.end(), std::back_inserter(left),
                 [&](const auto& triangle) { return !lost[triangle[0]] && !lost[triangle[1]] && !lost[triangle[2]]; });
    return left;
}

template class Skin<float>;
template class Skin<double>;

} // namespace hybmss
