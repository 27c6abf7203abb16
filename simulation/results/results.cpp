#include "simulation/results/results.hpp"

#include "layouts/messages.hpp"
#include "simulation/geometry/cells.hpp"
#include "simulation/results/vtu_file.hpp"
#include "simulation/scene/other_cells.hpp"
#include "simulation/scene/scene_body.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

namespace hybmss {
namespace {

void require_finite(const std::vector<Vector3>& values, const char* what) {
    for (const Vector3& v : values) {
        if (!std::isfinite(v[0] + v[1] + v[2])) {
            throw NotFinite(std::string(what) + " is not finite: not written");
        }
    }
}

void require_finite(const std::vector<ProbeReading>& probes) {
    for (const ProbeReading& probe : probes) {
        const std::string name = "probe \"" + probe.name + "\": the ";
        require_finite({probe.force}, (name + "force").c_str());
        require_finite({probe.torque}, (name + "torque").c_str());
        require_finite({probe.mean_displacement}, (name + "mean displacement").c_str());
    }
}

/// Takes out the nodes that no cell touches, and numbers the cells' corners accordingly.
void drop_bare_nodes(std::span<std::vector<Vector3>* const> vectors, std::vector<double>& mass,
                     std::vector<std::array<std::uint32_t, 8>>& cells) {
    const std::size_t nodes = vectors[0]->size();
    std::vector<std::uint32_t> number(nodes, 0);
    for (const auto& cell : cells) {
        for (const std::uint32_t n : cell) {
            number[n] = 1;
        }
    }
    const auto drop = [&number](auto& values) { // an array that is not wanted is empty
        std::size_t kept = 0;
        for (std::size_t n = 0; n < values.size(); ++n) {
            if (number[n] != 0) {
                values[kept++] = values[n];
            }
        }
        values.resize(kept);
    };
    for (std::vector<Vector3>* const values : vectors) {
        drop(*values);
    }
    drop(mass);
    for (std::uint32_t kept = 0; std::uint32_t & n : number) {
        n = n != 0 ? kept++ : 0;
    }
    for (auto& cell : cells) {
        std::transform(cell.begin(), cell.end(), cell.begin(), [&](std::uint32_t n) { return number[n]; });
    }
}

void append(std::string& row, const Vector3& values) {
    for (double v : values) {
        row += printed(",%.9g", v);
    }
}

std::string frame_name(std::size_t frame) {
    return printed("body_%04zu.vtu", frame);
}
} // namespace

std::string mode_name(std::size_t mode) {
    return printed("mode_%04zu.vtu", mode);
}

namespace {

/// The kinds of a skin's file, in the order of SkinFile.
struct SkinKind {
    std::string_view ending, beginning;
    void (*write)(const std::filesystem::path&, const VtpMesh&);
};
constexpr SkinKind kSkinKinds[] = {
    {".vtp", kVtpBeginning, write_vtp}, {".obj", kObjBeginning, write_obj}, {".ply", kPlyBeginning, write_ply}};

const SkinKind& kind_of(SkinFile file) {
    return kSkinKinds[static_cast<std::size_t>(file) - 1];
}

/// The skin's file beside a frame's.
std::string skin_name(const std::string& frame, const SkinKind& kind) {
    return "skin" + frame.substr(4, frame.size() - 8) + std::string(kind.ending);
}

/// Removes those of an earlier run from `first` on: files that have a frame's very name and begin as its writer does.
void remove_frames(const std::filesystem::path& directory, std::size_t first) {
    std::vector<std::filesystem::path> stale;
    for (const auto& entry : std::filesystem::directory_iterator(directory)) {
        std::size_t frame = 0;
        const std::string name = entry.path().filename().string();
        const bool of_mode = name.starts_with("mode_");
        if (std::sscanf(name.c_str() + std::min<std::size_t>(5, name.size()), "%zu", &frame) != 1 ||
            (!of_mode && frame < first) || entry.symlink_status().type() != std::filesystem::file_type::regular) {
            continue;
        }
        const auto* const kind = std::ranges::find_if(
            kSkinKinds, [&](const SkinKind& k) { return name == skin_name(frame_name(frame), k); });
        const bool of_skin = kind != std::end(kSkinKinds);
        if (of_skin || name == (of_mode ? mode_name(frame) : frame_name(frame))) {
            const std::string_view ours = of_skin ? kind->beginning : kVtuBeginning;
            std::string beginning(ours.size(), ' ');
            std::ifstream(entry.path(), std::ios::binary).read(beginning.data(), std::ssize(beginning));
            if (beginning == ours) {
                stale.push_back(entry.path());
            }
        }
    }
    for (const std::filesystem::path& path : stale) {
        remove_file(path);
    }
}

/// A body's mesh after cuts: without the triangles of cells that are gone, with the faces that they have laid bare.
TriangleMesh cut_mesh(const TriangleMesh& mesh, const Lattice& whole, const Lattice& cut) {
    using Corners = std::array<Vector3, 3>;
    const auto corners = [](const TriangleMesh& of, const std::array<std::uint32_t, 3>& t) {
        return Corners{of.vertices[t[0]], of.vertices[t[1]], of.vertices[t[2]]};
    };
    const TriangleMesh before = boundary_mesh(whole), after = boundary_mesh(cut);
    std::set<Corners> known;
    for (const auto& triangle : before.triangles) {
        known.insert(corners(before, triangle));
    }
    TriangleMesh left = {mesh.vertices, Skin<double>(whole, mesh).triangles_left(cut)};
    const auto first = static_cast<std::uint32_t>(left.vertices.size());
    left.vertices.insert(left.vertices.end(), after.vertices.begin(), after.vertices.end());
    for (const auto& t : after.triangles) {
        if (!known.contains(corners(after, t))) {
            left.triangles.push_back({first + t[0], first + t[1], first + t[2]});
        }
    }
    return left;
}

using Matrix = std::array<double, 9>; ///< row by row

/// A rotation that takes the y axis into an axis of any length, or its opposite, which is as good: half a turn about
/// the line between both.
Matrix from_y_to(Vector3 axis) {
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    if (!(length > 0)) {
        return {1, 0, 0, 0, 1, 0, 0, 0, 1};
    }
    const double sign = axis[1] < 0 ? -1 : 1;
    const Vector3 n = {sign * axis[0] / length, 1 + sign * axis[1] / length, sign * axis[2] / length};
    const double square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    Matrix r{};
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
            r[3 * a + b] = 2 * n[a] * n[b] / square - (a == b ? 1 : 0);
        }
    }
    return r;
}

Matrix product(const Matrix& a, const Matrix& b) {
    Matrix c{};
    for (std::size_t i = 0; i < 9; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            c[i] += a[i / 3 * 3 + k] * b[3 * k + i % 3];
        }
    }
    return c;
}

} // namespace

std::vector<VtuObstacle> drawn_obstacles(const Simulation& simulation) {
    const std::vector<RigidPose> poses = simulation.obstacle_poses();
    std::vector<VtuObstacle> drawn;
    for (std::size_t o = 0; o < poses.size(); ++o) {
        const ObstacleShape& shape = simulation.scene().obstacles[o].shape;
        Vector3 size{};
        std::array<double, 9> rotation = poses[o].rotation;
        if (const auto* plane = std::get_if<PlaneShape>(&shape)) {
            size = plane->normal;
        } else if (const auto* sphere = std::get_if<SphereShape>(&shape)) {
            size = {sphere->radius, 0, 0};
        } else if (const auto* box = std::get_if<BoxShape>(&shape)) {
            size = box->size;
        } else if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
            const double length = std::hypot(capsule->axis[0], capsule->axis[1], capsule->axis[2]);
            size = {capsule->radius, length, 0};
            rotation = product(rotation, from_y_to(capsule->axis));
        }
        drawn.push_back({static_cast<double>(shape.index()), size, poses[o].position, rotation});
    }
    return drawn;
}

VtuStress vtu_stress(std::span<const CellStress> stresses, std::span<const std::array<std::uint32_t, 8>> cells,
                     std::size_t points) {
    const std::size_t count = cells.size();
    VtuStress drawn = {std::vector<std::array<double, 6>>(count),
                       std::vector<std::array<double, 6>>(count),
                       std::vector<double>(count),
                       std::vector<double>(count),
                       std::vector<double>(count),
                       std::vector<double>(points)};
    std::vector<CellStress> sums(points);
    std::vector<double> around(points, 0.0);
    for (std::size_t n = 0; n < count; ++n) {
        const CellStress& stress = stresses[n];
        drawn.cauchy_stress[n] = stress.cauchy;
        drawn.green_strain[n] = stress.green_strain;
        drawn.von_mises[n] = stress.von_mises();
        drawn.pressure[n] = stress.pressure();
        drawn.energy_density[n] = stress.energy_density;
        if (!std::isfinite(drawn.von_mises[n] + stress.pressure() + stress.energy_density)) {
            throw NotFinite("stress is not finite: not written");
        }
        for (const std::uint32_t point : cells[n]) {
            around[point] += 1;
            for (std::size_t s = 0; s < 6; ++s) {
                sums[point].cauchy[s] += stress.cauchy[s];
            }
        }
    }
    for (std::size_t p = 0; p < points; ++p) {
        drawn.at_points[p] = around[p] > 0 ? sums[p].von_mises() / around[p] : 0; // of the first degree in the stress
    }
    return drawn;
}

OwnedDirectory::OwnedDirectory(std::filesystem::path path) : path_(std::move(path)) {
    std::error_code error;
    std::filesystem::create_directories(path_, error);
    if (error) {
        throw std::runtime_error(path_.string() + ": this directory cannot be made: " + error.message());
    }
    // The lock goes with the process. Where the file system has none, there is none.
    descriptor_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor_ >= 0 && flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        close(descriptor_);
        throw std::runtime_error(path_.string() + ": is in use by another run");
    }
}

OwnedDirectory::~OwnedDirectory() {
    if (descriptor_ >= 0) {
        close(descriptor_);
    }
}

Results::Results(std::filesystem::path directory, const Simulation& simulation, const std::string& before)
    : owned_(std::move(directory)), directory_(owned_.path()), simulation_(simulation), cells_(simulation.cell_nodes()),
      cut_cells_(simulation.removed_cell_count()), parted_faces_(simulation.parted_face_count()),
      probes_(directory_ / "probes.csv") {
    for (const char* name : {"summary.json", "body.pvd", "skin.pvd", "probes.csv"}) {
        remove_file(directory_ / name);
    }
    probes_.stream() << "time";
    for (const Probe& probe : simulation.scene().probes) {
        for (const char* quantity : {"force", "torque", "mean_displacement"}) {
            for (char axis : {'x', 'y', 'z'}) {
                probes_.stream() << "," << probe.name << "." << quantity << "." << axis;
            }
        }
    }
    for (const SceneObstacle& obstacle : simulation.scene().obstacles) {
        for (const char* quantity : {"force", "torque", "impulse"}) {
            for (char axis : {'x', 'y', 'z'}) {
                probes_.stream() << ",obstacles." << obstacle.name << "." << quantity << "." << axis;
            }
        }
        for (const char* quantity : {"nodes", "depth", "energy", "dissipated"}) {
            probes_.stream() << ",obstacles." << obstacle.name << "." << quantity;
        }
        for (const char* quantity : {"position", "velocity"}) {
            for (char axis : {'x', 'y', 'z'}) {
                if (obstacle.mass > 0) {
                    probes_.stream() << ",obstacles." << obstacle.name << "." << quantity << "." << axis;
                }
            }
        }
    }
    probes_.stream() << "\n";
    // The times of the frames, a line each; an empty line; the rows of probes.csv.
    std::size_t at = 0;
    for (std::size_t end = 0; (end = before.find('\n', at)) != std::string::npos; at = end + 1) {
        if (end == at) {
            rows_ = before.substr(end + 1);
            break;
        }
        frames_.push_back({std::strtod(before.c_str() + at, nullptr), frame_name(frames_.size())});
    }
    probes_.stream() << rows_;
    remove_frames(directory_, frames_.size());
}

std::string Results::state() const {
    std::string text;
    for (const PvdFrame& frame : frames_) {
        text += printed("%a\n", frame.time); // in hexadecimal: every bit
    }
    return text + "\n" + rows_;
}

void Results::record() {
    std::vector<Vector3> u = simulation_.displacements(), v = simulation_.velocities();
    require_finite(u, "displacement");
    require_finite(v, "velocity");
    const std::vector<ProbeReading> probes = simulation_.probes();
    require_finite(probes);
    const Output& wanted = simulation_.scene().output;
    std::vector<double> mass;
    if (wanted.mass) {
        mass.assign(simulation_.masses().begin(), simulation_.masses().end());
    }
    std::vector<Vector3> reaction = wanted.reaction ? simulation_.reactions() : std::vector<Vector3>();
    require_finite(reaction, "reaction");
    std::vector<Vector3> contact = wanted.reaction && !simulation_.scene().obstacles.empty()
                                       ? simulation_.contact_forces()
                                       : std::vector<Vector3>();
    require_finite(contact, "contact");
    if (cut_cells_ != simulation_.removed_cell_count() || parted_faces_ != simulation_.parted_face_count()) {
        cells_ = simulation_.cell_nodes();
        cut_cells_ = simulation_.removed_cell_count();
        parted_faces_ = simulation_.parted_face_count();
    }
    const std::vector<double> ratios = ratios_of(u);
    const std::string name = frame_name(frames_.size());
    std::vector<std::uint8_t> labels;
    std::vector<float> fills;
    if (simulation_.other_cells() == nullptr) {
        const Lattice& lattice = simulation_.lattice();
        labels = values_of_cells(lattice, std::span<const std::uint8_t>(simulation_.scene().body.labels));
        fills = values_of_cells(lattice, lattice.fills());
    }
    const std::span<const Vector3> rest = simulation_.rest_positions();
    std::vector<Vector3> points(rest.begin(), rest.end());
    for (std::size_t n = 0; n < points.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            points[n][a] += u[n][a];
        }
    }
    const std::vector<VtuObstacle> obstacles = drawn_obstacles(simulation_);
    std::vector<std::array<std::uint32_t, 8>> renumbered;
    if (cut_cells_ > 0) {
        renumbered = cells_;
        drop_bare_nodes(std::array{&points, &u, &v, &reaction, &contact}, mass, renumbered);
    }
    const auto& cells = cut_cells_ > 0 ? renumbered : cells_;
    VtuStress stress;
    if (wanted.stress) {
        stress = vtu_stress(simulation_.cell_stresses(), cells, points.size());
    }
    write_vtu(directory_ / name, {points, cells, u, v, ratios, labels, fills, obstacles, mass, reaction, contact,
                                  wanted.stress ? &stress : nullptr, polyhedra()});
    if (wanted.skin != SkinFile::none) {
        write_skin(simulation_.displacements());
    }
    frames_.push_back({simulation_.time(), name});

    std::string row = printed("%.9g", simulation_.time());
    for (const ProbeReading& probe : probes) {
        append(row, probe.force);
        append(row, probe.torque);
        append(row, probe.mean_displacement);
    }
    for (const NamedObstacleReading& obstacle : simulation_.obstacles()) {
        const ObstacleReading& reading = obstacle.reading;
        append(row, reading.force);
        append(row, reading.torque);
        append(row, reading.impulse);
        row += printed(",%zu,%.9g,%.9g,%.9g", reading.nodes, reading.depth, reading.energy, reading.dissipated);
        if (obstacle.pose) {
            append(row, obstacle.pose->position);
            append(row, obstacle.pose->velocity);
        }
    }
    row += "\n";
    probes_.stream() << row;
    rows_ += row;
}

std::vector<double> Results::ratios_of(std::span<const Vector3> displacements) const {
    if (const FittedCells* const other = simulation_.other_cells()) {
        return volume_ratios(other->network.polyhedra, simulation_.rest_positions(), displacements);
    }
    std::vector<double> ratios;
    ratios.reserve(cells_.size());
    for (const auto& cell : cells_) {
        ratios.push_back(1 + volume_ratio_minus_one(displacements, cell, simulation_.lattice().cell_size()));
    }
    return ratios;
}

std::span<const Network::Polyhedron> Results::polyhedra() const {
    const FittedCells* const other = simulation_.other_cells();
    return other ? std::span<const Network::Polyhedron>(other->network.polyhedra)
                 : std::span<const Network::Polyhedron>();
}

void Results::write_skin(std::span<const Vector3> displacements) {
    const Scene& scene = simulation_.scene();
    if (!skin_ || skin_cut_cells_ != cut_cells_) {
        const Lattice whole = scene_lattice(scene);
        const TriangleMesh& given = scene.body.mesh;
        const bool of_cells = given.triangles.empty() || (scene.output.smooth && scene.body.fractions);
        skin_mesh_ = of_cells ? (scene.output.smooth ? smooth_boundary_mesh : boundary_mesh)(simulation_.lattice())
                     : cut_cells_ > 0 ? cut_mesh(given, whole, simulation_.lattice())
                                      : given;
        skin_.emplace(whole, skin_mesh_);
        skin_cut_cells_ = cut_cells_;
    }
    std::vector<Vector3> points(skin_->vertex_count()), normals(points.size());
    skin_->update(VectorField<const double>::aos(displacements.data()->data(), displacements.size()),
                  VectorField<double>::aos(points.data()->data(), points.size()),
                  VectorField<double>::aos(normals.data()->data(), normals.size()));
    for (Vector3& point : points) {
        for (std::size_t a = 0; a < 3; ++a) {
            point[a] += scene.body.origin[a];
        }
    }
    const SkinKind& kind = kind_of(scene.output.skin);
    kind.write(directory_ / skin_name(frame_name(frames_.size()), kind), {points, normals, skin_mesh_.triangles});
}

void Results::write_modes(const Summary& summary) {
    const std::vector<Vector3> u = simulation_.displacements();
    const std::span<const Vector3> rest = simulation_.rest_positions();
    const std::vector<Vector3> velocities(rest.size(), {0, 0, 0});
    for (std::size_t m = 0; m < summary.modes.size(); ++m) {
        const std::vector<Vector3>& shape = summary.modes[m].shape;
        std::vector<Vector3> points(rest.begin(), rest.end()), moved = u;
        for (std::size_t n = 0; n < points.size(); ++n) {
            for (std::size_t a = 0; a < 3; ++a) {
                moved[n][a] += shape[n][a];
                points[n][a] += moved[n][a];
            }
        }
        const std::vector<double> ratios = ratios_of(moved);
        write_vtu(directory_ / mode_name(m),
                  {points, cells_, shape, velocities, ratios, {}, {}, {}, {}, {}, {}, nullptr, polyhedra()});
    }
}

void Results::finish(const Summary& summary) {
    const std::string text = summary_json(summary); // first: where it is refused, nothing is put in place
    write_modes(summary);
    std::erase_if(frames_, [&](const auto& frame) { return !std::filesystem::exists(directory_ / frame.file); });
    write_pvd(directory_ / "body.pvd", frames_);
    if (simulation_.scene().output.skin == SkinFile::vtp) {
        std::vector<PvdFrame> skins;
        for (const PvdFrame& frame : frames_) {
            skins.push_back({frame.time, skin_name(frame.file, kind_of(SkinFile::vtp))});
        }
        write_pvd(directory_ / "skin.pvd", skins);
    }
    probes_.commit();
    write_file(directory_ / "summary.json", text);
}

WorldResults::WorldResults(std::filesystem::path directory, const WorldSimulation& world)
    : owned_(std::move(directory)), world_(world) {
    for (const char* name : {"summary.json", "bodies.pvd"}) {
        remove_file(owned_.path() / name);
    }
    for (std::size_t b = 0; b < world.body_count(); ++b) {
        bodies_.emplace_back(owned_.path() / world.name(b), world.body(b));
    }
}

void WorldResults::record() {
    for (Results& body : bodies_) {
        body.record();
    }
}

void WorldResults::finish(const WorldSummary& summary) {
    const std::string text = summary_json(summary);
    std::vector<PvdFrame> frames;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        bodies_[b].finish(summary.bodies[b]);
        for (const PvdFrame& frame : bodies_[b].frames()) {
            frames.push_back({frame.time, world_.name(b) + "/" + frame.file, static_cast<int>(b)});
        }
    }
    std::stable_sort(frames.begin(), frames.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
    write_pvd(owned_.path() / "bodies.pvd", frames);
    write_file(owned_.path() / "summary.json", text);
}

} // namespace hybmss
