#pragma once

/// \file
/// Random lattices and displacements, the materials and forms of springs that the properties are asked of. Every draw
/// comes from a seed.

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "reference/body.hpp"

#include <random>
#include <span>
#include <string>
#include <vector>

namespace hybmss::testing {

using reference::Matrix3d;
using reference::Vector3d;

class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}

    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    std::size_t below(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(engine_); }
    Vector3d vector(double bound) {
        const double x = between(-bound, bound), y = between(-bound, bound), z = between(-bound, bound);
        return {x, y, z};
    }
    Vector3d direction() {
        for (;;) {
            const Vector3d v = vector(1);
            if (v.norm() > 0.1 && v.norm() <= 1) {
                return v.normalized();
            }
        }
    }
    Matrix3d matrix(double bound) {
        Matrix3d m;
        m << vector(bound), vector(bound), vector(bound);
        return m;
    }

private:
    std::mt19937 engine_;
};

/// Scales in [0.2, 3], about `void_share` of the cells empty: at least one, where there are several, and never all.
inline Lattice random_lattice(int nx, int ny, int nz, double cell_size, Random& random, double void_share = 0.2) {
    std::vector<float> scales(static_cast<std::size_t>(nx * ny * nz));
    for (float& scale : scales) {
        scale = random.between(0, 1) < void_share ? 0.0f : static_cast<float>(random.between(0.2, 3));
    }
    const std::size_t filled = random.below(scales.size());
    scales[filled] = 1.5f;
    if (scales.size() > 1) {
        scales[(filled + 1) % scales.size()] = 0.0f;
    }
    return Lattice::from_cells(nx, ny, nz, cell_size, scales);
}

inline std::vector<Vector3d> random_displacement(std::size_t nodes, double bound, Random& random) {
    std::vector<Vector3d> u;
    for (std::size_t n = 0; n < nodes; ++n) {
        u.push_back(random.vector(bound));
    }
    return u;
}

/// u = F X + t - X
inline std::vector<Vector3d> affine_displacement(const reference::Body& body, const Matrix3d& f,
                                                 const Vector3d& t = Vector3d::Zero()) {
    std::vector<Vector3d> u;
    for (const Vector3d& x : body.rest) {
        u.push_back((f - Matrix3d::Identity()) * x + t);
    }
    return u;
}

inline constexpr double kPoissonRatios[] = {-0.5, 0, 0.25, 0.45, 0.4999};
inline constexpr double kFaceDiagonalRatios[] = {0, 0.3, 1, 10};
inline constexpr VolumeEnergy kVolumeEnergies[] = {VolumeEnergy::quadratic, VolumeEnergy::mean_stretch};

/// Each Poisson's ratio with each face diagonal ratio and each volume energy.
inline std::vector<Material> materials() {
    std::vector<Material> all;
    for (double nu : kPoissonRatios) {
        for (double ratio : kFaceDiagonalRatios) {
            for (VolumeEnergy energy : kVolumeEnergies) {
                all.push_back({1e4, nu, 1000, ratio, energy});
            }
        }
    }
    return all;
}

inline constexpr SpringForm kSpringForms[] = {SpringForm::nodes, SpringForm::means};

inline Material with_springs_on(SpringForm form, Material material) {
    material.springs = form;
    return material;
}

inline std::string describe(SpringForm form) {
    return form == SpringForm::nodes ? "springs between nodes, " : "springs on means, ";
}

inline std::string describe(const Material& m) {
    return "nu = " + std::to_string(m.poisson_ratio) + ", A = " + std::to_string(m.face_diagonal_ratio) +
           (m.volume_energy == VolumeEnergy::quadratic ? ", quadratic" : ", mean stretch");
}

} // namespace hybmss::testing
