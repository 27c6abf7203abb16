#include "simulation/run/boundary_conditions.hpp"

#include "hybmss/skin.hpp"
#include "layouts/messages.hpp"
#include "simulation/geometry/cells.hpp"
#include "simulation/geometry/triangle_surface.hpp"
#include "solvers/newton/pressure_potential.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

namespace hybmss {
namespace {

Kinematics translated(const Vector3& translation, const Ramp& s) {
    Kinematics k;
    for (std::size_t a = 0; a < 3; ++a) {
        k.displacement[a] = s.value * translation[a];
        k.velocity[a] = s.rate * translation[a];
        k.acceleration[a] = s.acceleration * translation[a];
    }
    return k;
}

/// With p the part of rest - center at right angles to the unit axis n, q = n x p and the angle phi:
///   u = (cos phi - 1) p + sin phi q;   r = cos phi p + sin phi q;   v = phi' n x r;   a = phi'' n x r - phi'^2 r
/// cos phi - 1 = -2 sin^2(phi / 2) keeps all digits at small angles.
Kinematics rotated(const Rotation& rotation, const Vector3& rest, const Vector3& center, const Ramp& s) {
    const double whole = rotation.degrees * std::numbers::pi / 180;
    const double phi = s.value * whole, rate = s.rate * whole, acceleration = s.acceleration * whole;
    const double sine = std::sin(phi), half = std::sin(phi / 2), cosine_minus_one = -2 * half * half;
    // Axes in cyclic order after the rotation's own: n x e_i = e_j, n x e_j = -e_i.
    const auto i = static_cast<std::size_t>((rotation.axis + 1) % 3),
               j = static_cast<std::size_t>((rotation.axis + 2) % 3);
    const double p[2] = {rest[i] - center[i], rest[j] - center[j]};
    const double u[2] = {cosine_minus_one * p[0] - sine * p[1], cosine_minus_one * p[1] + sine * p[0]};
    const double r[2] = {p[0] + u[0], p[1] + u[1]};
    Kinematics k;
    k.displacement[i] = u[0];
    k.displacement[j] = u[1];
    k.velocity[i] = -rate * r[1];
    k.velocity[j] = rate * r[0];
    k.acceleration[i] = -acceleration * r[1] - rate * rate * r[0];
    k.acceleration[j] = acceleration * r[0] - rate * rate * r[1];
    return k;
}

Kinematics moved_along(const Move& move, const Vector3& rest, const Vector3& center, const Ramp& s) {
    if (const Rotation* rotation = std::get_if<Rotation>(&move.motion)) {
        return rotated(*rotation, rest, center, s);
    }
    return translated(std::get<Vector3>(move.motion), s);
}

bool holds(AxisSet axes, std::size_t axis) {
    return (axes >> axis & 1) != 0;
}

std::string line_of(const Scene& scene, const std::string& path) {
    const auto entry = scene.source.entries.find(path);
    return entry == scene.source.entries.end() ? path : "line " + std::to_string(entry->second.line);
}

} // namespace

std::string where_text(const Scene& scene, const std::string& path) {
    const auto entry = scene.source.entries.find(path);
    return entry == scene.source.entries.end() ? path : entry->second.value;
}

std::string Supports::path_of(int by) {
    return by < 0 ? "fix[" + std::to_string(-1 - by) + "].where" : "move[" + std::to_string(by) + "].where";
}

Ramp ramp(double time, double over) {
    if (time >= over) {
        return {1, 0, 0};
    }
    const double r = std::max(time / over, 0.0);
    return {r * r * r * (10 + r * (-15 + 6 * r)), 30 * r * r * (1 - r) * (1 - r) / over,
            60 * r * (1 - r) * (1 - 2 * r) / over / over}; // a tiny square would be 0
}

Kinematics moved(const Move& move, const Vector3& rest, const Vector3& center, double time) {
    return moved_along(move, rest, center, ramp(time, move.over));
}

std::vector<std::uint32_t> nodes_of(const Scene& scene, std::span<const Vector3> rest, const Region& region,
                                    const std::string& path) {
    std::vector<std::uint32_t> nodes = select_nodes(rest, scene.body.cell_size, region);
    if (nodes.empty()) {
        throw scene_error(scene, path,
                          "no node of the body lies in it; the region must hold at least one of the " +
                              std::to_string(rest.size()) + " nodes");
    }
    return nodes;
}

namespace {

/// u of what is at x, where the body's place turns it by so many times its angle.
Vector3 turned_by(double times, const SceneBody& body, const Vector3& x) {
    Vector3 middle = body.origin;
    for (std::size_t a = 0; a < 3; ++a) {
        middle[a] += static_cast<double>(body.cells[a]) * body.cell_size / 2;
    }
    return rotated(*body.place.rotate, x, middle, {times, 0, 0}).displacement;
}

} // namespace

std::vector<Vector3> initial_displacements(const Scene& scene, std::span<const Vector3> rest) {
    if (!scene.body.place.rotate) {
        return {};
    }
    if (timeless(scene.solver.method)) {
        throw scene_error(scene, "body.place.rotate",
                          "a static scene has no body that is turned: turn its loads and moves");
    }
    std::vector<Vector3> displacements;
    displacements.reserve(rest.size());
    for (const Vector3& x : rest) {
        displacements.push_back(turned_by(1, scene.body, x));
    }
    return displacements;
}

Vector3 at_rest(const SceneBody& body, const Vector3& x) {
    Vector3 rest = x;
    if (body.place.rotate) {
        const Vector3 back = turned_by(-1, body, x);
        for (std::size_t a = 0; a < 3; ++a) {
            rest[a] += back[a];
        }
    }
    return rest;
}

std::vector<Vector3> positions(std::span<const Vector3> rest, std::span<const Vector3> displacements) {
    std::vector<Vector3> sum(rest.begin(), rest.end());
    for (std::size_t n = 0; n < displacements.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            sum[n][a] += displacements[n][a];
        }
    }
    return sum;
}

Supports::Supports(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> turned)
    : moves_(scene.moves) {
    const std::vector<Vector3> begin = positions(rest, turned);
    std::map<std::uint32_t, Held> held;
    std::set<std::uint32_t> fixed_nodes, moved_nodes;
    for (std::size_t f = 0; f < scene.fixes.size(); ++f) {
        const int by = -1 - static_cast<int>(f);
        for (std::uint32_t n : nodes_of(scene, rest, scene.fixes[f].where, Supports::path_of(by))) {
            fixed_nodes.insert(n);
            for (std::size_t a = 0; a < 3; ++a) {
                held[n].by[a] = holds(scene.fixes[f].axes, a) ? by : held[n].by[a];
            }
        }
    }
    // Fixes came first and never contradict each other, so a contradiction is always found at a move.
    for (std::size_t m = 0; m < moves_.size(); ++m) {
        const int by = static_cast<int>(m);
        const std::vector<std::uint32_t> nodes = nodes_of(scene, rest, moves_[m].where, Supports::path_of(by));
        centers_.push_back(rest_centroid(begin, nodes));
        end_of_motion_ = std::max(end_of_motion_, moves_[m].over);
        for (std::uint32_t n : nodes) {
            moved_nodes.insert(n);
            for (std::size_t a = 0; a < 3; ++a) {
                if (!holds(moves_[m].axes, a)) {
                    continue;
                }
                int& holder = held[n].by[a];
                if (holder != Held::kFree) {
                    throw scene_error(scene, Supports::path_of(by),
                                      "node " + std::to_string(n) + " is held along " + "xyz"[a] + " already by " +
                                          line_of(scene, Supports::path_of(holder)) +
                                          "; one axis of a node may be held once");
                }
                holder = by;
            }
        }
    }
    fixed_node_count_ = fixed_nodes.size();
    moved_node_count_ = moved_nodes.size();
    for (const auto& [n, entry] : held) {
        PrescribedNode node{.node = n, .axes = 0};
        for (std::size_t a = 0; a < 3; ++a) {
            node.axes = static_cast<AxisSet>(node.axes | (entry.by[a] != Held::kFree ? 1u << a : 0u));
        }
        held_.push_back(entry);
        held_rest_.push_back(begin[n]);
        held_turned_.push_back(turned.empty() ? Vector3{0, 0, 0} : turned[n]);
        node.displacement = held_turned_.back();
        present_.push_back(node);
    }
    accelerations_.resize(present_.size());
    at(0);
}

template <class KinematicsOf>
std::span<const PrescribedNode> Supports::set(const KinematicsOf& kinematics) {
    for (std::size_t i = 0; i < present_.size(); ++i) {
        int last = Held::kFree;
        Kinematics k;
        for (std::size_t a = 0; a < 3; ++a) {
            const int by = held_[i].by[a];
            if (by < 0) {
                continue;
            }
            if (by != last) {
                const auto m = static_cast<std::size_t>(by);
                k = kinematics(moves_[m], held_rest_[i], centers_[m]);
                last = by;
            }
            present_[i].displacement[a] = held_turned_[i][a] + k.displacement[a];
            present_[i].velocity[a] = k.velocity[a];
            accelerations_[i][a] = k.acceleration[a];
        }
    }
    return present_;
}

SharedSupports Supports::shared(const Scene& scene, std::span<const Vector3> rest,
                                std::span<const std::uint32_t> nodes) const {
    SharedSupports found;
    std::map<int, bool> crosses; // by who holds
    for (std::size_t h = 0; h < held_.size(); ++h) {
        if (!std::binary_search(nodes.begin(), nodes.end(), present_[h].node)) {
            continue;
        }
        ++found.held;
        bool is_shared = false;
        for (const int by : held_[h].by) {
            if (by == Held::kFree) {
                continue;
            }
            if (const auto [entry, is_new] = crosses.try_emplace(by, false); is_new) {
                const Region& where = by < 0 ? scene.fixes[static_cast<std::size_t>(-1 - by)].where
                                             : scene.moves[static_cast<std::size_t>(by)].where;
                const std::vector<std::uint32_t> its = select_nodes(rest, scene.body.cell_size, where);
                entry->second = !std::includes(nodes.begin(), nodes.end(), its.begin(), its.end()) &&
                                !std::includes(its.begin(), its.end(), nodes.begin(), nodes.end());
                if (entry->second) {
                    found.by.append(found.by.empty() ? "" : ", ").append(where_text(scene, Supports::path_of(by)));
                }
            }
            is_shared = is_shared || crosses[by];
        }
        found.shared += is_shared;
    }
    return found;
}

std::span<const PrescribedNode> Supports::at(double time) {
    return set([time](const Move& move, const Vector3& rest, const Vector3& center) {
        return moved(move, rest, center, time);
    });
}

std::span<const PrescribedNode> Supports::at_part(double fraction) {
    return set([fraction](const Move& move, const Vector3& rest, const Vector3& center) {
        return Kinematics{moved_along(move, rest, center, {fraction, 0, 0}).displacement, {}, {}};
    });
}

namespace {

/// The filled cell nearest to a point, given in units of cells, of those that are at most so many cells off `at` along
/// each axis as the first one found.
std::size_t nearest_cell(const Lattice& lattice, const std::array<int, 3>& at, const Vector3& point) {
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int reach = 1; !std::isfinite(least); ++reach) {
        std::array<int, 3> low{}, high{};
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = std::max(at[a] - reach, 0);
            high[a] = std::min(at[a] + reach, lattice.cells()[a] - 1);
        }
        for (int k = low[2]; k <= high[2]; ++k) {
            for (int j = low[1]; j <= high[1]; ++j) {
                for (int i = low[0]; i <= high[0]; ++i) {
                    const double away = std::hypot(point[0] - std::clamp<double>(point[0], i, i + 1),
                                                   point[1] - std::clamp<double>(point[1], j, j + 1),
                                                   point[2] - std::clamp<double>(point[2], k, k + 1));
                    if (away < least && lattice.cell_scale(i, j, k) > 0) {
                        least = away;
                        nearest = lattice.cell_index(i, j, k);
                    }
                }
            }
        }
    }
    return nearest;
}

/// A piece of the surface in one cell gives its area to the cell's corners, linearly along each axis: the virtual work
/// of a traction on it, exact where it is flat along an axis, to the third order elsewhere.
LoadedNodes loaded_by_area(const Scene& scene, const Lattice& lattice, std::size_t nodes, std::size_t load) {
    const std::string path = "load[" + std::to_string(load) + "].where";
    const SceneBody& body = scene.body;
    const double h = lattice.cell_size();
    const TriangleMesh mesh = body.mesh.triangles.empty() ? boundary_mesh(lattice) : body.mesh;
    struct Piece {
        std::array<int, 3> cell;
        Polygon polygon;
    };
    std::vector<Piece> pieces;
    std::vector<Vector3> middles; // in the scene's coordinates
    for (const auto& t : mesh.triangles) {
        Polygon triangle;
        for (const std::uint32_t v : t) {
            triangle.push_back(mesh.vertices[v]);
            for (std::size_t a = 0; a < 3; ++a) { // a surface may stand out of the grid by rounding
                triangle.back()[a] = std::clamp<double>(triangle.back()[a] / h, 0, lattice.cells()[a]);
            }
        }
        for_each_piece(triangle, body.cells, [&](const std::array<int, 3>& cell, const Polygon& piece) {
            if (piece.size() >= 3) {
                pieces.push_back({cell, piece});
                middles.push_back(body.origin);
                for (const Vector3& x : piece) {
                    for (std::size_t a = 0; a < 3; ++a) {
                        middles.back()[a] += h * x[a] / static_cast<double>(piece.size());
                    }
                }
            }
        });
    }
    std::vector<std::uint32_t> number(lattice.cell_scales().size()); // of the body's cells
    for (std::size_t cell = 0, next = 0; cell < number.size(); ++cell) {
        number[cell] = static_cast<std::uint32_t>(next);
        next += lattice.cell_scales()[cell] > 0;
    }
    const auto corners = cell_corners(lattice);
    std::vector<double> areas(nodes, 0.0);
    std::vector<bool> loaded(nodes, false);
    const std::vector<std::uint32_t> chosen = std::holds_alternative<NodeRegion>(scene.loads[load].where)
                                                  ? std::vector<std::uint32_t>()
                                                  : select_nodes(middles, h, scene.loads[load].where);
    for (const std::uint32_t p : chosen) {
        const Polygon& polygon = pieces[p].polygon;
        for (std::size_t n = 1; n + 1 < polygon.size(); ++n) {
            const Vector3* const x[3] = {&polygon[0], &polygon[n], &polygon[n + 1]};
            const auto edge = [&](std::size_t to, std::size_t a) { return (*x[to])[a % 3] - polygon[0][a % 3]; };
            Vector3 cross{};
            for (std::size_t a = 0; a < 3; ++a) {
                cross[a] = edge(1, a + 1) * edge(2, a + 2) - edge(1, a + 2) * edge(2, a + 1);
            }
            const double third = h * h * std::hypot(cross[0], cross[1], cross[2]) / 6;
            for (std::size_t c = 0; c < 3; ++c) { // edges' middles: exact for squares
                Vector3 point{};
                for (std::size_t a = 0; a < 3; ++a) {
                    point[a] = 0.5 * ((*x[c])[a] + (*x[(c + 1) % 3])[a]);
                }
                const std::size_t cell = nearest_cell(lattice, pieces[p].cell, point);
                const auto nx = static_cast<std::size_t>(lattice.cells()[0]),
                           ny = static_cast<std::size_t>(lattice.cells()[1]);
                const std::array<std::size_t, 3> low = {cell % nx, cell / nx % ny, cell / nx / ny};
                for (std::size_t corner = 0; corner < 8; ++corner) {
                    double share = third;
                    for (std::size_t a = 0; a < 3; ++a) {
                        const double s = point[a] - static_cast<double>(low[a]);
                        share *= (corner >> a & 1) != 0 ? s : 1 - s;
                    }
                    const std::uint32_t node = corners[number[cell]][corner];
                    areas[node] += share;
                    loaded[node] = loaded[node] || share != 0;
                }
            }
        }
    }
    LoadedNodes found{.nodes = {}, .shares = {}, .sum = 1};
    for (std::uint32_t n = 0; n < nodes; ++n) {
        if (loaded[n]) {
            found.nodes.push_back(n);
            found.shares.push_back(areas[n]);
        }
    }
    if (found.nodes.empty()) {
        throw scene_error(scene, path, "no part of the body's surface lies in it, whose area a traction needs");
    }
    return found;
}

/// Of the cells whose centre is in the region, an eighth of the mass or volume to each corner.
LoadedNodes loaded_by_cells(const Scene& scene, const Lattice& lattice, std::span<const Vector3> rest,
                            std::size_t load) {
    const auto corners = cell_corners(lattice);
    std::vector<std::size_t> filled;
    for (std::size_t cell = 0; cell < lattice.cell_scales().size(); ++cell) {
        if (lattice.cell_scales()[cell] > 0) {
            filled.push_back(cell);
        }
    }
    std::vector<Vector3> centers;
    for (const auto& cell : corners) {
        Vector3& center = centers.emplace_back();
        for (std::size_t a = 0; a < 3; ++a) {
            center[a] = (rest[cell[0]][a] + rest[cell[7]][a]) / 2;
        }
    }
    const Load& given = scene.loads[load];
    const std::vector<std::uint32_t> chosen = std::holds_alternative<NodeRegion>(given.where)
                                                  ? std::vector<std::uint32_t>()
                                                  : select_nodes(centers, lattice.cell_size(), given.where);
    if (chosen.empty()) {
        throw scene_error(scene, "load[" + std::to_string(load) + "].where",
                          "no cell's centre lies in it, which a force by volume or mass needs");
    }
    std::map<std::uint32_t, double> shares;
    const double h = lattice.cell_size();
    for (const std::uint32_t c : chosen) {
        const double by = given.kind == LoadKind::acceleration
                              ? material_of(lattice, lattice.cell_tissue(filled[c]), scene.material).density
                              : 1;
        for (const std::uint32_t n : corners[c]) {
            shares[n] += by * static_cast<double>(lattice.cell_fill(filled[c])) * h * h * h / 8;
        }
    }
    LoadedNodes found{.nodes = {}, .shares = {}, .sum = 1};
    for (const auto& [n, share] : shares) {
        found.nodes.push_back(n);
        found.shares.push_back(share);
    }
    return found;
}

Vector3 cross(const Vector3& a, const Vector3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector3 product(const std::array<Vector3, 3>& rows, const Vector3& x) {
    Vector3 out{};
    for (std::size_t a = 0; a < 3; ++a) {
        out[a] = rows[a][0] * x[0] + rows[a][1] * x[1] + rows[a][2] * x[2];
    }
    return out;
}

/// With r = arm and w = share the force w t x r makes the moment sum w r x (t x r) = J t, J = sum w (r.r - r r^T), and
/// has no sum about the mean of w. False where no J inverse is: nodes on one line.
bool find_arms(std::span<const Vector3> rest, LoadedNodes& load) {
    Vector3 middle{};
    for (std::size_t i = 0; i < load.nodes.size(); ++i) {
        for (std::size_t a = 0; a < 3; ++a) {
            middle[a] += load.shares[i] / load.sum * rest[load.nodes[i]][a];
        }
    }
    std::array<Vector3, 3> inertia{};
    for (std::size_t i = 0; i < load.nodes.size(); ++i) {
        Vector3& r = load.arms.emplace_back();
        for (std::size_t a = 0; a < 3; ++a) {
            r[a] = rest[load.nodes[i]][a] - middle[a];
        }
        const double square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t b = 0; b < 3; ++b) {
                inertia[a][b] += load.shares[i] * ((a == b ? square : 0) - r[a] * r[b]);
            }
        }
    }
    // Symmetric, so that its cofactors are its adjugate.
    const std::array<Vector3, 3> cofactors = {cross(inertia[1], inertia[2]), cross(inertia[2], inertia[0]),
                                              cross(inertia[0], inertia[1])};
    const double determinant = product({inertia[0], {}, {}}, cofactors[0])[0];
    const double mean = (inertia[0][0] + inertia[1][1] + inertia[2][2]) / 3;
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
            load.inverse_inertia[a][b] = cofactors[a][b] / determinant;
        }
    }
    return determinant > 1e-9 * mean * mean * mean;
}

} // namespace

std::vector<double> PressedFaces::at(const Scene& scene, double time) const {
    std::vector<double> pressures;
    pressures.reserve(by.size());
    for (const std::uint32_t p : by) {
        pressures.push_back(value_at(scene.pressures[p].pressure, scene.pressures[p].pressure_in_time, time));
    }
    return pressures;
}

bool PressedFaces::changing(const Scene& scene) const {
    return std::any_of(scene.pressures.begin(), scene.pressures.end(),
                       [](const Pressure& pressure) { return !pressure.pressure_in_time.empty(); });
}

PressedFaces pressed_faces(const Scene& scene, const Lattice& lattice, const Supports& supports) {
    PressedFaces pressed;
    if (scene.pressures.empty()) {
        return pressed;
    }
    const std::vector<SurfaceFace> surface = surface_faces(lattice, scene.body.origin);
    std::vector<Vector3> middles;
    for (const SurfaceFace& face : surface) {
        middles.push_back(face.middle());
    }
    for (std::uint32_t p = 0; p < scene.pressures.size(); ++p) {
        const Region& where = scene.pressures[p].where;
        const std::vector<std::uint32_t> chosen = std::holds_alternative<NodeRegion>(where)
                                                      ? std::vector<std::uint32_t>()
                                                      : select_nodes(middles, lattice.cell_size(), where);
        if (chosen.empty()) {
            throw scene_error(scene, "pressure[" + std::to_string(p) + "].where",
                              "the middle of no outer face of a cell lies in it");
        }
        for (const std::uint32_t f : chosen) {
            pressed.faces.push_back(surface[f]);
            pressed.by.push_back(p);
        }
    }
    if (!explicit_in_time(scene.solver.method)) {
        Vector3 apex{};
        const std::vector<double> last = pressed.at(scene, std::numeric_limits<double>::infinity());
        const std::string why = PressureRim(pressed.faces).find_apex(last, supports.present(), apex);
        if (!why.empty()) {
            throw scene_error(scene, "pressure[0].where",
                              "with method = \"" + std::string(name(scene.solver.method)) +
                                  "\" pressed faces must close, or end where they are held: " + why);
        }
    }
    return pressed;
}

std::vector<RestStretch> ActuatedCells::at(const Scene& scene, double time, double part) const {
    std::vector<RestStretch> of_each;
    for (const Actuate& actuate : scene.actuations) {
        RestStretch& s = of_each.emplace_back(value_at(actuate.stretch, actuate.stretch_in_time, time));
        for (double& stretch : s) {
            stretch = part == 1 ? stretch : 1 + part * (stretch - 1);
        }
    }
    std::vector<RestStretch> stretches;
    stretches.reserve(by.size());
    for (const std::uint32_t a : by) {
        stretches.push_back(of_each[a]);
    }
    return stretches;
}

bool ActuatedCells::changing(const Scene& scene) const {
    return std::any_of(scene.actuations.begin(), scene.actuations.end(),
                       [](const Actuate& actuate) { return !actuate.stretch_in_time.empty(); });
}

ActuatedCells actuated_cells(const Scene& scene, const Lattice& lattice) {
    ActuatedCells actuated;
    if (scene.actuations.empty()) {
        return actuated;
    }
    std::vector<std::uint32_t> filled;
    std::vector<Vector3> centers;
    const std::array<int, 3>& count = lattice.cells();
    for (int k = 0; k < count[2]; ++k) {
        for (int j = 0; j < count[1]; ++j) {
            for (int i = 0; i < count[0]; ++i) {
                if (lattice.cell_scale(i, j, k) > 0) {
                    filled.push_back(static_cast<std::uint32_t>(lattice.cell_index(i, j, k)));
                    const std::array<double, 3> place = {i + 0.5, j + 0.5, k + 0.5};
                    Vector3& center = centers.emplace_back(scene.body.origin);
                    for (std::size_t a = 0; a < 3; ++a) {
                        center[a] += lattice.cell_size() * place[a];
                    }
                }
            }
        }
    }
    std::vector<std::int64_t> owner(filled.size(), -1);
    for (std::uint32_t a = 0; a < scene.actuations.size(); ++a) {
        const Actuate& given = scene.actuations[a];
        const std::string path = "actuate[" + std::to_string(a) + "].";
        std::vector<std::uint32_t> chosen(filled.size());
        std::iota(chosen.begin(), chosen.end(), 0u);
        if (given.where) {
            chosen = std::holds_alternative<NodeRegion>(*given.where)
                         ? std::vector<std::uint32_t>()
                         : select_nodes(centers, lattice.cell_size(), *given.where);
        }
        if (given.label) {
            const std::vector<std::uint8_t>& labels = scene.body.labels;
            std::erase_if(chosen,
                          [&](std::uint32_t c) { return (labels.empty() ? 1 : labels[filled[c]]) != *given.label; });
        }
        if (chosen.empty()) {
            throw scene_error(scene, path + (given.where ? "where" : "label"),
                              "the body has no cell whose centre lies in it and that has the label, if one is given");
        }
        for (const std::uint32_t c : chosen) {
            if (owner[c] >= 0) {
                throw scene_error(scene, path + (given.where ? "where" : "label"),
                                  printed("a cell may be in one [[actuate]]: that around (%g, %g, %g) m is in "
                                          "actuate[%d] too",
                                          centers[c][0], centers[c][1], centers[c][2], static_cast<int>(owner[c])));
            }
            owner[c] = a;
            actuated.cells.push_back(filled[c]);
            actuated.by.push_back(a);
        }
    }
    return actuated;
}

double stiffening_by_actuation(const Scene& scene) {
    double greatest = 1;
    const auto look_at = [&](double x, double y, double z) {
        const double least = std::min({x, y, z});
        greatest = std::max(greatest, x * y * z / (least * least));
    };
    for (const Actuate& actuate : scene.actuations) {
        if (actuate.stretch_in_time.empty()) {
            look_at(actuate.stretch[0], actuate.stretch[1], actuate.stretch[2]);
        }
        for (const auto& [time, x, y, z] : actuate.stretch_in_time) {
            look_at(x, y, z);
        }
    }
    return greatest;
}

namespace {

/// How many cells touch a node, by their fills.
std::vector<double> cells_at_nodes(const Lattice& lattice, std::span<const std::array<std::uint32_t, 8>> all,
                                   std::size_t nodes) {
    std::vector<double> cells_at(nodes, 0.0);
    std::size_t cell = 0;
    for (const auto& corners : all) {
        while (!(lattice.cell_scales()[cell] > 0)) {
            ++cell;
        }
        for (const auto n : corners) {
            cells_at[static_cast<std::size_t>(n)] += static_cast<double>(lattice.cell_fill(cell));
        }
        ++cell;
    }
    return cells_at;
}

} // namespace

std::vector<LoadedNodes> loaded_nodes(const Scene& scene, const Lattice& lattice, std::span<const Vector3> rest,
                                      const Network* network, std::span<const std::array<std::uint32_t, 8>> corners) {
    if (scene.loads.empty()) {
        return {};
    }
    const std::vector<double> cells_at = !corners.empty() ? cells_at_nodes(lattice, corners, rest.size())
                                         : network        ? network->masses
                                                          : cells_at_nodes(lattice, cell_corners(lattice), rest.size());
    std::vector<LoadedNodes> all(scene.loads.size());
    for (std::size_t l = 0; l < all.size(); ++l) {
        const LoadKind kind = scene.loads[l].kind;
        if (kind == LoadKind::traction) {
            all[l] = loaded_by_area(scene, lattice, rest.size(), l);
            continue;
        }
        if (kind == LoadKind::acceleration || kind == LoadKind::force_density) {
            all[l] = loaded_by_cells(scene, lattice, rest, l);
            continue;
        }
        const std::string path = "load[" + std::to_string(l) + "].where";
        all[l].nodes = nodes_of(scene, rest, scene.loads[l].where, path);
        for (const std::uint32_t n : all[l].nodes) {
            all[l].shares.push_back(cells_at[n]);
            all[l].sum += cells_at[n];
        }
        if (kind == LoadKind::moment && !find_arms(rest, all[l])) {
            throw scene_error(scene, path, "its nodes lie on one line, and cannot bear a moment");
        }
    }
    return all;
}

void set_nodal_loads(const Scene& scene, std::span<const LoadedNodes> loaded, double time, std::span<Vector3> forces) {
    for (const LoadedNodes& load : loaded) {
        for (const std::uint32_t n : load.nodes) {
            forces[n] = {0, 0, 0};
        }
    }
    for (std::size_t l = 0; l < loaded.size(); ++l) {
        const Vector3 force = value_at(scene.loads[l].force, scene.loads[l].force_in_time, time);
        if (!loaded[l].arms.empty()) {
            const Vector3 turn = product(loaded[l].inverse_inertia, force);
            for (std::size_t i = 0; i < loaded[l].nodes.size(); ++i) {
                const Vector3 along = cross(turn, loaded[l].arms[i]);
                for (std::size_t a = 0; a < 3; ++a) {
                    forces[loaded[l].nodes[i]][a] += loaded[l].shares[i] * along[a];
                }
            }
            continue;
        }
        for (std::size_t i = 0; i < loaded[l].nodes.size(); ++i) {
            for (std::size_t a = 0; a < 3; ++a) {
                forces[loaded[l].nodes[i]][a] += force[a] * loaded[l].shares[i] / loaded[l].sum;
            }
        }
    }
}

std::vector<Vector3> nodal_loads(const Scene& scene, std::span<const LoadedNodes> loaded, std::size_t nodes,
                                 double time) {
    std::vector<Vector3> forces(scene.loads.empty() ? 0 : nodes, Vector3{0, 0, 0});
    set_nodal_loads(scene, loaded, time, forces);
    return forces;
}

double end_of_tables(const Scene& scene) {
    double end = -std::numeric_limits<double>::infinity();
    const auto look_at = [&end](const auto& table) { end = table.empty() ? end : std::max(end, table.back()[0]); };
    look_at(scene.gravity.acceleration_in_time);
    for (const Load& load : scene.loads) {
        look_at(load.force_in_time);
    }
    for (const Pressure& pressure : scene.pressures) {
        look_at(pressure.pressure_in_time);
    }
    for (const Actuate& actuate : scene.actuations) {
        look_at(actuate.stretch_in_time);
    }
    return end;
}

std::vector<Vector3> start_velocities(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> begin,
                                      std::span<const double> masses, const Supports& supports) {
    std::vector<Vector3> velocities(rest.size(), Vector3{0, 0, 0});
    std::vector<std::size_t> given(rest.size(), scene.starts.size());
    for (std::size_t s = 0; s < scene.starts.size(); ++s) {
        const Start& start = scene.starts[s];
        std::vector<std::uint32_t> nodes(rest.size());
        std::iota(nodes.begin(), nodes.end(), 0u);
        if (start.where) {
            nodes = nodes_of(scene, rest, *start.where, "start[" + std::to_string(s) + "].where");
        }
        double mass = 0;
        Vector3 center{};
        for (const std::uint32_t n : nodes) {
            mass += masses[n];
            for (std::size_t a = 0; a < 3; ++a) {
                center[a] += masses[n] * begin[n][a];
            }
        }
        for (const std::uint32_t n : nodes) {
            const Vector3& w = start.angular_velocity;
            Vector3 r{};
            for (std::size_t a = 0; a < 3; ++a) {
                r[a] = begin[n][a] - center[a] / mass;
            }
            for (std::size_t a = 0; a < 3; ++a) {
                const std::size_t i = (a + 1) % 3, j = (a + 2) % 3;
                velocities[n][a] = start.velocity[a] + w[i] * r[j] - w[j] * r[i];
            }
            given[n] = s;
        }
    }
    const std::span<const PrescribedNode> held = supports.present();
    for (std::size_t h = 0; h < held.size(); ++h) {
        const std::uint32_t n = held[h].node;
        Vector3& v = velocities[n];
        const double rounding = 1e-9 * std::hypot(v[0], v[1], v[2]);
        for (std::size_t a = 0; a < 3; ++a) {
            if (!holds(held[h].axes, a)) {
                continue;
            }
            if (std::abs(v[a] - held[h].velocity[a]) > rounding) {
                const Vector3& w = scene.starts[given[n]].angular_velocity;
                throw scene_error(
                    scene, "start[" + std::to_string(given[n]) + (w == Vector3{} ? "].velocity" : "].angular_velocity"),
                    printed("node %u would begin with %g m/s along %c, where %s holds it; {of = ..., without = [...]} "
                            "leaves nodes out of where",
                            n, v[a], "xyz"[a], line_of(scene, Supports::path_of(supports.holders()[h].by[a])).c_str()));
            }
            v[a] = held[h].velocity[a];
        }
    }
    return velocities;
}

namespace {

/// What holds the nodes of one layer across an axis, and how far it turns them about the axis.
struct Plate {
    double height = 0; ///< m along the axis, at rest
    double degrees = 0;
};

std::optional<Plate> plate(const Scene& scene, std::span<const Vector3> rest, const Region& where, AxisSet axes,
                           std::size_t axis, double degrees) {
    const std::vector<std::uint32_t> nodes = select_nodes(rest, scene.body.cell_size, where);
    if (nodes.empty() || (axes | 1u << axis) != kAllAxes) {
        return std::nullopt;
    }
    const auto [low, high] = std::minmax_element(
        nodes.begin(), nodes.end(), [&](std::uint32_t a, std::uint32_t b) { return rest[a][axis] < rest[b][axis]; });
    if (rest[*high][axis] - rest[*low][axis] > 0.5 * scene.body.cell_size) {
        return std::nullopt;
    }
    return Plate{rest[*low][axis], degrees};
}

std::vector<Plate> plates_across(const Scene& scene, std::span<const Vector3> rest, std::size_t axis) {
    std::vector<Plate> plates;
    const auto add = [&](const std::optional<Plate>& found) {
        if (found) {
            plates.push_back(*found);
        }
    };
    for (const Fix& fix : scene.fixes) {
        add(plate(scene, rest, fix.where, fix.axes, axis, 0));
    }
    for (const Move& move : scene.moves) {
        const Rotation* const rotation = std::get_if<Rotation>(&move.motion);
        if (rotation == nullptr || static_cast<std::size_t>(rotation->axis) == axis) {
            add(plate(scene, rest, move.where, move.axes, axis, rotation != nullptr ? rotation->degrees : 0));
        }
    }
    return plates;
}

/// By how many degrees the layers turn from one height to another: the sum of the turns from layer to layer, each at
/// most half a turn.
double twist(std::span<const Vector3> rest, std::span<const Vector3> displacements, std::size_t axis, double from,
             double to, double cell_size) {
    const std::size_t i = (axis + 1) % 3, j = (axis + 2) % 3;
    struct Layer {
        double nodes = 0, rest[2] = {0, 0}, moved[2] = {0, 0}; ///< sums, then means
        double cross = 0, dot = 0;
    };
    std::vector<Layer> layers(static_cast<std::size_t>(std::lround((to - from) / cell_size)) + 1);
    const auto for_each_node = [&](const auto& visit) {
        for (std::size_t n = 0; n < rest.size(); ++n) {
            const long layer = std::lround((rest[n][axis] - from) / cell_size);
            if (layer >= 0 && layer < static_cast<long>(layers.size())) {
                visit(layers[static_cast<std::size_t>(layer)], rest[n], displacements[n]);
            }
        }
    };
    for_each_node([&](Layer& layer, const Vector3& x, const Vector3& u) {
        layer.nodes += 1;
        layer.rest[0] += x[i];
        layer.rest[1] += x[j];
        layer.moved[0] += x[i] + u[i];
        layer.moved[1] += x[j] + u[j];
    });
    for_each_node([&](Layer& layer, const Vector3& x, const Vector3& u) {
        const double a[2] = {x[i] - layer.rest[0] / layer.nodes, x[j] - layer.rest[1] / layer.nodes};
        const double b[2] = {x[i] + u[i] - layer.moved[0] / layer.nodes, x[j] + u[j] - layer.moved[1] / layer.nodes};
        layer.cross += a[0] * b[1] - a[1] * b[0];
        layer.dot += a[0] * b[0] + a[1] * b[1];
    });
    double sum = 0;
    for (std::size_t k = 1; k < layers.size(); ++k) {
        const Layer &before = layers[k - 1], &now = layers[k];
        sum += std::atan2(now.cross * before.dot - now.dot * before.cross,
                          now.dot * before.dot + now.cross * before.cross);
    }
    return sum * 180 / std::numbers::pi;
}

} // namespace

std::string lost_turns(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> displacements) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        std::vector<Plate> plates = plates_across(scene, rest, axis);
        std::sort(plates.begin(), plates.end(), [](const Plate& a, const Plate& b) { return a.height < b.height; });
        for (std::size_t p = 1; p < plates.size(); ++p) {
            const Plate &low = plates[p - 1], &high = plates[p];
            const double led = high.degrees - low.degrees;
            if (std::abs(led) <= 180 || high.height - low.height < 0.5 * scene.body.cell_size) {
                continue;
            }
            const double found = twist(rest, displacements, axis, low.height, high.height, scene.body.cell_size);
            if (std::abs(found - led) > 90) {
                return printed("the plates turn by %.6g degrees against each other, and the state that was found is "
                               "twisted by %.6g: cells have slipped through each other on the way",
                               led, found);
            }
        }
    }
    return "";
}

} // namespace hybmss
