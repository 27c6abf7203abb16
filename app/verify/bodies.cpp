#include "app/verify/bodies.hpp"

#include "bench/standard_bodies.hpp"
#include "hybmss/polyhedra.hpp"
#include "reference/body.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <future>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <thread>
#include <utility>

namespace hybmss::verify {
namespace {

template <class Thing>
struct Named {
    std::string name;
    Thing thing;
};

std::string shape_name(const std::array<int, 3>& n) {
    return std::to_string(n[0]) + "x" + std::to_string(n[1]) + "x" + std::to_string(n[2]);
}

Named<Lattice> box(const std::array<int, 3>& n, double cell_size) {
    return {"box " + shape_name(n), Lattice::box(n[0], n[1], n[2], cell_size)};
}

/// Each cell is there with the probability `fill`, with a stiffness between a tenth and three times the material's.
Named<Lattice> random_mask(const std::array<int, 3>& n, double fill, double cell_size, std::mt19937& random) {
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
Named<Lattice> pattern(const std::string& name, const std::array<int, 3>& n, Keep keep) {
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

std::vector<Named<Lattice>> lattices(std::mt19937& random) {
    std::vector<Named<Lattice>> all;
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

/// Of three materials at random, volume forces none, quadratic and by mean stretch, and with fills.
constexpr const char* kTissues = "tissues";

Lattice with_tissues(Lattice lattice) {
    std::vector<std::uint8_t> of_cells(lattice.cell_scales().size());
    std::mt19937 random(static_cast<unsigned>(of_cells.size()));
    for (std::uint8_t& tissue : of_cells) {
        tissue = static_cast<std::uint8_t>(random() % 3);
    }
    std::vector<float> fills(of_cells.size());
    std::generate(fills.begin(), fills.end(), [&] { return 0.1f + 0.1f * static_cast<float>(random() % 12); });
    lattice.set_tissues({{0.45, 3000}, {0.0, 500}}, std::move(of_cells));
    lattice.set_fills(std::move(fills));
    return lattice;
}

/// kappa is well above the springs' moduli (nu = 0.45) for the quadratic energy, negative (nu = 0) for mean stretch.
std::vector<Named<Material>> materials() {
    std::vector<Named<Material>> all;
    for (const auto& [ratio, springs] : {std::pair{0.0, SpringForm::nodes},
                                         {1.0, SpringForm::nodes},
                                         {0.0, SpringForm::means},
                                         {1.0, SpringForm::means}}) {
        const std::string prefix =
            std::string(springs == SpringForm::means ? "M " : "") + (ratio == 0.0 ? "A=0 " : "A=1 ");
        Material m;
        m.springs = springs;
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
        if (ratio == (springs == SpringForm::means ? 0.0 : 1.0)) {
            // With stiffening, one pass beside another; a ratio that small strains come below too.
            m.crush = {20, 0.995};
            all.push_back({prefix + "crush", m});
        }
        if (springs == SpringForm::nodes) {
            all.push_back({prefix + kTissues, Material{.face_diagonal_ratio = ratio}});
        }
    }
    return all;
}

// ---- networks that are no lattice: sheared cells, extra springs, a hub, scattered numbering, glued boxes

/// The typical distance of neighbours in all of them, m.
inline constexpr double kNetworkCellSize = 0.5;

using Position = std::array<double, 3>;

std::size_t index(std::int32_t node) {
    return static_cast<std::size_t>(node);
}

Position between(const Position& a, const Position& b) {
    return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

void add_spring(Network& network, std::int32_t a, std::int32_t b, double stiffness) {
    network.springs.push_back(
        {a, b, stiffness, between(network.rest_positions[index(a)], network.rest_positions[index(b)])});
}

enum class Numbering { in_rows, at_random };

/// The same with its nodes numbered at random.
Network renumbered(Network network, std::mt19937& random) {
    const Network old = network;
    std::vector<std::int32_t> number(network.masses.size());
    std::iota(number.begin(), number.end(), 0);
    std::shuffle(number.begin(), number.end(), random);
    for (std::size_t n = 0; n < number.size(); ++n) {
        network.rest_positions[index(number[n])] = old.rest_positions[n];
        network.masses[index(number[n])] = old.masses[n];
    }
    for (Network::Spring& spring : network.springs) {
        spring.a = number[index(spring.a)];
        spring.b = number[index(spring.b)];
    }
    for (Network::Cell& cell : network.cells) {
        for (std::int32_t& node : cell.nodes) {
            node = number[index(node)];
        }
    }
    for (Network::Polyhedron& polyhedron : network.polyhedra) {
        for (std::size_t c = 0; c < polyhedron.node_count(); ++c) {
            polyhedron.nodes[c] = number[index(polyhedron.nodes[c])];
        }
    }
    return network;
}

/// Cells of other shapes, off their lattice's places, of mixed stiffness.
Network irregular(Network network, std::mt19937& random) {
    std::uniform_real_distribution<double> jitter(-0.08 * kNetworkCellSize, 0.08 * kNetworkCellSize);
    std::uniform_real_distribution<double> factor(0.5, 2.0);
    for (Position& x : network.rest_positions) {
        x = {x[0] + jitter(random), x[1] + jitter(random), x[2] + jitter(random)};
    }
    for (Network::Spring& s : network.springs) {
        s.stiffness *= factor(random);
        s.rest_vector = between(network.rest_positions[index(s.a)], network.rest_positions[index(s.b)]);
    }
    for (Network::Polyhedron& p : network.polyhedra) {
        p.kappa *= p.kappa < 0 ? 0.25 * factor(random) : factor(random); // as in sheared_cells()
    }
    return network;
}

/// Sheared, stretched and slightly irregular hexahedra of mixed stiffness and mass, with a hundred springs across the
/// body on top.
Network sheared_cells(VolumeEnergy energy, Numbering numbering, std::mt19937& random) {
    Material material;
    material.poisson_ratio = energy == VolumeEnergy::mean_stretch ? 0.1 : 0.4;
    material.volume_energy = energy;
    const Network lattice = Network::from_lattice(Lattice::box(6, 5, 4, kNetworkCellSize), material);

    Network network;
    network.volume_energy = energy == VolumeEnergy::none ? VolumeEnergy::quadratic : energy;
    const std::size_t count = lattice.rest_positions.size();
    std::vector<std::int32_t> number(count);
    std::iota(number.begin(), number.end(), 0);
    if (numbering == Numbering::at_random) {
        std::shuffle(number.begin(), number.end(), random);
    }
    std::uniform_real_distribution<double> jitter(-0.1 * kNetworkCellSize, 0.1 * kNetworkCellSize);
    std::uniform_real_distribution<double> factor(0.5, 2.0);
    network.rest_positions.resize(count);
    network.masses.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
        const auto& [x, y, z] = lattice.rest_positions[n];
        network.rest_positions[index(number[n])] = {x + 0.6 * y + jitter(random), 1.2 * y - 0.3 * z + jitter(random),
                                                    0.9 * z + 0.2 * x + jitter(random)};
        network.masses[index(number[n])] = lattice.masses[n] * factor(random);
    }
    for (const Network::Spring& spring : lattice.springs) {
        add_spring(network, number[index(spring.a)], number[index(spring.b)], spring.stiffness * factor(random));
    }
    for (Network::Cell cell : lattice.cells) {
        for (std::int32_t& node : cell.nodes) {
            node = number[index(node)];
        }
        // A negative kappa must stay below what the softest springs around it can hold, or the body explodes.
        cell.kappa *= cell.kappa < 0 ? 0.25 * factor(random) : factor(random);
        network.cells.push_back(cell);
    }
    std::uniform_int_distribution<std::int32_t> any(0, static_cast<std::int32_t>(count) - 1);
    for (int s = 0; s < 100; ++s) {
        const std::int32_t a = any(random), b = any(random);
        if (a != b) {
            add_spring(network, a, b, 1e3 * factor(random));
        }
    }
    return network;
}

/// One node tied to all others, in a ring: the worst case for colouring.
Network hub(std::mt19937& random) {
    Network network;
    std::uniform_real_distribution<double> stiffness(100.0, 5e3);
    std::uniform_real_distribution<double> height(-1.0, 1.0);
    network.rest_positions.push_back({0, 0, 0});
    for (std::int32_t n = 1; n <= 77; ++n) {
        network.rest_positions.push_back(
            {kNetworkCellSize * ((n % 9) - 4.5), height(random), kNetworkCellSize * ((n / 9) - 3.5)});
        add_spring(network, n % 2 ? 0 : n, n % 2 ? n : 0, stiffness(random));
        if (n > 1) {
            add_spring(network, n - 1, n, stiffness(random));
        }
    }
    network.masses.assign(network.rest_positions.size(), 2.0);
    return network;
}

/// Two nodes and one spring, and a third node that nothing holds.
Network one_spring() {
    Network network;
    network.rest_positions = {{0, 0, 0}, {0.3, -0.4, 0.2}, {5, 5, 5}};
    network.masses = {1.0, 2.0, 3.0};
    add_spring(network, 1, 0, 800.0);
    return network;
}

/// Up to six springs a node to random partners near it, as in a truss or a cloth.
Network random_truss(std::mt19937& random) {
    Network network;
    std::uniform_real_distribution<double> jitter(-0.2 * kNetworkCellSize, 0.2 * kNetworkCellSize);
    std::uniform_real_distribution<double> stiffness(10.0, 1e4);
    std::uniform_int_distribution<std::int32_t> ahead(1, 40);
    for (std::int32_t n = 0; n < 500; ++n) {
        network.rest_positions.push_back({kNetworkCellSize * (n % 10) + jitter(random),
                                          kNetworkCellSize * (n / 10 % 10) + jitter(random),
                                          kNetworkCellSize * (n / 100) + jitter(random)});
    }
    network.masses.assign(network.rest_positions.size(), 0.5);
    std::set<std::pair<std::int32_t, std::int32_t>> tied;
    for (std::int32_t n = 0; n < 500; ++n) {
        for (int s = 0; s < 6; ++s) {
            const std::int32_t other = n + ahead(random);
            if (other < 500 && tied.emplace(n, other).second) {
                add_spring(network, s % 2 ? n : other, s % 2 ? other : n, stiffness(random));
            }
        }
    }
    return network;
}

/// Boxes that share a face, one on means and one between nodes, and a box of smaller cells on means that a few springs
/// tie to them, all of mixed stiffness.
Network glued_boxes(VolumeEnergy energy, std::mt19937& random) {
    std::uniform_real_distribution<double> factor(0.5, 2.0);
    Network network;
    std::map<Position, std::int32_t> number;
    const auto glue = [&](const std::array<int, 3>& n, double cell_size, SpringForm form, double x) {
        Material material;
        material.poisson_ratio = energy == VolumeEnergy::mean_stretch ? 0.1 : 0.4;
        material.volume_energy = energy;
        material.springs = form;
        const Network box = Network::from_lattice(Lattice::box(n[0], n[1], n[2], cell_size), material);
        std::vector<std::int32_t> numbers;
        for (std::size_t i = 0; i < box.masses.size(); ++i) {
            const Position at = {box.rest_positions[i][0] + x, box.rest_positions[i][1], box.rest_positions[i][2]};
            const auto [found, is_new] = number.emplace(at, static_cast<std::int32_t>(network.masses.size()));
            if (is_new) {
                network.rest_positions.push_back(at);
                network.masses.push_back(0);
            }
            numbers.push_back(found->second);
            network.masses[index(found->second)] += box.masses[i];
        }
        for (const Network::Spring& spring : box.springs) {
            add_spring(network, numbers[index(spring.a)], numbers[index(spring.b)], spring.stiffness * factor(random));
        }
        for (Network::Cell cell : box.cells) {
            for (std::int32_t& node : cell.nodes) {
                node = numbers[index(node)];
            }
            const double by = factor(random);
            cell.kappa *= cell.kappa < 0 ? 0.25 * by : by;
            cell.scale *= by * cell_size / kNetworkCellSize;
            network.cells.push_back(cell);
        }
        network.means = form == SpringForm::means && cell_size == kNetworkCellSize ? box.means : network.means;
        network.volume_energy = box.volume_energy;
    };
    glue({18, 4, 3}, kNetworkCellSize, SpringForm::means, 0);
    glue({3, 4, 3}, kNetworkCellSize, SpringForm::nodes, 18 * kNetworkCellSize);
    glue({4, 3, 5}, kNetworkCellSize / 2, SpringForm::means, -3 * kNetworkCellSize);
    const auto count = static_cast<std::int32_t>(network.masses.size());
    for (std::int32_t s = 0; s < 30; ++s) {
        add_spring(network, 7 * s % count, count - 1 - s, 1e3 * factor(random));
    }
    return network;
}

/// With `none` those of springs alone are added. Random parts follow from the seed alone.
std::vector<Named<Network>> hand_made_networks(VolumeEnergy energy, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Named<Network>> all;
    all.push_back({"sheared cells with extra springs", sheared_cells(energy, Numbering::at_random, random)});
    if (energy == VolumeEnergy::none) {
        all.push_back({"hub of 77 springs", hub(random)});
        all.push_back({"one spring", one_spring()});
        all.push_back({"random truss", random_truss(random)});
    }
    // Last: the bodies above stay what a seed has always made.
    all.push_back({"sheared cells numbered in rows", sheared_cells(energy, Numbering::in_rows, random)});
    const Network glued = glued_boxes(energy, random);
    all.push_back({"glued boxes on means", glued});
    all.push_back({"glued boxes on means, numbered at random", renumbered(glued, random)});
    if (energy == VolumeEnergy::none) {
        return all;
    }
    Material material;
    material.poisson_ratio = energy == VolumeEnergy::mean_stretch ? 0.1 : 0.4;
    Network tetrahedra = irregular(tetrahedron_lattice({6, 5, 4}, kNetworkCellSize, material), random);
    all.push_back({"tetrahedra and pyramids", tetrahedra});
    tetrahedra.nodal_volumes = true;
    all.push_back({"tetrahedra and pyramids with volumes of nodes", tetrahedra});
    const Network prisms = prism_lattice({7, 5, 3}, kNetworkCellSize, 0.9 * kNetworkCellSize, material);
    all.push_back({"prisms, numbered at random", renumbered(irregular(prisms, random), random)});
    return all;
}

TestBody from_lattice(const Named<Lattice>& named, const Named<Material>& material) {
    return {named.name,
            material.name,
            material.name.ends_with(kTissues) ? with_tissues(named.thing) : named.thing,
            material.thing,
            {},
            named.thing.cell_size()};
}

void append_networks(std::vector<TestBody>& bodies, unsigned seed) {
    for (VolumeEnergy energy : {VolumeEnergy::quadratic, VolumeEnergy::mean_stretch, VolumeEnergy::none}) {
        const char* variant = energy == VolumeEnergy::quadratic      ? "network quadratic"
                              : energy == VolumeEnergy::mean_stretch ? "network mean_stretch"
                                                                     : "network none";
        for (Named<Network>& named : hand_made_networks(energy, seed)) {
            bodies.push_back({named.name, variant, {}, {}, std::move(named.thing), kNetworkCellSize});
        }
    }
    for (Named<Network>& named : hand_made_networks(VolumeEnergy::none, seed)) {
        named.thing.stiffening = {1, 3};
        bodies.push_back({named.name, "network stiffening", {}, {}, std::move(named.thing), kNetworkCellSize});
    }
}

} // namespace

std::vector<TestBody> test_bodies(Extent extent, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<TestBody> bodies;
    for (const Named<Lattice>& named : lattices(random)) {
        if (extent == Extent::quick && named.thing.cell_count() > 1000) {
            continue;
        }
        for (const Named<Material>& material : materials()) {
            bodies.push_back(from_lattice(named, material));
        }
    }
    append_networks(bodies, seed);
    return bodies;
}

std::vector<TestBody> property_bodies(unsigned seed) {
    std::mt19937 random(seed);
    const std::vector<Named<Material>> all = materials();
    std::vector<TestBody> bodies;
    for (const Named<Material>& material : all) {
        bodies.push_back(from_lattice(box({5, 4, 3}, 0.5), material));
        bodies.push_back(from_lattice(random_mask({19, 4, 5}, 0.6, 0.5, random), material));
    }
    append_networks(bodies, seed);
    return bodies;
}

reference::Body reference_body(const TestBody& body) {
    return body.lattice ? reference::assemble(*body.lattice, body.material) : reference::assemble(body.network);
}

void for_each_body(const std::vector<TestBody>& bodies, RowTable& table,
                   const std::function<void(const TestBody&, RowTable&)>& check) {
    std::vector<RowTable> tables(bodies.size());
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t b = next++; b < bodies.size(); b = next++) {
            check(bodies[b], tables[b]);
        }
    };
    std::vector<std::future<void>> others;
    for (unsigned other = 1; other < std::thread::hardware_concurrency(); ++other) {
        others.push_back(std::async(std::launch::async, work));
    }
    work();
    for (std::future<void>& other : others) {
        other.get();
    }
    for (const RowTable& of_body : tables) {
        table.append(of_body);
    }
}

} // namespace hybmss::verify
