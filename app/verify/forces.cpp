#include "app/verify/bodies.hpp"

#include "hybmss/force_plan.hpp"
#include "plan/bodies/layout_table.hpp"
#include "reference/forces.hpp"
#include "reference/springs.hpp"
#include "reference/volume_energy.hpp"

#include <algorithm>

namespace hybmss::verify {
namespace {

using Eigen::Vector3d;

constexpr double kStrains[] = {1e-7, 1e-3, 0.1, 0.5};

/// What the reference says of one body at one strain; computed once, compared with every kernel.
struct Expected {
    double strain;
    std::vector<Vector3d> displacements; ///< as the precision holds them
    std::vector<Vector3d> forces;
    double force_scale;
    reference::Energy energy;
    std::vector<Vector3d> direction, product; ///< p, as the precision holds it, and K p; empty for large bodies
    double product_scale = 0;
};

/// reference::energy() with its sums in long double: in double they lose as many digits as what is being checked.
reference::Energy accurate_energy(const reference::Body& body, const std::vector<Vector3d>& u) {
    const auto at = [&](int node) { return u[static_cast<std::size_t>(node)]; };
    long double springs = 0, volume = 0;
    for (const reference::Spring& s : body.springs) {
        const Vector3d du = at(s.b) - at(s.a);
        springs += reference::spring_energy(s.stiffness, s.rest_vector, du) +
                   reference::stiffening_energy(body.stiffening, s.stiffness, s.rest_vector, du);
    }
    const auto corners_of = [&](const auto& cell) {
        reference::Corners corners;
        for (std::size_t c = 0; c < 8; ++c) {
            corners[c] = at(cell.nodes[c]);
        }
        return corners;
    };
    for (const reference::Cell& cell : body.cells) {
        volume += reference::cell_energy(body.volume_energy, cell, corners_of(cell));
    }
    for (const reference::VolumeSum& volumes : body.volume_sums) {
        volume += reference::volume_sum_energy(body, volumes, u);
    }
    for (const reference::MeanSprings& cell : body.mean_springs) {
        springs += reference::mean_spring_energy(body.stiffening, cell, corners_of(cell));
    }
    return {static_cast<double>(springs), static_cast<double>(volume)};
}

/// The reference makes a 24 x 24 block a cell, which takes it longer than all kernels together.
constexpr std::size_t kMostCellsOfProducts = 5000;

template <class T>
std::vector<Expected> expected_values(const TestBody& body, unsigned seed) {
    const reference::Body reference = reference_body(body);
    std::mt19937 random(seed);
    const std::size_t nodes = reference.rest.size();
    std::vector<Expected> all;
    for (const double strain : kStrains) {
        const std::vector<Vector3d> u = random_vectors<T>(nodes, strain * body.cell_size, random);
        const std::vector<double> scales = reference::force_scale(reference, u);
        all.push_back({strain,
                       u,
                       reference::forces(reference, u),
                       *std::max_element(scales.begin(), scales.end()),
                       accurate_energy(reference, u),
                       {},
                       {}});
        if (!body.lattice || body.lattice->cell_count() <= kMostCellsOfProducts) {
            Expected& expected = all.back();
            expected.direction = random_vectors<T>(nodes, body.cell_size, random);
            const std::vector<double> product_scales =
                reference::hessian_product_scale(reference, u, expected.direction);
            expected.product = reference::hessian_product(reference, u, expected.direction);
            expected.product_scale = *std::max_element(product_scales.begin(), product_scales.end());
        }
    }
    return all;
}

template <class T>
double force_error(const ForcePlan<T>& plan, Arrangement arrangement, const Expected& expected) {
    NodeArray<T> u(arrangement, expected.displacements);
    NodeArray<T> f(arrangement, expected.displacements.size());
    plan.add_forces(u.field(), f.field());
    return max_difference(f.vectors(), expected.forces) / expected.force_scale;
}

template <class T>
double product_error(const ForcePlan<T>& plan, Arrangement arrangement, const Expected& expected) {
    NodeArray<T> u(arrangement, expected.displacements), p(arrangement, expected.direction);
    NodeArray<T> kp(arrangement, expected.displacements.size());
    plan.add_hessian_product(u.field(), p.field(), kp.field());
    return max_difference(kp.vectors(), expected.product) / expected.product_scale;
}

template <class T>
double energy_error(const ForcePlan<T>& plan, Arrangement arrangement, const Expected& expected) {
    NodeArray<T> u(arrangement, expected.displacements);
    const PotentialEnergy energy = plan.energy(u.field());
    const double error =
        std::abs(energy.springs - expected.energy.springs) + std::abs(energy.volume - expected.energy.volume);
    return error / (std::abs(expected.energy.springs) + std::abs(expected.energy.volume));
}

template <class T>
void compare(const TestBody& body, const MatrixOptions& options, RowTable& table) {
    const std::vector<Expected> all = expected_values<T>(body, options.seed);
    std::size_t turn = all.front().displacements.size(); // so that every arrangement meets every row
    for (RowKey key : kernel_keys(body, options.instruction_sets, precision_name<T>())) {
        const auto plan = make_planned<ForcePlan<T>>(body, plan_options(key));
        key.variant = body.variant;
        for (const Expected& expected : all) {
            const Arrangement arrangement = kArrangements[turn++ % std::size(kArrangements)];
            key.strain = expected.strain;
            key.check = "forces";
            table.record(key, force_error(plan, arrangement, expected), body.name);
            key.check = "energy";
            table.record(key, energy_error(plan, arrangement, expected), body.name);
            if (!expected.product.empty()) {
                key.check = "hessian product";
                table.record(key, product_error(plan, arrangement, expected), body.name);
            }
        }
    }
}

} // namespace

std::vector<RowKey> kernel_keys(const TestBody& body, const std::vector<InstructionSet>& sets,
                                const std::string& precision) {
    std::vector<std::string> layouts = body.lattice ? distinct_lattice_layouts() : network_layouts();
    if (body.lattice && !can_be_network(*body.lattice, body.material)) {
        const std::vector<std::string> networks = network_layouts();
        std::erase_if(layouts, [&](const std::string& layout) {
            return std::find(networks.begin(), networks.end(), layout) != networks.end();
        });
    }
    std::vector<RowKey> keys;
    for (const std::string& layout : layouts) {
        for (const InstructionSet set : sets) {
            for (const Accuracy accuracy : {Accuracy::fast, Accuracy::accurate, Accuracy::exact}) {
                keys.push_back({"", layout, set, accuracy, precision, "", 0});
            }
        }
    }
    return keys;
}

PlanOptions plan_options(const RowKey& key) {
    PlanOptions options;
    options.layout = key.layout;
    options.instruction_set = key.instruction_set;
    options.accuracy = key.accuracy;
    return options;
}

void run_force_matrix(const MatrixOptions& options, RowTable& table) {
    for_each_body(test_bodies(options.extent, options.seed), table, [&](const TestBody& body, RowTable& rows) {
        compare<float>(body, options, rows);
        compare<double>(body, options, rows);
    });
}

RowTable run_matrix(const MatrixOptions& options) {
    MatrixOptions all = options;
    if (all.instruction_sets.empty()) {
        all.instruction_sets = available_instruction_sets();
    }
    RowTable table;
    run_properties(all, table);
    run_dynamics(all, table);
    run_force_matrix(all, table);
    return table;
}

} // namespace hybmss::verify
