#include "studies/stability/body_motion.hpp"

#include "simulation/geometry/cells.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <random>

namespace hybmss::stability {
namespace {

template <class T>
std::vector<T> interleaved(const Vectors& vectors) {
    std::vector<T> values;
    for (const Vector3d& v : vectors) {
        for (int axis = 0; axis < 3; ++axis) {
            values.push_back(static_cast<T>(v[axis]));
        }
    }
    return values;
}

} // namespace

template <class T>
BodyMotion<T>::BodyMotion(const Lattice& lattice, const Material& material)
    : dynamics_(lattice, material, one_thread()), rest_(rest_positions_of(lattice)), cells_(cell_corners(lattice)),
      cell_size_(lattice.cell_size()) {}

template <class T>
BodyMotion<T>::BodyMotion(const Network& network, double cell_size)
    : dynamics_(network, one_thread()), cell_size_(cell_size) {
    for (const auto& x : network.rest_positions) {
        rest_.emplace_back(x.data());
    }
    for (const Network::Cell& cell : network.cells) {
        std::array<std::uint32_t, 8>& corners = cells_.emplace_back();
        std::copy(cell.nodes.begin(), cell.nodes.end(), corners.begin());
    }
}

template <class T>
void BodyMotion<T>::set_displacements(const Vectors& u) {
    const std::vector<T> values = interleaved<T>(u);
    dynamics_.set_displacements(VectorField<const T>::aos(values.data(), u.size()));
}

template <class T>
void BodyMotion<T>::set_velocities(const Vectors& v) {
    const std::vector<T> values = interleaved<T>(v);
    dynamics_.set_velocities(VectorField<const T>::aos(values.data(), v.size()));
}

template <class T>
template <class Read>
Vectors BodyMotion<T>::read(const Read& read) const {
    std::vector<T> values(3 * node_count());
    read(VectorField<T>::aos(values.data(), node_count()));
    Vectors vectors;
    for (std::size_t n = 0; n < node_count(); ++n) {
        vectors.emplace_back(static_cast<double>(values[3 * n]), static_cast<double>(values[3 * n + 1]),
                             static_cast<double>(values[3 * n + 2]));
    }
    return vectors;
}

template <class T>
Vectors BodyMotion<T>::displacements() const {
    return read([&](VectorField<T> out) { dynamics_.get_displacements(out); });
}
template <class T>
Vectors BodyMotion<T>::velocities() const {
    return read([&](VectorField<T> out) { dynamics_.get_velocities(out); });
}
template <class T>
Vectors BodyMotion<T>::forces() const {
    return read([&](VectorField<T> out) { dynamics_.get_forces(out); });
}

template <class T>
Vector3d BodyMotion<T>::angular_momentum() const {
    const Vectors u = displacements(), v = velocities();
    Vector3d sum = Vector3d::Zero();
    for (std::size_t n = 0; n < u.size(); ++n) {
        sum += masses()[n] * (rest_[n] + u[n]).cross(v[n]);
    }
    return sum;
}

template <class T>
VolumeChange BodyMotion<T>::volume_change() const {
    std::vector<std::array<double, 3>> u;
    for (const Vector3d& v : displacements()) {
        u.push_back({v[0], v[1], v[2]});
    }
    return measure_volume_change(u, cells_, cell_size_);
}

template class BodyMotion<float>;
template class BodyMotion<double>;

PlanOptions one_thread() {
    PlanOptions options;
    options.threads = 1;
    return options;
}

Vectors rest_positions_of(const Lattice& lattice) {
    Vectors rest;
    for (const std::uint32_t node : lattice.nodes()) {
        rest.emplace_back(lattice.rest_position(node).data());
    }
    return rest;
}

Vectors random_vectors(std::size_t count, double bound, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-bound, bound);
    Vectors vectors(count);
    for (Vector3d& v : vectors) {
        for (int axis = 0; axis < 3; ++axis) {
            v[axis] = uniform(random);
        }
    }
    return vectors;
}

Vectors rotation(const Vectors& rest, const Vector3d& axis, double angle) {
    const Eigen::AngleAxisd turn(angle, axis.normalized());
    Vectors u;
    for (const Vector3d& x : rest) {
        u.push_back(turn * x - x);
    }
    return u;
}

double greatest_length(const Vectors& vectors) {
    double greatest = 0;
    for (const Vector3d& v : vectors) {
        greatest = std::max(greatest, v.norm()); // a NaN is not greater: callers test energies too
    }
    return greatest;
}

Material case_material(SpringForm springs, double poisson_ratio, double face_diagonal_ratio,
                       VolumeEnergy volume_energy) {
    Material material;
    material.young_modulus = 1e4;
    material.poisson_ratio = poisson_ratio;
    material.density = 1000;
    material.face_diagonal_ratio = face_diagonal_ratio;
    material.volume_energy = volume_energy;
    material.springs = springs;
    return material;
}

} // namespace hybmss::stability
