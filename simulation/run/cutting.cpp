#include "simulation/run/cutting.hpp"

#include "simulation/geometry/cell_volume.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {

CutSchedule::CutSchedule(const std::vector<Cut>& cuts, double time_step)
    : cuts_(time_step > 0 ? cuts : std::vector<Cut>()), time_step_(time_step), done_(cuts_.size(), 0.0) {
    find_next();
}

long CutSchedule::step_of(std::size_t cut, double bite) const {
    // Up to rounding, a time of n steps comes after n steps.
    const double time = cuts_[cut].at + bite * cuts_[cut].every;
    return static_cast<long>(std::min(std::ceil(time / time_step_ * (1 - 1e-12)), 1e17));
}

long CutSchedule::next_step_of(std::size_t cut) const {
    const double length = cuts_[cut].until - cuts_[cut].at;
    const double bites = cuts_[cut].every > 0 ? std::floor(length / cuts_[cut].every * (1 + 1e-12)) + 1 : 1;
    return done_[cut] < bites ? step_of(cut, done_[cut]) : kNever;
}

void CutSchedule::find_next() {
    next_step_ = kNever;
    for (std::size_t c = 0; c < cuts_.size(); ++c) {
        next_step_ = std::min(next_step_, next_step_of(c));
    }
}

std::vector<std::size_t> CutSchedule::take(long step) {
    std::vector<std::size_t> due;
    for (std::size_t c = 0; c < cuts_.size(); ++c) {
        if (next_step_of(c) > step) {
            continue;
        }
        due.push_back(c);
        // On to the first bite after this step.
        const double past = static_cast<double>(step) * time_step_ - cuts_[c].at;
        done_[c] = std::max(done_[c] + 1, cuts_[c].every > 0 ? std::floor(past / cuts_[c].every) : 0);
        while (next_step_of(c) <= step) {
            ++done_[c];
        }
    }
    find_next();
    return due;
}

void CutSchedule::set_done(std::vector<double> done) {
    done_ = std::move(done);
    done_.resize(cuts_.size(), 0.0);
    find_next();
}

namespace {

bool inside(const BoxRegion& box, const Vector3& x, double slack) {
    bool all = true;
    for (std::size_t a = 0; a < 3; ++a) {
        all = all && x[a] >= box.low[a] - slack && x[a] <= box.high[a] + slack;
    }
    return all;
}
bool inside(const SphereRegion& sphere, const Vector3& x, double slack) {
    const Vector3& c = sphere.center;
    return std::hypot(x[0] - c[0], x[1] - c[1], x[2] - c[2]) <= sphere.radius + slack;
}
bool inside(const HalfSpace& half, const Vector3& x, double slack) {
    const Vector3 &p = half.point, &n = half.normal;
    const double height = (x[0] - p[0]) * n[0] + (x[1] - p[1]) * n[1] + (x[2] - p[2]) * n[2];
    return height <= slack * std::hypot(n[0], n[1], n[2]);
}

/// phi(J) by J - 1, see the model's description: quadratic, or by the mean stretch.
double volume_density(VolumeEnergy kind, double dilation) {
    if (kind == VolumeEnergy::quadratic) {
        return 0.5 * dilation * dilation;
    }
    const double J = 1 + dilation;
    if (J < 0.125) { // on in a straight line from there, of slope -6
        return 1.125 - 6 * (J - 0.125);
    }
    // cbrt(J) - 1 without cancellation
    const double c = std::cbrt(J), stretch = dilation / (c * c + c + 1);
    return 4.5 * stretch * stretch;
}

} // namespace

bool is_inside(const Cut& cut, const Vector3& point, double time, double cell_size) {
    Vector3 x = point; // as seen from the tool
    for (std::size_t a = 0; a < 3; ++a) {
        x[a] -= cut.velocity[a] * (time - cut.at);
    }
    return std::visit([&](const auto& tool) { return inside(tool, x, 1e-6 * cell_size); }, cut.tool);
}

Vector3 center_of(const BodyCell& cell, std::span<const Vector3> rest, std::span<const Vector3> displacements) {
    Vector3 center = {0, 0, 0};
    for (const std::uint32_t n : cell.corners) {
        for (std::size_t a = 0; a < 3; ++a) {
            center[a] += (rest[n][a] + (displacements.empty() ? 0 : displacements[n][a])) / 8;
        }
    }
    return center;
}

double cell_energy(const Material& material, double cell_size, double scale,
                   const std::array<Vector3, 8>& displacement) {
    const SpringConstants constants = spring_constants(material, cell_size);
    double energy = 0;
    for (unsigned a = 0; a < 8; ++a) {
        for (unsigned b = a + 1; b < 8; ++b) {
            // q = |d|^2 - l^2 = 2 r.du + du.du,  |d| - l = q / (|d| + l)
            double length2 = 0, q = 0;
            for (unsigned axis = 0; axis < 3; ++axis) {
                const double r =
                    cell_size * (static_cast<double>(b >> axis & 1u) - static_cast<double>(a >> axis & 1u));
                const double du = displacement[b][axis] - displacement[a][axis];
                length2 += r * r;
                q += (2 * r + du) * du;
            }
            const double stretch = q / (std::sqrt(std::max(length2 + q, 0.0)) + std::sqrt(length2));
            const double edges = std::round(length2 / (cell_size * cell_size));
            const double k = edges == 1   ? constants.edge / 4
                             : edges == 2 ? constants.face_diagonal / 2
                                          : constants.cube_diagonal;
            const double e = stretch / std::sqrt(length2);
            energy += k * length2 * e * e *
                      (0.5 + e * (material.stiffening.quadratic / 3 + material.stiffening.cubic / 4 * e));
        }
    }
    if (const VolumeEnergy kind = resolved_volume_energy(material); kind != VolumeEnergy::none) {
        const double dilation = volume_ratio_minus_one(displacement, {0, 1, 2, 3, 4, 5, 6, 7}, cell_size);
        energy += volume_modulus(material) * cell_size * cell_size * cell_size * volume_density(kind, dilation);
    }
    return scale * energy;
}

} // namespace hybmss
