// Cells of another size at rest: what they add is exactly what makes them such cells, in forces, energies and second
// derivatives, in steps and in equilibria.

#include "dynamics/effects/actuation.hpp"
#include "hybmss/equilibrium.hpp"
#include "plan/tuning/planned_body.hpp"
#include "tests/moving_body.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

using testing::expect_refusal;

constexpr double kCellSize = 0.1;

std::vector<std::uint32_t> all_cells(const Lattice& lattice) {
    std::vector<std::uint32_t> cells;
    for (std::uint32_t c = 0; c < lattice.cell_scales().size(); ++c) {
        if (lattice.cell_scales()[c] > 0) {
            cells.push_back(c);
        }
    }
    return cells;
}

/// A body with a hole, a stiff corner, and a step.
Lattice holed(double cell_size) {
    Lattice lattice = Lattice::box(4, 3, 3, cell_size);
    lattice.set_cell_scale(1, 1, 1, 0);
    lattice.set_cell_scale(3, 2, 2, 0);
    lattice.set_cell_scale(3, 2, 1, 0);
    lattice.set_cell_scale(0, 0, 0, 4);
    return lattice;
}

struct Law {
    const char* name;
    Material material;
};
std::vector<Law> laws() {
    std::vector<Law> all;
    for (const SpringForm form : {SpringForm::nodes, SpringForm::means}) {
        for (const double nu : {0.1, 0.25, 0.45}) {
            all.push_back({form == SpringForm::nodes ? "nodes" : "means", {1e5, nu, 1000, 1}});
            all.back().material.springs = form;
        }
        all.push_back(all.back());
        all.back().material.stiffening = {0.4, 0.9};
        all.back().material.crush = {20, 0.95};
        all.push_back(all.back());
        all.back().material.face_diagonal_ratio = 0;
        all.back().material.volume_energy = VolumeEnergy::mean_stretch;
    }
    return all;
}

template <class T>
struct Feeling {
    std::vector<T> forces;
    double energy;
};
/// Of a body and its effects at displacements.
template <class T>
Feeling<T> felt(ExplicitDynamics<T>& body, const std::vector<T>& u) {
    const std::size_t n = body.node_count();
    body.set_displacements(VectorField<const T>::aos(u.data(), n));
    Feeling<T> found{std::vector<T>(3 * n), body.potential_energy().total()};
    std::vector<T> more(3 * n);
    body.get_forces(VectorField<T>::aos(found.forces.data(), n));
    body.get_effect_forces(VectorField<T>::aos(more.data(), n));
    for (std::size_t i = 0; i < more.size(); ++i) {
        found.forces[i] += more[i];
    }
    for (const EffectEnergy& effect : body.effect_energies()) {
        found.energy += effect.stored;
    }
    return found;
}
template <class T>
double largest(const std::vector<T>& values) {
    double most = 0;
    for (const T value : values) {
        most = std::max(most, std::abs(static_cast<double>(value)));
    }
    return most;
}

/// Tissues of Poisson's ratios on both sides of 1/4, whose volumes have different laws.
void mix(Lattice& lattice) {
    std::vector<std::uint8_t> tissue(lattice.cell_scales().size());
    for (std::size_t c = 0; c < tissue.size(); ++c) {
        tissue[c] = static_cast<std::uint8_t>(c % 3);
    }
    lattice.set_tissues({{0.05, 900}, {0.4, 1100}}, tissue);
}
bool may_be_mixed(const Material& material) {
    return material.springs == SpringForm::nodes && material.volume_energy == VolumeEnergy::automatic;
}

/// What is grown alike along all axes is a lattice of larger cells.
template <class T>
void expect_a_lattice_of_that_size(double tolerance) {
    for (const InstructionSet set : available_instruction_sets()) {
        PlanOptions options;
        options.instruction_set = set;
        for (const Law& law : laws()) {
            for (const double s : {0.6, 1.3}) {
                Lattice lattice = holed(kCellSize), grown = holed(s * kCellSize);
                if (may_be_mixed(law.material)) {
                    mix(lattice);
                    mix(grown);
                }
                ExplicitDynamics<T> body(lattice, law.material, options), other(grown, law.material, options);
                const std::vector<std::uint32_t> cells = all_cells(lattice), nodes = lattice.nodes();
                body.actuate(lattice, law.material, cells, std::vector<RestStretch>(cells.size(), {s, s, s}));
                std::vector<T> of_other = testing::random_field<T>(nodes.size(), 0.15 * s * kCellSize, 5);
                std::vector<T> of_body(of_other.size());
                for (std::size_t n = 0; n < nodes.size(); ++n) {
                    const auto rest = lattice.rest_position(nodes[n]);
                    for (std::size_t a = 0; a < 3; ++a) {
                        of_body[3 * n + a] = of_other[3 * n + a] + static_cast<T>((s - 1) * rest[a]);
                    }
                }
                const Feeling<T> found = felt(body, of_body), expected = felt(other, of_other);
                const double scale = largest(expected.forces);
                for (std::size_t i = 0; i < of_body.size(); ++i) {
                    ASSERT_NEAR(found.forces[i], expected.forces[i], tolerance * scale)
                        << law.name << ", nu " << law.material.poisson_ratio << ", s " << s << ", " << name(set);
                }
                EXPECT_NEAR(found.energy, expected.energy, 4 * tolerance * expected.energy)
                    << law.name << ", nu " << law.material.poisson_ratio << ", s " << s;
                // The other has s^3 times the mass.
                EXPECT_LE(body.critical_time_step(), other.critical_time_step() * std::pow(s, -1.5) * (1 + 1e-6));
            }
        }
    }
}
TEST(Actuation, a_body_grown_alike_is_a_lattice_of_that_size) {
    expect_a_lattice_of_that_size<double>(1e-12);
    expect_a_lattice_of_that_size<float>(5e-5);
}

TEST(Actuation, what_has_the_size_that_it_grows_to_is_free_of_stress) {
    for (const Law& law : laws()) {
        const Lattice lattice = holed(kCellSize);
        ExplicitDynamics<double> body(lattice, law.material);
        const std::vector<std::uint32_t> cells = all_cells(lattice), nodes = lattice.nodes();
        const RestStretch s = {0.7, 1.2, 0.9};
        body.actuate(lattice, law.material, cells, std::vector<RestStretch>(cells.size(), s));
        std::vector<double> u(3 * nodes.size());
        const double load = largest(felt(body, u).forces);
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            for (std::size_t a = 0; a < 3; ++a) {
                u[3 * n + a] = (s[a] - 1) * lattice.rest_position(nodes[n])[a];
            }
        }
        const Feeling<double> found = felt(body, u);
        EXPECT_GT(load, 1) << law.name;
        EXPECT_LT(largest(found.forces), 1e-12 * load) << law.name << ", nu " << law.material.poisson_ratio;
        EXPECT_NEAR(found.energy, 0, 1e-12 * body.potential_energy().total()) << law.name;
    }
}

TEST(Actuation, forces_and_second_derivatives_are_those_of_the_energy) {
    std::vector<std::pair<Law, InstructionSet>> cases;
    for (const InstructionSet set : available_instruction_sets()) {
        for (const Law& law : laws()) {
            cases.emplace_back(law, set);
        }
    }
    for (const auto& [law, set] : cases) {
        PlanOptions options;
        options.instruction_set = set;
        Lattice lattice = holed(kCellSize);
        if (may_be_mixed(law.material)) {
            mix(lattice);
        }
        const PlannedBody<double> planned = plan_body<double>(lattice, law.material, options, Operation::forces);
        const Body<double>& body = *planned.body;
        std::vector<std::uint32_t> cells = all_cells(lattice);
        cells.erase(cells.begin() + 3, cells.begin() + 9);
        std::vector<RestStretch> stretches;
        for (std::size_t c = 0; c < cells.size(); ++c) {
            const auto part = static_cast<double>(c % 5) / 10;
            stretches.push_back({0.7 + part, 1.3 - part, 0.9 + part / 2});
        }
        const ActuatedBody<double> actuated(body, lattice, law.material, cells, stretches);
        const std::size_t n = body.node_count();
        State<double> state = body.make_state(false);
        const std::vector<double> u = testing::random_field<double>(n, 0.15 * kCellSize, 3),
                                  p = testing::random_field<double>(n, kCellSize, 4);
        const double unit = body.length_unit(), step = 1e-6;
        const auto go_to = [&](double by) {
            std::vector<double> moved(u);
            for (std::size_t i = 0; i < moved.size(); ++i) {
                moved[i] += by * p[i];
            }
            body.write(VectorField<const double>::aos(moved.data(), n), 1 / unit, state.displacement);
        };
        const auto field = [&](const auto& fill) {
            NodeField<double> values;
            Body<double>::allocate_like(state.displacement, values);
            fill(values);
            std::vector<double> read(3 * n);
            body.read(values, 1, VectorField<double>::aos(read.data(), n));
            return read;
        };
        const auto forces = [&] { return field([&](auto& f) { actuated.add_forces(body, state, 1, f); }); };
        go_to(step);
        const double above = actuated.energy(state);
        const std::vector<double> force_above = forces();
        go_to(-step);
        const double below = actuated.energy(state);
        const std::vector<double> force_below = forces();
        go_to(0);
        const std::vector<double> force = forces();
        EXPECT_NEAR((above - below) / (2 * step), -std::inner_product(force.begin(), force.end(), p.begin(), 0.0),
                    1e-7 * largest(force) * kCellSize * static_cast<double>(n))
            << law.name;

        NodeField<double> direction;
        Body<double>::allocate_like(state.displacement, direction);
        body.write(VectorField<const double>::aos(p.data(), n), 1 / unit, direction);
        const std::vector<double> product =
            field([&](auto& out) { actuated.add_product(body, state, direction, out); });
        for (std::size_t i = 0; i < product.size(); ++i) {
            ASSERT_NEAR(product[i], (force_below[i] - force_above[i]) / (2 * step), 1e-6 * largest(product))
                << law.name << ", nu " << law.material.poisson_ratio;
        }

        AlignedArray<double> blocks[6];
        State<double> whole = body.make_state(false);
        body.hessian_diagonal(whole, blocks);
        for (AlignedArray<double>& entry : blocks) {
            std::fill_n(entry.data(), entry.size(), 0.0);
        }
        actuated.add_diagonal(body, state, blocks);
        constexpr std::size_t kEntry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        for (const std::size_t node : {std::size_t{0}, n / 2, n - 1}) {
            for (std::size_t a = 0; a < 3; ++a) {
                std::vector<double> one(3 * n, 0.0);
                one[3 * node + a] = unit;
                body.write(VectorField<const double>::aos(one.data(), n), 1 / unit, direction);
                const std::vector<double> column =
                    field([&](auto& out) { actuated.add_product(body, state, direction, out); });
                for (std::size_t b = 0; b < 3; ++b) {
                    EXPECT_NEAR(blocks[kEntry[a][b]][body.index_of(node)], column[3 * node + b],
                                1e-11 * largest(column))
                        << law.name;
                }
            }
        }
    }
}

TEST(Actuation, energy_that_sizes_put_in_is_told) {
    const Lattice lattice = Lattice::box(4, 4, 8, kCellSize);
    const Material material{1e5, 0.4, 1000, 1};
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        ExplicitDynamics<double> body(lattice, material);
        const std::vector<std::uint32_t> all = all_cells(lattice);
        const std::vector<std::uint32_t> cells(all.begin(), all.begin() + 64);
        body.actuate(lattice, material, cells, std::vector<RestStretch>(cells.size(), {1.2, 1, 1}));
        const EffectEnergy at_once = body.effect_energies().at(0);
        EXPECT_GT(at_once.stored, 1);
        EXPECT_EQ(at_once.dissipated, -at_once.stored);
        body.actuate(lattice, material, cells, std::vector<RestStretch>(cells.size(), {1, 1, 1}));
        StepParameters parameters{.time_step = 0.05 * body.critical_time_step()};
        parameters.integrator = integrator;
        const auto total = [&] {
            double sum = body.kinetic_energy() + body.potential_energy().total();
            for (const EffectEnergy& effect : body.effect_energies()) {
                sum += effect.stored + effect.dissipated;
            }
            return sum;
        };
        double put_in = 0;
        for (int i = 1; i <= 40; ++i) {
            const double s = 1 - 0.2 * std::sin(0.1 * i);
            body.set_rest_stretches(std::vector<RestStretch>(cells.size(), {1, s, 1}));
            body.step(parameters, 20);
            put_in = std::max(put_in, std::abs(body.effect_energies().at(0).dissipated));
        }
        EXPECT_GT(put_in, 0.1);
        EXPECT_NEAR(total(), 0, (integrator == Integrator::leapfrog ? 2e-4 : 0.2) * put_in);
        // Nothing pushes the body from outside.
        std::vector<double> v(3 * body.node_count());
        body.get_velocities(VectorField<double>::aos(v.data(), body.node_count()));
        for (std::size_t a = 0; a < 3; ++a) {
            double momentum = 0, size = 0;
            for (std::size_t n = 0; n < body.node_count(); ++n) {
                momentum += body.masses()[n] * v[3 * n + a];
                size += body.masses()[n] * std::abs(v[3 * n + a]);
            }
            EXPECT_NEAR(momentum, 0, 1e-10 * size);
        }
    }
}

TEST(Actuation, threads_change_no_bit_and_neither_does_a_restart_or_a_muscle_at_rest) {
    const Lattice lattice = Lattice::box(9, 8, 7, kCellSize);
    const Material material{1e5, 0.45, 1000, 1};
    const std::vector<std::uint32_t> cells = all_cells(lattice);
    std::vector<RestStretch> stretches;
    for (std::size_t c = 0; c < cells.size(); ++c) {
        stretches.push_back({1, 0.8 + 0.02 * static_cast<double>(c % 9), 1.1});
    }
    std::uint64_t bits[3] = {};
    for (std::size_t run = 0; run < 3; ++run) {
        PlanOptions options;
        options.threads = run == 2 ? 1 : static_cast<int>(run) + 1;
        ExplicitDynamics<float> body(lattice, material, options);
        body.actuate(lattice, material, cells, stretches);
        const StepParameters parameters{.time_step = 0.5 * body.critical_time_step()};
        body.step(parameters, 20);
        if (run == 2) {
            const std::vector<float> state = body.exact_state();
            const std::vector<double> memory = body.effect_memory();
            ExplicitDynamics<float> other(lattice, material, options);
            other.actuate(lattice, material, cells, stretches);
            other.set_exact_state(state);
            other.set_effect_memory(memory);
            other.step(parameters, 20);
            EXPECT_EQ(other.effect_energies().at(0).dissipated, body.effect_energies().at(0).dissipated);
            bits[run] = testing::bits_of(other.exact_state());
        } else {
            body.step(parameters, 20);
            bits[run] = testing::bits_of(body.exact_state());
        }
    }
    EXPECT_EQ(bits[0], bits[1]);
    EXPECT_EQ(bits[0], bits[2]);

    ExplicitDynamics<float> plain(lattice, material), taken_back(lattice, material);
    taken_back.actuate(lattice, material, cells, stretches);
    taken_back.actuate(lattice, material, {}, {});
    const StepParameters parameters{.time_step = 0.5 * plain.critical_time_step()};
    EXPECT_EQ(plain.critical_time_step(), taken_back.critical_time_step());
    EXPECT_EQ(testing::bits_after(plain, kCellSize, parameters, 10),
              testing::bits_after(taken_back, kCellSize, parameters, 10));
}

TEST(Actuation, cells_that_are_cut_away_act_no_more) {
    Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    const Material material{1e5, 0.4, 1000, 1};
    ExplicitDynamics<double> body(lattice, material);
    const std::vector<std::uint32_t> cells = all_cells(lattice);
    body.actuate(lattice, material, cells, std::vector<RestStretch>(cells.size(), {0.8, 1, 1}));
    const std::vector<std::uint32_t> away = {0, 1, 21, 22, 63};
    Lattice rest = lattice;
    body.remove_cells(lattice, away);
    ExplicitDynamics<double> other(lattice, material);
    const std::vector<std::uint32_t> left = all_cells(lattice);
    other.actuate(lattice, material, left, std::vector<RestStretch>(left.size(), {0.8, 1, 1}));
    // Corners that no cell touches any more are nodes of the first alone.
    const std::vector<double> none(3 * body.node_count()), fewer(3 * other.node_count());
    const std::vector<double> found = felt(body, none).forces, expected = felt(other, fewer).forces;
    const std::vector<std::uint32_t> all = rest.nodes(), there = lattice.nodes();
    for (std::size_t n = 0; n < there.size(); ++n) {
        const auto at = static_cast<std::size_t>(std::lower_bound(all.begin(), all.end(), there[n]) - all.begin());
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(found[3 * at + a], expected[3 * n + a], 1e-12 * largest(expected));
        }
    }
}

TEST(Actuation, refusals_say_what_is_allowed) {
    const Lattice lattice = holed(kCellSize);
    const Material material{1e5, 0.4, 1000, 1};
    ExplicitDynamics<double> body(lattice, material);
    const std::vector<std::uint32_t> one = {0}, gone = {17}, twice = {4, 4}, beyond = {36};
    const std::vector<RestStretch> whole = {{1, 1, 1}}, two(2, {1, 1, 1}), crushed = {{1, 0.05, 1}};
    expect_refusal([&] { body.actuate(lattice, material, gone, whole); }, {"17", "no cell there"});
    expect_refusal([&] { body.actuate(lattice, material, twice, two); }, {"4", "twice"});
    expect_refusal([&] { body.actuate(lattice, material, beyond, whole); }, {"36", "below the grid's 36"});
    expect_refusal([&] { body.actuate(lattice, material, one, two); }, {"2 stretches", "1 actuated"});
    expect_refusal([&] { body.actuate(lattice, material, one, crushed); }, {"0.05", "[0.1", "10"});
    expect_refusal([&] { body.set_rest_stretches(whole); }, {"1 stretches", "0 actuated"});
    EquilibriumSolver<double> solver(lattice, material);
    Loading loading;
    loading.rest_stretches = whole;
    std::vector<double> u(3 * solver.node_count());
    expect_refusal([&] { solver.solve(loading, VectorField<double>::aos(u.data(), solver.node_count())); },
                   {"1 stretches", "no cells"});
}

/// The free body ends as it would have been made.
TEST(Actuation, a_free_body_comes_to_rest_at_its_size) {
    for (const Law& law : laws()) {
        if (law.material.springs == SpringForm::nodes && law.material.face_diagonal_ratio == 0) {
            continue; // wrinkles of the surface are held by little
        }
        const Lattice lattice = Lattice::box(6, 3, 4, kCellSize);
        EquilibriumSolver<double> solver(lattice, law.material);
        const std::vector<std::uint32_t> cells = all_cells(lattice), nodes = lattice.nodes();
        solver.actuate(cells);
        const RestStretch s = {0.7, 1.25, 0.9};
        Loading loading;
        loading.supports = {{0, 7}, {6, 6}, {7 * 3, 4}}; // no more than a body at rest needs
        loading.rest_stretches.assign(cells.size(), s);
        std::vector<double> u(3 * nodes.size());
        const EquilibriumResult result = solver.solve(loading, VectorField<double>::aos(u.data(), nodes.size()));
        ASSERT_EQ(result.status, EquilibriumStatus::converged)
            << law.name << ", nu " << law.material.poisson_ratio << ": " << result.message;
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            for (std::size_t a = 0; a < 3; ++a) {
                ASSERT_NEAR(u[3 * n + a], (s[a] - 1) * lattice.rest_position(nodes[n])[a], 1e-6 * kCellSize)
                    << law.name << ", nu " << law.material.poisson_ratio << ", A " << law.material.face_diagonal_ratio
                    << ", residual " << result.residual << ", Newton " << result.newton_iterations;
            }
        }
        EXPECT_LT(result.newton_iterations, 60) << law.name << ", nu " << law.material.poisson_ratio;
    }
}

TEST(Actuation, load_steps_go_there_in_proportion) {
    const Lattice lattice = Lattice::box(3, 3, 3, kCellSize);
    EquilibriumSolver<double> solver(lattice, {1e5, 0.3, 1000, 1});
    const std::vector<std::uint32_t> cells = all_cells(lattice);
    solver.actuate(cells);
    Loading loading;
    loading.supports = {{0, 7}, {3, 6}, {12, 4}};
    EquilibriumOptions options;
    options.largest_load_step = 0.5;
    // From what they are: 1, then what the first solve was on its way to.
    for (const auto& [goal, left] : {std::pair{1.4, 1.2}, {1.8, 1.6}}) {
        loading.rest_stretches.assign(cells.size(), {goal, goal, goal});
        options.progress = [](const EquilibriumProgress& at) { return at.load_fraction < 1; };
        std::vector<double> u(3 * solver.node_count());
        const auto view = VectorField<double>::aos(u.data(), solver.node_count());
        const EquilibriumResult result = solver.solve(loading, view, options);
        EXPECT_EQ(result.status, EquilibriumStatus::stopped);
        EXPECT_EQ(result.load_fraction, 0.5);
        EXPECT_NEAR(u[3 * 3], (left - 1) * 3 * kCellSize, 1e-6);
    }
}

/// Timoshenko's bimetal (J. Opt. Soc. Am. 11, 1925): two layers alike but for what one of them shrinks by along the
/// strip bend to the curvature 3/2 e/t, t being the thickness of both.
TEST(Actuation, a_strip_of_two_layers_bends_as_a_bimetal_does) {
    constexpr int kAcross = 4, kAlong = 40;
    const Lattice lattice = Lattice::box(kAcross, kAcross, kAlong, kCellSize);
    Material material{1e5, 0.3, 1000, 1};
    material.springs = SpringForm::means;
    EquilibriumSolver<double> solver(lattice, material);
    std::vector<std::uint32_t> muscle;
    for (int k = 0; k < kAlong; ++k) {
        for (int j = kAcross / 2; j < kAcross; ++j) {
            for (int i = 0; i < kAcross; ++i) {
                muscle.push_back(static_cast<std::uint32_t>(lattice.cell_index(i, j, k)));
            }
        }
    }
    solver.actuate(muscle);
    const double shrunk = 0.002, thickness = kAcross * kCellSize, length = kAlong * kCellSize;
    Loading loading;
    loading.rest_stretches.assign(muscle.size(), {1, 1, 1 - shrunk});
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    for (std::uint32_t n = 0; n < nodes.size() && lattice.rest_position(nodes[n])[2] < 1e-9; ++n) {
        // The end's plane stays one, and its middle where it is.
        const auto x = lattice.rest_position(nodes[n]);
        const bool middle = std::abs(x[0] - thickness / 2) < 1e-9 && std::abs(x[1] - thickness / 2) < 1e-9;
        const bool beside = std::abs(x[0] - thickness) < 1e-9 && std::abs(x[1] - thickness / 2) < 1e-9;
        loading.supports.push_back({n, static_cast<std::uint8_t>(middle ? 7 : beside ? 6 : 4)});
    }
    std::vector<double> u(3 * nodes.size());
    const EquilibriumResult result = solver.solve(loading, VectorField<double>::aos(u.data(), nodes.size()));
    ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    double tip = 0;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto x = lattice.rest_position(nodes[n]);
        if (x[2] > length - 1e-9 && std::abs(x[0] - thickness / 2) < 1e-9 && std::abs(x[1] - thickness / 2) < 1e-9) {
            tip = u[3 * n + 1];
        }
    }
    const double curvature = 1.5 * shrunk / thickness;
    EXPECT_NEAR(std::abs(tip), curvature * length * length / 2, 0.02 * curvature * length * length / 2);
}

} // namespace
} // namespace hybmss
