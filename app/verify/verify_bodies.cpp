#include "app/verify/verify_bodies.hpp"

#include "app/verify/verify_networks.hpp"
#include "bench/standard_bodies.hpp"
#include "reference/assembly.hpp"

#include <array>
#include <random>

namespace hybmss::verify {
namespace {

struct NamedLattice {
    std::string name;
    Lattice lattice;
};

std::string shape_name(const std::array<int, 3>& n) {
    return std::to_string(n[0]) + "x" + std::to_string(n[1]) + "x" + std::to_string(n[2]);
}

NamedLattice box(const std::array<int, 3>& n, double cell_size) {
    return {"box " + shape_name(n), Lattice::box(n[0], n[1], n[2], cell_size)};
}

/// Each cell is there with the probability `fill`, with a stiffness between a tenth and three times the material's.
NamedLattice random_mask(const std::array<int, 3>& n, double fill, double cell_size, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    std::uniform_real_distribution<float> scale(0.1f, 3.0f);
    std::vector<float> scales(static_cast<std::size_t>(n[0] * n[1] * n[2]));
    for (float& s : scales) {
        s = uniform(random) < fill ? scale(random) : 0.0f;
    }
    return {"mask " + shape_name(n) + " filled " + std::to_string(static_cast<int>(100 * fill + 0.5)) + "%",
            Lattice::from_cells(n[0], n[1], n[2], cell_size, std::move(scales))};
}

/// The cells for which `keep(i, j, k)` holds, all of the scale 1.
template <class Keep>
NamedLattice pattern(const std::string& name, const std::array<int, 3>& n, Keep keep) {
    Lattice lattice = Lattice::box(n[0], n[1], n[2], 0.25);
    for (int k = 0; k < n[2]; ++k) {
        for (int j = 0; j < n[1]; ++j) {
            for (int i = 0; i < n[0]; ++i) {
                if (!keep(i, j, k)) {
                    lattice.set_cell_scale(i, j, k, 0.0f);
                }
            }
        }
    }
    return {name, std::move(lattice)};
}

std::vector<NamedLattice> lattices(std::mt19937& random) {
    std::vector<NamedLattice> all;
    // Below, at and above the width of a vector, in every axis; then Table 6 of Golec et al.
    for (const std::array<int, 3>& n : {std::array<int, 3>{1, 1, 1},
                                        {2, 1, 1},
                                        {1, 1, 7},
                                        {3, 2, 5},
                                        {7, 5, 3},
                                        {16, 4, 4},
                                        {17, 16, 15},
                                        {33, 17, 9}}) {
        all.push_back(box(n, 0.3));
    }
    for (const std::array<int, 3>& n : kTable6) {
        all.push_back(box(n, n[0] == n[2] ? 0.5 : 0.1));
    }
    all.push_back(random_mask({9, 8, 7}, 0.3, 0.3, random));
    all.push_back(random_mask({16, 3, 5}, 0.5, 0.3, random));
    all.push_back(random_mask({5, 17, 6}, 0.7, 0.02, random));
    all.push_back(random_mask({35, 4, 6}, 0.9, 3.0, random));
    all.push_back(pattern("two cells sharing an edge", {2, 2, 1}, [](int i, int j, int) { return i == j; }));
    all.push_back(
        pattern("two cells sharing a corner", {2, 2, 2}, [](int i, int j, int k) { return i == j && j == k; }));
    all.push_back(pattern("checkerboard 17x4x5", {17, 4, 5}, [](int i, int j, int k) { return (i + j + k) % 2 == 0; }));
    all.push_back(pattern("separate slabs 6x5x7", {6, 5, 7}, [](int i, int, int k) { return i != 2 && k != 4; }));
    return all;
}

struct NamedMaterial {
    std::string name;
    Material material;
};

/// kappa is well above the springs' moduli (nu = 0.45) for the quadratic energy, negative (nu = 0) for mean stretch.
std::vector<NamedMaterial> materials() {
    std::vector<NamedMaterial> all;
    for (const double ratio : {0.0, 1.0}) {
        const std::string prefix = ratio == 0.0 ? "A=0 " : "A=1 ";
        Material m;
        m.face_diagonal_ratio = ratio;
        m.poisson_ratio = 0.45;
        m.volume_energy = VolumeEnergy::quadratic;
        all.push_back({prefix + "quadratic", m});
        m.poisson_ratio = 0.0;
        m.volume_energy = VolumeEnergy::mean_stretch;
        all.push_back({prefix + "mean_stretch", m});
        m.poisson_ratio = 0.3;
        m.volume_energy = VolumeEnergy::none;
        all.push_back({prefix + "none", m});
        m.stiffening = {1, 3};
        m.volume_energy = ratio == 0.0 ? VolumeEnergy::none : VolumeEnergy::quadratic;
        all.push_back({prefix + "stiffening", m});
    }
    return all;
}

TestBody from_lattice(const NamedLattice& named, const NamedMaterial& material) {
    return {named.name, material.name, named.lattice, material.material, {}, named.lattice.cell_size()};
}

void append_networks(std::vector<TestBody>& bodies, unsigned seed) {
    for (VolumeEnergy energy : {VolumeEnergy::quadratic, VolumeEnergy::mean_stretch, VolumeEnergy::none}) {
        const char* variant = energy == VolumeEnergy::quadratic      ? "network quadratic"
                              : energy == VolumeEnergy::mean_stretch ? "network mean_stretch"
                                                                     : "network none";
        for (NamedNetwork& named : hand_made_networks(energy, seed)) {
            bodies.push_back({named.name, variant, {}, {}, std::move(named.network), kNetworkCellSize});
        }
    }
    for (NamedNetwork& named : hand_made_networks(VolumeEnergy::none, seed)) {
        named.network.stiffening = {1, 3};
        bodies.push_back({named.name, "network stiffening", {}, {}, std::move(named.network), kNetworkCellSize});
    }
}

} // namespace

std::vector<TestBody> test_bodies(Extent extent, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<TestBody> bodies;
    for (const NamedLattice& named : lattices(random)) {
        if (extent == Extent::quick && named.lattice.cell_count() > 1000) {
            continue;
        }
        for (const NamedMaterial& material : materials()) {
            bodies.push_back(from_lattice(named, material));
        }
    }
    append_networks(bodies, seed);
    return bodies;
}

std::vector<TestBody> property_bodies(unsigned seed) {
    std::mt19937 random(seed);
    const std::vector<NamedMaterial> all = materials();
    std::vector<TestBody> bodies;
    for (const NamedMaterial& material : all) {
        bodies.push_back(from_lattice(box({5, 4, 3}, 0.5), material));
        bodies.push_back(from_lattice(random_mask({19, 4, 5}, 0.6, 0.5, random), material));
    }
    append_networks(bodies, seed);
    return bodies;
}

reference::Body reference_body(const TestBody& body) {
    return body.lattice ? reference::assemble(*body.lattice, body.material) : reference::assemble(body.network);
}

} // namespace hybmss::verify
