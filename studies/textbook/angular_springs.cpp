#include "reference/body.hpp"
#include "reference/constants.hpp"
#include "reference/volume_energy.hpp"
#include "studies/textbook/problem.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <map>
#include <random>
#include <utility>

// Angular springs (bending bonds: Kirkwood 1939; Sahimi and Arbabi 1993) in plain scalar loops, beside the volume force
// that the paper has in their place, in loops as plain.

namespace hybmss::textbook {
namespace {

using reference::Vector3d;

std::size_t at(int node) {
    return static_cast<std::size_t>(node);
}

double bulk_modulus(double young_modulus, double poisson_ratio) {
    return young_modulus / (3 * (1 - 2 * poisson_ratio));
}

/// 1/2 stiffness (theta - theta0)^2 of the angle at `middle`; stiffness in J.
struct AngularSpring {
    int middle, a, b;
    double rest_angle, stiffness;
    double rest_cosine, by_sine2; ///< cos theta0, stiffness / sin^2 theta0
};

double angle_between(const Vector3d& p, const Vector3d& q) {
    return std::atan2(p.cross(q).norm(), p.dot(q));
}

// d theta / dp = -(q/|q| - cos theta p/|p|) / (|p| sin theta)
void add_angular_forces(const std::vector<AngularSpring>& springs, const std::vector<Vector3d>& x,
                        std::vector<Vector3d>& f) {
    for (const AngularSpring& s : springs) {
        const Vector3d p = x[at(s.a)] - x[at(s.middle)], q = x[at(s.b)] - x[at(s.middle)];
        const double sine = p.cross(q).norm(), cosine = p.dot(q);
        const double torque = s.stiffness * (std::atan2(sine, cosine) - s.rest_angle) / std::max(sine, 1e-300);
        const Vector3d on_a = torque * (q - cosine / p.squaredNorm() * p),
                       on_b = torque * (p - cosine / q.squaredNorm() * q);
        f[at(s.a)] += on_a;
        f[at(s.b)] += on_b;
        f[at(s.middle)] -= on_a + on_b;
    }
}

// The same at small strain without an inverse function: 1/2 stiffness (cos theta - cos theta0)^2 / sin^2 theta0.
void add_cosine_forces(const std::vector<AngularSpring>& springs, const std::vector<Vector3d>& x,
                       std::vector<Vector3d>& f) {
    for (const AngularSpring& s : springs) {
        const Vector3d p = x[at(s.a)] - x[at(s.middle)], q = x[at(s.b)] - x[at(s.middle)];
        const double by_p = 1 / p.norm(), by_q = 1 / q.norm(), cosine = p.dot(q) * by_p * by_q;
        const double pull = -s.by_sine2 * (cosine - s.rest_cosine);
        const Vector3d on_a = pull * by_p * (by_q * q - cosine * by_p * p),
                       on_b = pull * by_q * (by_p * p - cosine * by_q * q);
        f[at(s.a)] += on_a;
        f[at(s.b)] += on_b;
        f[at(s.middle)] -= on_a + on_b;
    }
}

double angular_energy(const std::vector<AngularSpring>& springs, const std::vector<Vector3d>& x) {
    double sum = 0;
    for (const AngularSpring& s : springs) {
        const double change = angle_between(x[at(s.a)] - x[at(s.middle)], x[at(s.b)] - x[at(s.middle)]) - s.rest_angle;
        sum += 0.5 * s.stiffness * change * change;
    }
    return sum;
}

void add_spring_forces(const reference::Body& body, const std::vector<Vector3d>& x, std::vector<Vector3d>& f) {
    for (const reference::Spring& s : body.springs) {
        const Vector3d d = x[at(s.b)] - x[at(s.a)];
        const Vector3d on_a = s.stiffness * (1 - s.rest_vector.norm() / d.norm()) * d;
        f[at(s.a)] += on_a;
        f[at(s.b)] -= on_a;
    }
}

/// By (5.14) to (5.16); phi' by a cube root where it is the mean stretch's.
void add_volume_forces(const reference::Body& body, double rest_volume, const std::vector<Vector3d>& x,
                       std::vector<Vector3d>& f) {
    for (const reference::Cell& cell : body.cells) {
        Vector3d edge[3] = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
        for (std::size_t c = 0; c < 8; ++c) {
            for (std::size_t e = 0; e < 3; ++e) {
                edge[e] += (c >> e & 1 ? 0.25 : -0.25) * x[at(cell.nodes[c])];
            }
        }
        const Vector3d bc = edge[1].cross(edge[2]), ca = edge[2].cross(edge[0]), ab = edge[0].cross(edge[1]);
        const double ratio = edge[0].dot(bc) / rest_volume;
        double slope = ratio - 1;
        if (body.volume_energy == VolumeEnergy::mean_stretch) {
            const double c = std::cbrt(std::max(ratio, 0.125));
            slope = 3 * (c - 1) / (c * c);
        }
        const double p = cell.kappa * slope / 4;
        for (std::size_t c = 0; c < 8; ++c) {
            f[at(cell.nodes[c])] -= (c & 1 ? p : -p) * bc + (c >> 1 & 1 ? p : -p) * ca + (c >> 2 ? p : -p) * ab;
        }
    }
}

/// G_a that angles add to the shear modulus 3 K / 5 of springs that carry K. In a face of a cell the right angle has
/// G_a h^3 / 12, each of the two between an edge and the diagonal G_a h^3 / 3, half of that by cell: then the sum over
/// the faces along three axes is isotropic at small strain.
std::vector<AngularSpring> angular_springs(const reference::Body& body, double shear_modulus, double h) {
    std::map<std::array<int, 3>, double> sums; // by the middle's node and the others, the lower first
    const double volume = h * h * h;
    const auto add = [&](int middle, int a, int b, double stiffness) {
        sums[{middle, std::min(a, b), std::max(a, b)}] += stiffness;
    };
    for (const reference::Cell& cell : body.cells) {
        for (std::size_t c = 0; c < 8; ++c) {
            for (std::size_t e = 0; e < 3; ++e) {
                const std::size_t i = std::size_t{1} << e, j = std::size_t{1} << (e + 1) % 3;
                const int middle = cell.nodes[c], along = cell.nodes[c ^ i], across = cell.nodes[c ^ j],
                          diagonal = cell.nodes[c ^ i ^ j];
                add(middle, along, across, shear_modulus * volume / 24);
                add(middle, along, diagonal, shear_modulus * volume / 6);
                add(middle, across, diagonal, shear_modulus * volume / 6);
            }
        }
    }
    std::vector<AngularSpring> springs;
    for (const auto& [nodes, stiffness] : sums) {
        const auto [middle, a, b] = nodes;
        const Vector3d& x = body.rest[at(middle)];
        const double angle = angle_between(body.rest[at(a)] - x, body.rest[at(b)] - x);
        springs.push_back({middle, a, b, angle, stiffness, std::cos(angle), stiffness / std::pow(std::sin(angle), 2)});
    }
    return springs;
}

/// A cube by one of the two models.
struct Model {
    reference::Body body;
    double h;
    std::vector<AngularSpring> angles; ///< in place of volume forces

    void forces(const std::vector<Vector3d>& x, std::vector<Vector3d>& f) const {
        std::fill(f.begin(), f.end(), Vector3d::Zero());
        add_spring_forces(body, x, f);
        if (angles.empty()) {
            add_volume_forces(body, h * h * h, x, f);
        } else {
            add_angular_forces(angles, x, f);
        }
    }
};

Model hybrid(int cells, const Material& material) {
    return {reference::assemble(Lattice::box(cells, cells, cells, 1.0 / cells), material), 1.0 / cells, {}};
}

Model bending_bonds(int cells, Material material) {
    const double K = bulk_modulus(material.young_modulus, material.poisson_ratio),
                 G = reference::shear_modulus(material.young_modulus, material.poisson_ratio);
    Model model = hybrid(cells, material);
    const double of_springs = 3 * K / 5;
    for (reference::Spring& s : model.body.springs) {
        s.stiffness *= of_springs / G;
    }
    model.angles = angular_springs(model.body, G - of_springs, model.h);
    return model;
}

struct Pressed {
    double volume_change = std::nan(""), force = std::nan(""); ///< by the volume at rest; N
};

/// Between clamped plates, by damped steps until forces are small; nothing where they never are.
Pressed pressed(const Model& model, double strain, double stiffest) {
    const reference::Body& body = model.body;
    std::vector<Vector3d> x = body.rest, f(x.size()), v(x.size(), Vector3d::Zero());
    const auto held = [&](std::size_t n) { return body.rest[n][1] < 1e-9 || body.rest[n][1] > 1 - 1e-9; };
    for (std::size_t n = 0; n < x.size(); ++n) {
        x[n][1] *= 1 - strain;
    }
    const double step = 0.25 * model.h * std::sqrt(1 / stiffest), damping = 3 * std::sqrt(stiffest);
    Pressed found;
    for (int i = 0; i < 20000; ++i) {
        model.forces(x, f);
        double worst = 0, support = 0, plate = 0;
        for (std::size_t n = 0; n < x.size(); ++n) {
            if (held(n)) {
                support = std::max(support, f[n].norm());
                plate += body.rest[n][1] > 0.5 ? f[n][1] : 0;
                continue;
            }
            worst = std::max(worst, f[n].norm());
            v[n] = (v[n] + step * f[n] / body.mass[n]) / (1 + step * damping);
            x[n] += step * v[n];
        }
        if (!std::isfinite(worst)) {
            return {};
        }
        if (worst < 1e-6 * support) {
            double volume = 0;
            for (const reference::Cell& cell : body.cells) {
                reference::Corners corners;
                for (std::size_t c = 0; c < 8; ++c) {
                    corners[c] = x[at(cell.nodes[c])];
                }
                volume += reference::volume(reference::mean_edges(corners));
            }
            return {1 - volume, plate};
        }
    }
    return found;
}

/// Median of the processor's seconds of eleven rounds of each, in turns.
std::array<double, 4> seconds(const Model& volumes, const Model& angles, const std::vector<Vector3d>& x) {
    std::array<std::vector<double>, 4> rounds;
    std::vector<Vector3d> f(x.size());
    for (int round = 0; round < 11; ++round) {
        for (std::size_t what = 0; what < 4; ++what) {
            const std::clock_t start = std::clock();
            for (int again = 0; again < 5; ++again) {
                if (what == 0) {
                    add_spring_forces(volumes.body, x, f);
                } else if (what == 1) {
                    add_volume_forces(volumes.body, std::pow(volumes.h, 3), x, f);
                } else if (what == 2) {
                    add_angular_forces(angles.angles, x, f);
                } else {
                    add_cosine_forces(angles.angles, x, f);
                }
            }
            rounds[what].push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / 5);
        }
    }
    std::array<double, 4> medians{};
    for (std::size_t what = 0; what < 4; ++what) {
        std::nth_element(rounds[what].begin(), rounds[what].begin() + 5, rounds[what].end());
        medians[what] = rounds[what][5];
    }
    return medians;
}

} // namespace

double angular_stiffness_error(double poisson_ratio, const reference::Matrix3d& strain) {
    constexpr int kCells = 4;
    Material material;
    material.young_modulus = 1;
    material.poisson_ratio = poisson_ratio;
    const Model model = bending_bonds(kCells, material);
    std::vector<Vector3d> x = model.body.rest;
    for (Vector3d& place : x) {
        place += strain * place;
    }
    double stored = angular_energy(model.angles, x);
    for (const reference::Spring& s : model.body.springs) {
        const double change = (x[at(s.b)] - x[at(s.a)]).norm() - s.rest_vector.norm();
        stored += 0.5 * s.stiffness * change * change;
    }
    const double G = reference::shear_modulus(1, poisson_ratio), lambda = bulk_modulus(1, poisson_ratio) - 2 * G / 3;
    const double exact = lambda / 2 * strain.trace() * strain.trace() + G * strain.squaredNorm();
    return stored / exact - 1;
}

double angular_force_error() {
    Material material;
    material.young_modulus = 1;
    material.poisson_ratio = 0;
    const Model model = bending_bonds(2, material);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> off(-0.05, 0.05), any(-1, 1);
    std::vector<Vector3d> x = model.body.rest, along(x.size()), f(x.size(), Vector3d::Zero());
    for (std::size_t n = 0; n < x.size(); ++n) {
        const double dx = off(random), dy = off(random), dz = off(random);
        x[n] += Vector3d(dx, dy, dz);
        const double px = any(random), py = any(random), pz = any(random);
        along[n] = Vector3d(px, py, pz);
    }
    add_angular_forces(model.angles, x, f);
    double work = 0;
    for (std::size_t n = 0; n < x.size(); ++n) {
        work -= f[n].dot(along[n]);
    }
    const auto moved = [&](double by) {
        std::vector<Vector3d> to = x;
        for (std::size_t n = 0; n < x.size(); ++n) {
            to[n] += by * along[n];
        }
        return angular_energy(model.angles, to);
    };
    constexpr double kStep = 1e-6;
    return (moved(kStep) - moved(-kStep)) / (2 * kStep) / work - 1;
}

std::vector<paper::Table> angular_tables() {
    paper::Table accuracy{
        "angular",
        "Angular springs beside the volume force: accuracy",
        {"A cube of 6^3 cells pressed between clamped plates. Springs carry the shear modulus and a volume force what "
         "K "
         "lacks (HybMSS, A = 1); or springs carry K, and angular springs, 36 a cell between edges and diagonals of "
         "faces, "
         "what G lacks (bending bonds). e is the volume lost by the volume at rest, the force that on the plate by E; "
         "at "
         "nu = 0 linear theory says e = the strain. Both are isotropic at small strain, to rounding (test). Nothing "
         "where no equilibrium was found in 20,000 damped steps."},
        {{"poisson_ratio", "nu"},
         {"strain", "strain, %"},
         {"hybrid_volume", "e, volume force, %", 3},
         {"hybrid_force", "force / E", 5},
         {"angular_volume", "e, angular springs, %", 3},
         {"angular_force", "force / E", 5}},
        {},
        {"Above nu = 1/4 the angular springs' stiffness is negative: angles would rather be others than at rest, and "
         "only "
         "springs hold them."}};
    for (const double nu : {0.0, 0.2, 0.3, 0.4}) {
        for (const double strain : {0.05, 0.2}) {
            Material material;
            material.young_modulus = 1;
            material.density = 1;
            material.poisson_ratio = nu;
            const double stiffest = 3 * bulk_modulus(1, nu) + 3;
            const Pressed volumes = pressed(hybrid(6, material), strain, stiffest),
                          angles = pressed(bending_bonds(6, material), strain, stiffest);
            accuracy.rows.push_back({fmt::format("{:g}", nu), fmt::format("{:g}", 100 * strain),
                                     100 * volumes.volume_change, volumes.force, 100 * angles.volume_change,
                                     angles.force});
        }
    }
    paper::Table price{
        "angular_price",
        "Angular springs beside the volume force: time",
        {"Forces of 20^3 cells in double by plain scalar loops, each over its list: nanoseconds a cell of the "
         "processor's "
         "time, medians of eleven rounds in turns. The paper calls its force's cost favourable to theirs without a "
         "figure."},
        {{"what", "forces"}, {"terms", "a cell", 2}, {"time", "ns a cell", 1}, {"ratio", "by the volume force's", 2}},
        {},
        {}};
    Material material;
    material.young_modulus = 1;
    material.poisson_ratio = 0.4;
    const Model volumes = hybrid(20, material), angles = bending_bonds(20, material);
    std::vector<Vector3d> x = volumes.body.rest;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> off(-0.001, 0.001);
    for (Vector3d& place : x) {
        const double dx = off(random), dy = off(random), dz = off(random);
        place += Vector3d(dx, dy, dz);
    }
    const std::array<double, 4> times = seconds(volumes, angles, x);
    const auto cells = static_cast<double>(volumes.body.cells.size());
    const auto of_angles = static_cast<double>(angles.angles.size());
    const double counts[4] = {static_cast<double>(volumes.body.springs.size()), cells, of_angles, of_angles};
    const char* const names[4] = {"springs", "volume forces", "angular springs", "angular springs by cosines"};
    for (std::size_t what = 0; what < 4; ++what) {
        price.rows.push_back(
            {std::string(names[what]), counts[what] / cells, 1e9 * times[what] / cells, times[what] / times[1]});
    }
    return {accuracy, price};
}

} // namespace hybmss::textbook
