#pragma once

/// \file
/// A body moved by ExplicitDynamics, as an embedding program would move it, with what the hard cases measure, and how
/// far an energy that should stay has moved.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "reference/body.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace hybmss::stability {

using reference::Vector3d;
using Vectors = std::vector<Vector3d>;

PlanOptions one_thread();

/// On one thread: the bodies are small. T is float or double; what goes in and out is double.
template <class T>
class BodyMotion {
public:
    BodyMotion(const Lattice& lattice, const Material& material);
    /// A network whose cells, if any, are cubes with the edge `cell_size`.
    BodyMotion(const Network& network, double cell_size);

    std::size_t node_count() const { return rest_.size(); }
    const Vectors& rest() const { return rest_; }
    std::span<const double> masses() const { return dynamics_.masses(); }
    double critical_time_step() const { return dynamics_.critical_time_step(); }

    void set_displacements(const Vectors& u);
    void set_velocities(const Vectors& v);
    void prescribe(std::span<const PrescribedNode> nodes) { dynamics_.prescribe(nodes); }
    void step(const StepParameters& parameters, long count) { dynamics_.step(parameters, count); }

    Vectors displacements() const;
    Vectors velocities() const;
    /// Internal forces, N.
    Vectors forces() const;
    double elastic_energy() const { return dynamics_.potential_energy().total(); }
    double kinetic_energy() const { return dynamics_.kinetic_energy(); }
    double energy() const { return elastic_energy() + kinetic_energy(); }
    /// Sum of m x cross v about the origin, kg m^2/s.
    Vector3d angular_momentum() const;
    VolumeChange volume_change() const;

private:
    template <class Read>
    Vectors read(const Read& read) const;

    ExplicitDynamics<T> dynamics_;
    Vectors rest_;
    std::vector<std::array<std::uint32_t, 8>> cells_;
    double cell_size_;
};

extern template class BodyMotion<float>;
extern template class BodyMotion<double>;

/// The nodes' rest positions, m.
Vectors rest_positions_of(const Lattice& lattice);

/// Each component uniform in [-bound, bound].
Vectors random_vectors(std::size_t count, double bound, unsigned seed);

/// u of the rotation about the axis by the angle (radians), the origin staying.
Vectors rotation(const Vectors& rest, const Vector3d& axis, double angle);

double greatest_length(const Vectors& vectors);

/// A soft, slow material that all cases share: E = 10 kPa, 1000 kg/m^3.
Material case_material(SpringForm springs, double poisson_ratio, double face_diagonal_ratio = 1,
                       VolumeEnergy volume_energy = VolumeEnergy::automatic);
inline constexpr double kCellSize = 0.5; // m

/// Samples of the total energy at equal intervals. Semi-implicit Euler makes it oscillate about a value that stays; so
/// the drift compares means, and the swing is told apart.
class EnergyRecord {
public:
    void add(double energy) { samples_.push_back(energy); }

    /// The mean over the last quarter less that over the first.
    double drift() const {
        const std::size_t quarter = samples_.size() / 4;
        return mean(samples_.size() - quarter, samples_.size()) - mean(0, quarter);
    }
    /// The greatest distance of a sample from the first quarter's mean; not a number where a sample is none.
    double swing() const {
        const double middle = mean(0, samples_.size() / 4);
        double greatest = 0;
        for (const double sample : samples_) {
            greatest = std::isnan(sample) ? sample : std::max(greatest, std::abs(sample - middle));
            if (std::isnan(greatest)) {
                break;
            }
        }
        return greatest;
    }

private:
    double mean(std::size_t begin, std::size_t end) const {
        double sum = 0;
        for (std::size_t n = begin; n < end; ++n) {
            sum += samples_[n];
        }
        return sum / static_cast<double>(end - begin);
    }

    std::vector<double> samples_;
};

} // namespace hybmss::stability
