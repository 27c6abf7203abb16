#include "app/verify/bodies.hpp"

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/force_plan.hpp"
#include "hybmss/skin.hpp"
#include "hybmss/stress.hpp"
#include "reference/forces.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <random>
#include <utility>

namespace hybmss::verify {
namespace {

using Eigen::Vector3d;

constexpr double kFailed = std::numeric_limits<double>::infinity();

/// A function of displacements that remembers its values: the plans of one body are all asked at the same few places.
template <class Value>
class Remembered {
public:
    template <class Compute>
    const Value& at(const std::vector<Vector3d>& u, const Compute& compute) {
        const auto known = std::find_if(values_.begin(), values_.end(), [&](const auto& v) { return v.first == u; });
        return known != values_.end() ? known->second : values_.emplace_back(u, compute()).second;
    }

private:
    std::deque<std::pair<std::vector<Vector3d>, Value>> values_;
};

/// What the reference says of one body, which takes it longer than all kernels together.
class ReferenceValues {
public:
    explicit ReferenceValues(const reference::Body& body) : body_(body) {}

    const std::vector<Vector3d>& forces(const std::vector<Vector3d>& u) {
        return forces_.at(u, [&] { return reference::forces(body_, u); });
    }
    const std::vector<double>& force_scale(const std::vector<Vector3d>& u) {
        return force_scale_.at(u, [&] { return reference::force_scale(body_, u); });
    }
    double energy(const std::vector<Vector3d>& u) {
        return energy_.at(u, [&] { return reference::energy(body_, u).total(); });
    }
    const std::vector<Eigen::Matrix3d>& hessian_diagonal(const std::vector<Vector3d>& u) {
        return diagonal_.at(u, [&] { return reference::hessian_diagonal(body_, u); });
    }
    /// At the velocities v, which follow from u.
    const std::vector<Vector3d>& damping_forces(double seconds, const std::vector<Vector3d>& u,
                                                const std::vector<Vector3d>& v) {
        return damping_.at(u, [&] { return reference::damping_forces(body_, seconds, u, v); });
    }

private:
    const reference::Body& body_;
    Remembered<std::vector<Vector3d>> forces_, damping_;
    Remembered<std::vector<double>> force_scale_;
    Remembered<double> energy_;
    Remembered<std::vector<Eigen::Matrix3d>> diagonal_;
};

/// One plan and what its checks need.
template <class T>
struct Subject {
    const TestBody& body;
    const reference::Body& reference;
    ReferenceValues& expected;
    ReferenceValues& grown; ///< of a lattice whose cells have all grown alike
    const ForcePlan<T>& plan;
    RowKey key;
    RowTable& table;

    void record(const char* check, double error) {
        key.check = check;
        table.record(key, error, body.name + ", " + body.variant);
    }
    std::vector<Vector3d> forces(const std::vector<Vector3d>& u,
                                 Arrangement arrangement = Arrangement::separate_arrays) {
        NodeArray<T> in(arrangement, u);
        NodeArray<T> out(arrangement, u.size());
        plan.add_forces(in.field(), out.field());
        return out.vectors();
    }
    double greatest_scale(const std::vector<Vector3d>& u) const {
        const std::vector<double>& scales = expected.force_scale(u);
        return *std::max_element(scales.begin(), scales.end());
    }
};

template <class T>
std::vector<Vector3d> random_displacements(const Subject<T>& subject, double strain, unsigned seed) {
    std::mt19937 random(seed);
    return random_vectors<T>(subject.reference.rest.size(), strain * subject.body.cell_size, random);
}

template <class T>
void check_instruction_set(Subject<T>& subject) {
    const PlanDescription plan = subject.plan.describe();
    const bool ran = plan.instruction_set == subject.key.instruction_set && plan.layout == subject.key.layout &&
                     plan.precision == subject.key.precision;
    subject.record("instruction set", ran ? 0.0 : kFailed);
}

/// Forces are added to what is there, and the fourth component of a stride of 4 is the caller's.
template <class T>
void check_adds(Subject<T>& subject, unsigned seed) {
    const std::vector<Vector3d> u = random_displacements(subject, 0.1, seed);
    const double scale = subject.greatest_scale(u);
    const std::vector<Vector3d> before(u.size(), Vector3d(1, -2, 0.5) * static_cast<double>(static_cast<T>(scale)));
    const std::vector<Vector3d> start = rounded<T>(before);
    NodeArray<T> in(Arrangement::stride_4, u);
    NodeArray<T> out(Arrangement::stride_4, start);
    const T mark = static_cast<T>(-12345.5);
    for (std::size_t n = 0; n < u.size(); ++n) {
        out.padding(n) = mark;
        in.padding(n) = std::numeric_limits<T>::quiet_NaN();
    }
    subject.plan.add_forces(in.field(), out.field());
    std::vector<Vector3d> expected = subject.expected.forces(u);
    bool padding_kept = true;
    for (std::size_t n = 0; n < u.size(); ++n) {
        expected[n] += start[n];
        padding_kept = padding_kept && out.padding(n) == mark;
    }
    subject.record("adds to what is there", max_difference(out.vectors(), expected) / scale);
    subject.record("leaves padding alone", padding_kept ? 0.0 : kFailed);
}

/// Two ends of one spring, or opposite corners of a cell, at one point, then the whole body at one point: any finite
/// force will do.
template <class T>
void check_coincident_nodes(Subject<T>& subject) {
    const auto& rest = subject.reference.rest;
    std::vector<Vector3d> pair(rest.size(), Vector3d::Zero());
    if (const auto& springs = subject.reference.springs; !springs.empty()) {
        pair[static_cast<std::size_t>(springs.front().b)] = -springs.front().rest_vector;
    } else {
        const auto& nodes = subject.reference.mean_springs.front().nodes;
        const auto low = static_cast<std::size_t>(nodes[0]), high = static_cast<std::size_t>(nodes[7]);
        pair[high] = rest[low] - rest[high];
    }
    std::vector<Vector3d> point(rest.size());
    for (std::size_t n = 0; n < rest.size(); ++n) {
        point[n] = -rest[n];
    }
    bool finite = true;
    for (const auto& u : {rounded<T>(pair), rounded<T>(point)}) {
        finite = finite && std::isfinite(max_component(subject.forces(u)));
        NodeArray<T> in(Arrangement::stride_3, u);
        finite = finite && std::isfinite(subject.plan.energy(in.field()).total());
    }
    subject.record("coincident nodes", finite ? 0.0 : kFailed);
}

/// Vertices in a lattice's cells against the sum over the corners, weights times places, and its gradient's cofactor.
template <class T>
void check_skin(Subject<T>& subject, unsigned seed) {
    const Lattice& lattice = *subject.body.lattice;
    const double h = lattice.cell_size();
    std::mt19937 random(seed);
    // Multiples of 2^-20 of a cell, so that no digit is lost of where in its cell a vertex far from the origin is.
    std::uniform_int_distribution<int> any(1, (1 << 20) - 1);
    const auto draw = [&any](std::mt19937& from) { return std::ldexp(any(from), -20); };
    TriangleMesh mesh;
    const auto [nx, ny, nz] = lattice.cells();
    std::vector<std::array<int, 3>> cells; // of the vertices
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                // From none to three vectors of vertices, rarely a whole number of them.
                for (int n = 0; lattice.cell_scale(i, j, k) > 0 && n < 3 * ((i + j + k) % 12); ++n) {
                    cells.push_back({i, j, k});
                    mesh.vertices.push_back({h * (i + draw(random)), h * (j + draw(random)), h * (k + draw(random))});
                    if (const auto last = static_cast<std::uint32_t>(mesh.vertices.size() - 1); n % 3 == 2) {
                        mesh.triangles.push_back({last - 2, last - 1, last});
                    }
                }
            }
        }
    }
    const std::vector<Vector3d> u = random_displacements(subject, 0.1, seed);
    const Skin<T> skin(lattice, mesh, plan_options(subject.key));
    NodeArray<T> in(Arrangement::stride_4, u), positions(Arrangement::stride_4, mesh.vertices.size()),
        normals(Arrangement::separate_arrays, mesh.vertices.size());
    skin.update(VectorField<const T>(in.field()), positions.field(), normals.field());
    const std::vector<Vector3d> x = positions.vectors(), turned = normals.vectors();
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    double error = 0;
    for (std::size_t v = 0; v < x.size(); ++v) {
        const Vector3d at = Eigen::Map<const Vector3d>(mesh.vertices[v].data());
        Vector3d expected = at;
        Eigen::Matrix3d gradient = Eigen::Matrix3d::Identity();
        for (int c = 0; c < 8; ++c) {
            const std::array<int, 3> corner = {cells[v][0] + (c & 1), cells[v][1] + (c >> 1 & 1),
                                               cells[v][2] + (c >> 2)};
            Vector3d weight, slope; // a factor an axis
            for (Eigen::Index a = 0; a < 3; ++a) {
                const double along = at[a] / h - cells[v][static_cast<std::size_t>(a)];
                weight[a] = (c >> a & 1) != 0 ? along : 1 - along;
                slope[a] = ((c >> a & 1) != 0 ? 1 : -1) / h;
            }
            const std::size_t node = lattice.grid_node_index(corner[0], corner[1], corner[2]);
            const auto number = std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin();
            const Vector3d& moved = u[static_cast<std::size_t>(number)];
            expected += weight.prod() * moved;
            gradient += moved * Vector3d(slope[0] * weight[1] * weight[2], weight[0] * slope[1] * weight[2],
                                         weight[0] * weight[1] * slope[2])
                                    .transpose();
        }
        const std::size_t first = v / 3 * 3;
        const auto corner = [&](std::size_t n) { return Eigen::Map<const Vector3d>(mesh.vertices[first + n].data()); };
        const Vector3d area = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
        const Vector3d normal = (gradient.determinant() * gradient.inverse().transpose() * area).normalized();
        error = std::max({error, (x[v] - expected).norm() / std::max(h, expected.norm()), (turned[v] - normal).norm()});
    }
    subject.record("skin", error);
}

constexpr double kStretch = 0.75;

/// The lattice of cells that have all grown alike.
reference::Body grown_body(const TestBody& body) {
    const Lattice& lattice = *body.lattice;
    const auto [nx, ny, nz] = lattice.cells();
    const std::span<const float> scales = lattice.cell_scales();
    Lattice grown = Lattice::from_cells(nx, ny, nz, kStretch * lattice.cell_size(),
                                        std::vector<float>(scales.begin(), scales.end()));
    if (!lattice.tissues().empty()) {
        std::vector<std::uint8_t> tissue;
        for (std::size_t c = 0; c < scales.size(); ++c) {
            tissue.push_back(static_cast<std::uint8_t>(lattice.cell_tissue(c)));
        }
        grown.set_tissues({lattice.tissues().begin(), lattice.tissues().end()}, tissue);
    }
    return reference::assemble(grown, body.material);
}

/// A body whose cells have all grown alike against the reference of a lattice of such cells: forces and energy.
template <class T>
void check_actuation(Subject<T>& subject, const PlanOptions& options, unsigned seed) {
    const Lattice& lattice = *subject.body.lattice;
    std::vector<std::uint32_t> cells;
    for (std::uint32_t c = 0; c < lattice.cell_scales().size(); ++c) {
        if (lattice.cell_scales()[c] > 0) {
            cells.push_back(c);
        }
    }
    std::vector<Vector3d> u = random_displacements(subject, 0.1, seed);
    for (std::size_t n = 0; n < u.size(); ++n) {
        u[n] = kStretch * u[n] + (kStretch - 1) * subject.reference.rest[n];
    }
    u = rounded<T>(u);
    auto dynamics = make_planned<ExplicitDynamics<T>>(subject.body, options);
    dynamics.actuate(lattice, subject.body.material, cells,
                     std::vector<RestStretch>(cells.size(), {kStretch, kStretch, kStretch}));
    NodeArray<T> at(Arrangement::stride_3, u), own(Arrangement::stride_3, u.size()),
        added(Arrangement::stride_3, u.size());
    dynamics.set_displacements(at.field());
    dynamics.get_forces(own.field());
    dynamics.get_effect_forces(added.field());
    std::vector<Vector3d> found = own.vectors();
    for (std::size_t n = 0; n < found.size(); ++n) {
        found[n] += added.vectors()[n];
    }
    const double energy = dynamics.potential_energy().total() + dynamics.effect_energies().at(0).stored;
    // What cancels is of the size of the body's own forces and energy.
    const double scale = subject.greatest_scale(u), size = std::abs(dynamics.potential_energy().springs);
    for (std::size_t n = 0; n < u.size(); ++n) {
        u[n] -= (kStretch - 1) * subject.reference.rest[n];
    }
    subject.record("actuation", std::max(max_difference(found, subject.grown.forces(u)) / scale,
                                         std::abs(energy - subject.grown.energy(u)) / size));
}

/// Cells that remember, against their mean gradients one by one: at once, and after a step of a free body.
template <class T>
void check_relaxation(Subject<T>& subject, const PlanOptions& options, unsigned seed) {
    const Lattice& lattice = *subject.body.lattice;
    const double h = lattice.cell_size();
    struct Cell {
        std::array<std::size_t, 8> nodes;
        double shear, lame; // N m
    };
    std::vector<Cell> cells;
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    const auto [nx, ny, nz] = lattice.cells();
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                const double scale = std::pow(h, 3) * static_cast<double>(lattice.cell_scale(i, j, k));
                if (!(scale > 0)) {
                    continue;
                }
                Cell& cell = cells.emplace_back();
                for (int c = 0; c < 8; ++c) {
                    const std::size_t node = lattice.grid_node_index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                    cell.nodes[static_cast<std::size_t>(c)] =
                        static_cast<std::size_t>(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
                }
                const Material own =
                    material_of(lattice, lattice.cell_tissue(lattice.cell_index(i, j, k)), subject.body.material);
                const bool springs_alone = resolved_volume_energy(own) == VolumeEnergy::none;
                cell.shear = scale * shear_modulus(own);
                cell.lame = cell.shear + (springs_alone ? 0 : scale * volume_modulus(own));
            }
        }
    }
    const auto gradient = [&](const Cell& cell, const std::vector<Vector3d>& u) {
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        for (std::size_t c = 0; c < 8; ++c) {
            for (Eigen::Index a = 0; a < 3; ++a) {
                sum.col(a) += ((c >> a & 1) != 0 ? 1 : -1) * u[cell.nodes[c]] / (4 * h);
            }
        }
        return sum;
    };
    const auto green = [](const Eigen::Matrix3d& H) {
        return Eigen::Matrix3d((H + H.transpose() + H.transpose() * H) / 2);
    };

    auto dynamics = make_planned<ExplicitDynamics<T>>(subject.body, options);
    const double step = 0.4 * dynamics.critical_time_step();
    const Relaxation branches[] = {{0.7, 3 * step}, {0.4, 100 * step}};
    dynamics.relax(lattice, subject.body.material, branches);
    NodeArray<T> at(Arrangement::stride_3, random_displacements(subject, 0.1, seed)),
        force(Arrangement::stride_3, nodes.size());
    dynamics.set_displacements(at.field());
    std::vector<std::vector<Vector3d>> states = {at.vectors()};
    double error = 0;
    for (const bool moved : {false, true}) {
        if (moved) {
            dynamics.step({.time_step = step});
            dynamics.get_displacements(at.field());
            states.push_back(at.vectors());
        }
        dynamics.get_effect_forces(force.field());
        std::vector<Vector3d> expected(nodes.size(), Vector3d::Zero());
        std::vector<double> scales(nodes.size(), 0.0);
        for (const Cell& cell : cells) {
            const Eigen::Matrix3d H = gradient(cell, states.back()), before = green(gradient(cell, states.front()));
            const Eigen::Matrix3d deformation = Eigen::Matrix3d::Identity() + H;
            Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
            for (const auto& [part, time] : branches) {
                const double x = moved ? step / time : 0, gained = moved ? (1 - std::exp(-x)) / x : 0;
                sum += part * (std::exp(-x) * before + gained * (green(H) - before));
            }
            const Eigen::Matrix3d piola =
                deformation * (cell.lame * sum.trace() * Eigen::Matrix3d::Identity() + 2 * cell.shear * sum);
            for (std::size_t c = 0; c < 8; ++c) {
                const Vector3d signs((c & 1) != 0 ? 1 : -1, (c & 2) != 0 ? 1 : -1, (c & 4) != 0 ? 1 : -1);
                expected[cell.nodes[c]] -= piola * signs / (4 * h);
                scales[cell.nodes[c]] += piola.cwiseAbs().sum() / (4 * h);
            }
        }
        error = std::max(error,
                         max_difference(force.vectors(), expected) / *std::max_element(scales.begin(), scales.end()));
    }
    subject.record("relaxation", error);
}

/// The cells' stresses and energies add up to the reference's forces times the nodes' places, and to its energy.
template <class T>
void check_stress(Subject<T>& subject, unsigned seed) {
    const Lattice& lattice = *subject.body.lattice;
    std::vector<double> volumes; // m^3 of what fills each cell
    for (std::size_t c = 0; c < lattice.cell_scales().size(); ++c) {
        if (lattice.cell_scales()[c] > 0) {
            volumes.push_back(std::pow(subject.body.cell_size, 3) * static_cast<double>(lattice.cell_fill(c)));
        }
    }
    for (const double strain : {1e-3, 0.1}) {
        const std::vector<Vector3d> u = random_displacements(subject, strain, seed);
        const StressMeter meter(lattice, subject.body.material, plan_options(subject.key));
        NodeArray<T> in(Arrangement::stride_4, u);
        std::vector<CellStress> stresses(meter.cell_count());
        meter.read(VectorField<const T>(in.field()), stresses);
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        double size = 0, energy = 0;
        for (std::size_t c = 0; c < stresses.size(); ++c) {
            const Eigen::Matrix3d piola =
                Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(stresses[c].first_piola.data());
            sum += volumes[c] * piola;
            size += volumes[c] * piola.norm();
            energy += volumes[c] * stresses[c].energy_density;
        }
        const std::vector<Vector3d>& f = subject.expected.forces(u);
        for (std::size_t n = 0; n < f.size(); ++n) {
            sum += f[n] * subject.reference.rest[n].transpose();
        }
        const double expected = subject.expected.energy(u);
        subject.record("stress", std::max(sum.norm() / size, std::abs(energy / expected - 1)));
    }
}

/// A free body's forces and their moments about the origin sum to zero.
template <class T>
void check_totals(Subject<T>& subject, unsigned seed) {
    for (const double strain : {1e-3, 0.3}) {
        const std::vector<Vector3d> u = random_displacements(subject, strain, seed);
        const std::vector<Vector3d> f = subject.forces(u, Arrangement::stride_3);
        const std::vector<double>& scales = subject.expected.force_scale(u);
        Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
        double force_scale = 0, torque_scale = 0;
        for (std::size_t n = 0; n < u.size(); ++n) {
            const Vector3d x = subject.reference.rest[n] + u[n];
            force += f[n];
            torque += x.cross(f[n]);
            force_scale += scales[n];
            torque_scale += x.norm() * scales[n];
        }
        subject.record("total force", force.norm() / force_scale);
        subject.record("total torque", torque.norm() / torque_scale);
    }
}

/// A translation by many cells, a quarter turn (exact in binary) and a slanted turn, whose rounded displacements the
/// reference is given too.
template <class T>
void check_rigid_motions(Subject<T>& subject) {
    const auto& rest = subject.reference.rest;
    const Eigen::AngleAxisd slanted(0.7, Vector3d(1, 2, -2) / 3);
    Eigen::Matrix3d quarter_turn;
    quarter_turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    const std::vector<Vector3d> translation(rest.size(), Vector3d(512, -64, 128.5));
    std::vector<Vector3d> turned(rest.size()), slanting(rest.size());
    for (std::size_t n = 0; n < rest.size(); ++n) {
        turned[n] = quarter_turn * rest[n] - rest[n] + Vector3d(1, 2, 3);
        slanting[n] = slanted * rest[n] - rest[n];
    }
    // Forces near zero need a scale: the terms that cancel in the slanted turn, each of the size stiffness x length.
    const double scale = subject.greatest_scale(slanting);
    for (const auto& u : {translation, turned, slanting}) {
        const std::vector<Vector3d> given = rounded<T>(u);
        const double error = max_difference(subject.forces(given), subject.expected.forces(given));
        subject.record("rigid motion", error / scale);
    }
}

template <class T>
void check_diagonal(Subject<T>& subject, unsigned seed) {
    for (const double strain : {1e-3, 0.1}) {
        const std::vector<Vector3d> u = random_displacements(subject, strain, seed);
        NodeArray<T> in(Arrangement::stride_3, u);
        std::vector<T> found(6 * u.size());
        subject.plan.hessian_diagonal(in.field(), found);
        const std::vector<Eigen::Matrix3d>& expected = subject.expected.hessian_diagonal(u);
        double error = 0, scale = 0;
        for (std::size_t n = 0; n < u.size(); ++n) {
            const auto e = [&](std::size_t entry) { return static_cast<double>(found[6 * n + entry]); };
            Eigen::Matrix3d block;
            block << e(0), e(3), e(4), e(3), e(1), e(5), e(4), e(5), e(2);
            const double difference = (block - expected[n]).norm();
            error = std::isnan(difference) ? kFailed : std::max(error, difference);
            scale = std::max(scale, expected[n].norm());
        }
        subject.record("hessian diagonal", error / scale);
    }
}

/// Damping along the springs: over the greatest sum of the magnitudes of the forces on a node.
template <class T>
void check_damping(Subject<T>& subject, const PlanOptions& options, unsigned seed) {
    constexpr double kSeconds = 0.5;
    const std::vector<Vector3d> u = random_displacements(subject, 0.1, seed);
    const std::vector<Vector3d> v = random_displacements(subject, 1, seed + 1);
    auto dynamics = make_planned<ExplicitDynamics<T>>(subject.body, options);
    dynamics.damp_springs(kSeconds);
    NodeArray<T> at(Arrangement::stride_3, u), moving(Arrangement::stride_3, v), out(Arrangement::stride_3, u.size());
    dynamics.set_displacements(at.field());
    dynamics.set_velocities(moving.field());
    dynamics.get_effect_forces(out.field());
    const double fastest = 2 * std::sqrt(3.0) * subject.body.cell_size;
    std::vector<double> scales(u.size(), 0.0);
    for (const reference::Spring& s : subject.reference.springs) {
        for (const int end : {s.a, s.b}) {
            scales[static_cast<std::size_t>(end)] += kSeconds * s.stiffness * fastest;
        }
    }
    for (const reference::MeanSprings& cell : subject.reference.mean_springs) {
        const double stiffness = cell.stiffness[0] / 4 + cell.stiffness[1] / 2 + cell.stiffness[2] * 3 / 4;
        for (const int corner : cell.nodes) {
            scales[static_cast<std::size_t>(corner)] += kSeconds * stiffness * fastest;
        }
    }
    const double error = max_difference(out.vectors(), subject.expected.damping_forces(kSeconds, u, v));
    subject.record("spring damping", error / *std::max_element(scales.begin(), scales.end()));
}

/// 2 / sqrt of the largest eigenvalue of M^-1 K at rest, from above: power iteration gives eigenvalues from below.
double largest_stable_step(const reference::Body& body) {
    const Eigen::SparseMatrix<double> stiffness =
        reference::hessian(body, std::vector<Vector3d>(body.rest.size(), Vector3d::Zero()));
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    Eigen::VectorXd masses(stiffness.rows()), p(stiffness.rows());
    for (Eigen::Index i = 0; i < p.size(); ++i) {
        masses[i] = body.mass[static_cast<std::size_t>(i / 3)];
        p[i] = uniform(random);
    }
    double eigenvalue = 0;
    for (int iteration = 0; iteration < 100; ++iteration) {
        const Eigen::VectorXd kp = stiffness * p;
        eigenvalue = std::max(eigenvalue, p.dot(kp) / p.dot(masses.cwiseProduct(p)));
        p = kp.cwiseQuotient(masses);
        p /= p.cwiseAbs().maxCoeff();
    }
    return 2 / std::sqrt(eigenvalue);
}

/// The plan's bound must not be above the true critical step.
template <class T>
void check_critical_time_step(Subject<T>& subject, double stable_step) {
    const double excess = subject.plan.critical_time_step() / stable_step - 1;
    subject.record("critical time step", std::max(0.0, excess));
}

template <class T>
void check_all(const TestBody& body, const reference::Body& reference, double stable_step, ReferenceValues& grown,
               const MatrixOptions& options, RowTable& table) {
    ReferenceValues expected(reference);
    for (const RowKey& key : kernel_keys(body, options.instruction_sets, precision_name<T>())) {
        const auto plan = make_planned<ForcePlan<T>>(body, plan_options(key));
        Subject<T> subject{body, reference, expected, grown, plan, key, table};
        check_instruction_set(subject);
        check_adds(subject, options.seed);
        check_coincident_nodes(subject);
        check_totals(subject, options.seed);
        if (body.lattice) {
            check_skin(subject, options.seed);
            check_actuation(subject, plan_options(key), options.seed);
            check_relaxation(subject, plan_options(key), options.seed);
            check_stress(subject, options.seed);
        }
        check_rigid_motions(subject);
        check_diagonal(subject, options.seed);
        check_damping(subject, plan_options(key), options.seed);
        check_critical_time_step(subject, stable_step);
    }
}

} // namespace

void run_properties(const MatrixOptions& options, RowTable& table) {
    for_each_body(property_bodies(options.seed), table, [&](const TestBody& body, RowTable& rows) {
        const reference::Body reference = reference_body(body), grown = body.lattice ? grown_body(body) : reference;
        ReferenceValues of_grown(grown);
        const double stable_step = largest_stable_step(reference);
        check_all<float>(body, reference, stable_step, of_grown, options, rows);
        check_all<double>(body, reference, stable_step, of_grown, options, rows);
    });
}

} // namespace hybmss::verify
