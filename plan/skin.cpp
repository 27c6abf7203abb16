#include "hybmss/skin.hpp"

#include "layouts/messages.hpp"
#include "layouts/node_numbers.hpp"
#include "plan/bodies/field_checks.hpp"
#include "plan/threads/workers.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

using Vector3 = std::array<double, 3>;

/// So many vertices of a cell are moved side by side.
constexpr std::size_t kVerticesTogether = 8;
/// A vertex's values: its place from the cell's middle, -1 to 1 along each axis in the cell; the same, as near as the
/// cell goes; its normal at rest.
constexpr std::size_t kPlace = 0, kNearest = 3, kNormal = 6, kValues = 9;

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

template <class T>
struct Skin<T>::Implementation {
    using Lanes = Eigen::Array<T, static_cast<int>(kVerticesTogether), 1>;
    using LaneVector = std::array<Lanes, 3>;

    /// A cell with vertices: `count` of them from `first` on, in the order by cells.
    struct Group {
        std::array<std::uint32_t, 8> nodes;
        std::size_t cell;        ///< of the grid
        std::array<T, 3> middle; ///< at rest, m
        std::size_t first, count;
        bool inside; ///< all of them
    };

    Implementation(const Lattice& lattice, const TriangleMesh& mesh, const PlanOptions& options)
        : nodes(lattice.nodes().size()), cell_size(lattice.cell_size()), triangles(mesh.triangles),
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
            array.resize(order.size() + kVerticesTogether,
                         T(0)); // a group's last vertices are moved with others beside
        }
        const NodeNumbers numbers(lattice, nodes);
        const std::vector<Vector3> normals = vertex_normals(mesh);
        for (std::size_t n = 0; n < order.size(); ++n) {
            const std::size_t cell = cell_of[order[n]];
            const auto [nx, ny, nz] = lattice.cells();
            const auto across = static_cast<std::size_t>(nx), deep = static_cast<std::size_t>(ny);
            const std::array<int, 3> at = {static_cast<int>(cell % across), static_cast<int>(cell / across % deep),
                                           static_cast<int>(cell / across / deep)};
            if (groups.empty() || groups.back().cell != cell) {
                Group& group = groups.emplace_back(Group{{}, cell, {}, n, 0, true});
                for (std::size_t a = 0; a < 3; ++a) {
                    group.middle[a] = static_cast<T>((at[a] + 0.5) * cell_size);
                }
                for (int c = 0; c < 8; ++c) {
                    group.nodes[static_cast<std::size_t>(c)] =
                        numbers.of(lattice.grid_node_index(at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)));
                }
            }
            ++groups.back().count;
            for (std::size_t a = 0; a < 3; ++a) {
                const double place = 2 * (mesh.vertices[order[n]][a] / cell_size - at[a]) - 1;
                values[kPlace + a][n] = static_cast<T>(place);
                values[kNearest + a][n] = static_cast<T>(std::clamp(place, -1.0, 1.0));
                values[kNormal + a][n] = static_cast<T>(normals[order[n]][a]);
                groups.back().inside = groups.back().inside && std::abs(place) <= 1;
            }
        }
    }

    Lanes lanes(std::size_t value, std::size_t first) const {
        return Eigen::Map<const Lanes>(values[value].data() + first);
    }

    void update_all(const VectorField<const T>& displacement, const VectorField<T>& positions,
                    const VectorField<T>* normals) const {
        constexpr std::size_t kPiece = 64;
        workers.run((groups.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
            for (std::size_t g = piece * kPiece; g < std::min((piece + 1) * kPiece, groups.size()); ++g) {
                update(groups[g], displacement, positions, normals);
            }
        });
    }

    void update(const Group& group, const VectorField<const T>& displacement, const VectorField<T>& positions,
                const VectorField<T>* normals) const {
        // u = m0 + m1 x + m2 y + m3 z + m4 xy + m5 yz + m6 zx + m7 xyz in the cell, by sums and differences of corners.
        T m[8][3];
        const std::array<const T*, 3> from = {displacement.x, displacement.y, displacement.z};
        for (std::size_t a = 0; a < 3; ++a) {
            T u[8];
            for (std::size_t c = 0; c < 8; ++c) {
                u[c] = from[a][static_cast<std::ptrdiff_t>(group.nodes[c]) * displacement.stride] / 8;
            }
            for (std::size_t bit = 1; bit < 8; bit *= 2) {
                for (std::size_t c = 0; c < 8; ++c) {
                    if ((c & bit) == 0) {
                        const T low = u[c], high = u[c | bit];
                        u[c] = low + high;
                        u[c | bit] = high - low;
                    }
                }
            }
            constexpr std::size_t kMonomial[8] = {0, 1, 2, 4, 3, 6, 5, 7}; // by the bits of their axes
            for (std::size_t i = 0; i < 8; ++i) {
                m[i][a] = u[kMonomial[i]];
            }
        }
        const std::array<T*, 3> to = {positions.x, positions.y, positions.z};
        const T half = static_cast<T>(cell_size / 2);
        for (std::size_t first = group.first; first < group.first + group.count; first += kVerticesTogether) {
            const std::size_t count = std::min(kVerticesTogether, group.first + group.count - first);
            const LaneVector w = {lanes(kPlace, first), lanes(kPlace + 1, first), lanes(kPlace + 2, first)};
            LaneVector p = w, products = {w[0] * w[1], w[1] * w[2], w[2] * w[0]};
            Lanes all = products[0] * w[2];
            if (!group.inside) { // from the nearest point p on linearly: as (w - p) times the products' slopes there
                p = {lanes(kNearest, first), lanes(kNearest + 1, first), lanes(kNearest + 2, first)};
                const LaneVector at = {p[0] * p[1], p[1] * p[2], p[2] * p[0]};
                for (std::size_t a = 0; a < 3; ++a) {
                    const std::size_t b = (a + 1) % 3;
                    products[a] = w[a] * p[b] + p[a] * w[b] - at[a];
                }
                all = w[0] * at[1] + w[1] * at[2] + w[2] * at[0] - T(2) * at[0] * p[2];
            }
            for (std::size_t a = 0; a < 3; ++a) {
                const Lanes position = (group.middle[a] + m[0][a]) + half * w[a] + w[0] * m[1][a] + w[1] * m[2][a] +
                                       w[2] * m[3][a] + products[0] * m[4][a] + products[1] * m[5][a] +
                                       products[2] * m[6][a] + all * m[7][a];
                scatter(position, first, count, to[a], positions.stride);
            }
            if (normals) {
                const LaneVector normal = turned(m, p, first);
                const std::array<T*, 3> there = {normals->x, normals->y, normals->z};
                for (std::size_t a = 0; a < 3; ++a) {
                    scatter(normal[a], first, count, there[a], normals->stride);
                }
            }
        }
    }

    /// cof(F) n / |cof(F) n| with F = I + du/dX at places in the cell.
    LaneVector turned(const T (&m)[8][3], const LaneVector& place, std::size_t first) const {
        const auto& [x, y, z] = place;
        const T scale = static_cast<T>(2 / cell_size);
        std::array<LaneVector, 3> f; // by rows
        for (std::size_t a = 0; a < 3; ++a) {
            const Lanes xz = m[6][a] + m[7][a] * y; // the factor of z in that of x, and the other way round
            f[a] = {scale * (m[1][a] + m[4][a] * y + xz * z),
                    scale * (m[2][a] + m[4][a] * x + m[5][a] * z + m[7][a] * z * x),
                    scale * (m[3][a] + m[5][a] * y + xz * x)};
            f[a][a] += T(1);
        }
        LaneVector normal;
        Lanes size = Lanes::Zero();
        for (std::size_t a = 0; a < 3; ++a) {
            const LaneVector &p = f[(a + 1) % 3], &q = f[(a + 2) % 3]; // a row of the cofactor is their cross product
            normal[a] = (p[1] * q[2] - p[2] * q[1]) * lanes(kNormal, first) +
                        (p[2] * q[0] - p[0] * q[2]) * lanes(kNormal + 1, first) +
                        (p[0] * q[1] - p[1] * q[0]) * lanes(kNormal + 2, first);
            size += normal[a] * normal[a];
        }
        const Lanes by = size.max(std::numeric_limits<T>::min()).sqrt().inverse();
        for (Lanes& n : normal) {
            n *= by;
        }
        return normal;
    }

    void scatter(const Lanes& from, std::size_t first, std::size_t count, T* to, std::ptrdiff_t stride) const {
        for (std::size_t n = 0; n < count; ++n) {
            to[static_cast<std::ptrdiff_t>(order[first + n]) * stride] = from[static_cast<Eigen::Index>(n)];
        }
    }

    std::size_t nodes;
    double cell_size;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::uint32_t> order; ///< the vertices by their cells
    std::array<std::vector<T>, kValues> values;
    std::vector<Group> groups;
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
    for (const auto& group : i.groups) {
        if (group.cell >= cut.cell_scales().size() || !(cut.cell_scales()[group.cell] > 0)) {
            for (std::size_t n = group.first; n < group.first + group.count; ++n) {
                lost[i.order[n]] = true;
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
