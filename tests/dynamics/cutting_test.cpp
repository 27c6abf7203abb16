/// Cells removed from a moving body: what is left is the body that would have been built without them.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/separation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {
namespace {

using Field = std::vector<double>; // x y z a node

Material soft(double poisson_ratio, double face_diagonal_ratio) {
    Material material;
    material.young_modulus = 1e4;
    material.poisson_ratio = poisson_ratio;
    material.density = 1000;
    material.face_diagonal_ratio = face_diagonal_ratio;
    return material;
}

template <class T, class Get>
Field read(std::size_t nodes, const Get& get) {
    std::vector<T> values(3 * nodes);
    get(VectorField<T>::aos(values.data(), nodes));
    return {values.begin(), values.end()};
}

/// Cells of the lattice in random order.
std::vector<std::uint32_t> shuffled_cells(const Lattice& lattice, std::mt19937& engine) {
    std::vector<std::uint32_t> cells;
    for (std::size_t c = 0; c < lattice.cell_scales().size(); ++c) {
        if (lattice.cell_scales()[c] > 0) {
            cells.push_back(static_cast<std::uint32_t>(c));
        }
    }
    std::shuffle(cells.begin(), cells.end(), engine);
    return cells;
}

/// Forces, energy, masses and counts of `dynamics` against a body built from the lattice as it is now. `grid_nodes`
/// has the grid index of each of its nodes.
template <class T>
void expect_as_built_anew(const ExplicitDynamics<T>& dynamics, const Lattice& cut, const Material& material,
                          const PlanOptions& options, const std::vector<std::uint32_t>& grid_nodes) {
    const ForcePlan<T> anew(cut, material, options);
    const std::vector<std::uint32_t> left = cut.nodes(); // grid indices
    const Field u = read<T>(dynamics.node_count(), [&](const VectorField<T>& out) { dynamics.get_displacements(out); });
    const Field force = read<T>(dynamics.node_count(), [&](const VectorField<T>& out) { dynamics.get_forces(out); });

    std::vector<T> displacement(3 * left.size()), expected(3 * left.size(), T(0));
    std::vector<std::size_t> number(left.size());
    for (std::size_t n = 0; n < left.size(); ++n) {
        number[n] = static_cast<std::size_t>(std::lower_bound(grid_nodes.begin(), grid_nodes.end(), left[n]) -
                                             grid_nodes.begin());
        for (std::size_t a = 0; a < 3; ++a) {
            displacement[3 * n + a] = static_cast<T>(u[3 * number[n] + a]);
        }
    }
    const VectorField<const T> at = VectorField<const T>::aos(displacement.data(), left.size());
    anew.add_forces(at, VectorField<T>::aos(expected.data(), left.size()));
    double largest = 0, worst = 0, sum = 0;
    for (std::size_t n = 0; n < left.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            const double f = force[3 * number[n] + a], wanted = static_cast<double>(expected[3 * n + a]);
            largest = std::max(largest, std::abs(wanted));
            worst = std::max(worst, std::abs(f - wanted));
            sum += std::abs(f);
        }
    }
    // The arrays are the same; displacements in m, rounded on their way out and in, are not quite: at most a strain of
    // epsilon, against strains of some percent, in some thirty springs a node.
    const double epsilon = std::numeric_limits<T>::epsilon();
    EXPECT_LE(worst, 1e3 * epsilon * largest);
    const double all =
        std::accumulate(force.begin(), force.end(), 0.0, [](double s, double f) { return s + std::abs(f); });
    EXPECT_EQ(sum, all) << "a force on a node without cells";
    const double energy = anew.energy(at).total();
    EXPECT_NEAR(dynamics.potential_energy().total(), energy, 1e3 * epsilon * energy);

    const ExplicitDynamics<T> built(cut, material, options);
    std::size_t with_mass = 0;
    for (std::size_t n = 0; n < left.size(); ++n) {
        EXPECT_EQ(dynamics.masses()[number[n]], built.masses()[n]);
    }
    for (const double mass : dynamics.masses()) {
        with_mass += mass > 0;
    }
    EXPECT_EQ(with_mass, left.size());
    EXPECT_EQ(dynamics.describe().cells, cut.cell_count());
    EXPECT_EQ(dynamics.describe().springs, built.describe().springs);
    EXPECT_GE(anew.critical_time_step() * (1 + 1e-12), dynamics.critical_time_step());
}

template <class T>
void set_random_motion(ExplicitDynamics<T>& dynamics, double displacement, double speed, std::mt19937& engine) {
    std::vector<T> u(3 * dynamics.node_count()), v(u.size());
    for (std::size_t i = 0; i < u.size(); ++i) {
        u[i] = static_cast<T>(std::uniform_real_distribution<>(-displacement, displacement)(engine));
        v[i] = static_cast<T>(std::uniform_real_distribution<>(-speed, speed)(engine));
    }
    dynamics.set_displacements(VectorField<const T>::aos(u.data(), dynamics.node_count()));
    dynamics.set_velocities(VectorField<const T>::aos(v.data(), dynamics.node_count()));
}

/// Removes `share` of the cells in so many bites, some steps between them.
template <class T>
void cut_while_moving(Lattice lattice, const Material& material, const PlanOptions& options, double share, int bites,
                      unsigned seed) {
    std::mt19937 engine(seed);
    const std::vector<std::uint32_t> grid_nodes = lattice.nodes();
    ExplicitDynamics<T> dynamics(lattice, material, options);
    ASSERT_TRUE(dynamics.can_remove_cells());
    set_random_motion(dynamics, 0.02 * lattice.cell_size(), 0.1, engine);
    const StepParameters parameters{0.5 * dynamics.critical_time_step(), {0, 0, -10}, 0.1};
    const std::vector<std::uint32_t> order = shuffled_cells(lattice, engine);
    const auto all = static_cast<std::size_t>(share * static_cast<double>(order.size()));
    const std::size_t cells = lattice.cell_count();
    for (std::size_t bite = 0; bite < static_cast<std::size_t>(bites); ++bite) {
        dynamics.step(parameters, 3);
        const std::size_t begin = all * bite / static_cast<std::size_t>(bites),
                          end = all * (bite + 1) / static_cast<std::size_t>(bites);
        // Those of the bite before are gone by now, and are passed over.
        const std::size_t from = begin - std::min<std::size_t>(begin, 2);
        EXPECT_EQ(dynamics.remove_cells(lattice, std::span(order).subspan(from, end - from)), end - begin);
        ASSERT_EQ(lattice.cell_count(), cells - end);
        expect_as_built_anew(dynamics, lattice, material, options, grid_nodes);
        if (testing::Test::HasFailure()) {
            FAIL() << "bite " << bite;
        }
    }
    dynamics.step(parameters, 20);
    EXPECT_TRUE(std::isfinite(dynamics.kinetic_energy() + dynamics.potential_energy().total()));
}

struct Case {
    InstructionSet instruction_set;
    const char* layout;
};

class Cutting : public testing::TestWithParam<Case> {
protected:
    PlanOptions options() const {
        PlanOptions options;
        options.instruction_set = GetParam().instruction_set;
        options.layout = GetParam().layout;
        options.threads = 2;
        return options;
    }
    unsigned seed_ = std::random_device{}();
};

TEST_P(Cutting, a_tenth_in_fifty_bites) {
    SCOPED_TRACE("seed " + std::to_string(seed_));
    const Lattice lattice = Lattice::box(16, 16, 16, 0.1);
    cut_while_moving<double>(lattice, soft(0.45, 1), options(), 0.1, 50, seed_);
    cut_while_moving<float>(lattice, soft(0.45, 1), options(), 0.1, 50, seed_);
}

TEST_P(Cutting, of_bodies_with_holes_and_other_shapes_down_to_nothing) {
    SCOPED_TRACE("seed " + std::to_string(seed_));
    std::mt19937 engine(seed_);
    for (const auto& [nx, ny, nz] : {std::array{4, 3, 24}, std::array{37, 9, 2}, std::array{1, 1, 1}}) {
        std::vector<float> scales;
        for (int c = 0; c < nx * ny * nz; ++c) {
            const auto draw = engine() % 4;
            scales.push_back(draw == 0 && nx > 1 ? 0.0f : draw == 1 ? 2.5f : 1.0f);
        }
        const Lattice lattice = Lattice::from_cells(nx, ny, nz, 0.3, scales);
        cut_while_moving<double>(lattice, soft(0.0, 1), options(), 1, 5, seed_);
        cut_while_moving<float>(lattice, soft(0.3, 0), options(), 1, 5, seed_);
        Material stiffening = soft(0.4, 1);
        stiffening.stiffening = {1, 3};
        cut_while_moving<double>(lattice, stiffening, options(), 1, 5, seed_);
        Lattice tissues = lattice;
        std::vector<std::uint8_t> of_cells(scales.size());
        std::generate(of_cells.begin(), of_cells.end(), [&] { return static_cast<std::uint8_t>(engine() % 3); });
        tissues.set_tissues({{0.45, 3000}, {0.1, 500}}, std::move(of_cells));
        cut_while_moving<double>(tissues, soft(0.25, 1), options(), 1, 5, seed_);
    }
}

// The springs that are left are damped as those of a body built without the cells.
TEST_P(Cutting, of_a_damped_body) {
    SCOPED_TRACE("seed " + std::to_string(seed_));
    std::mt19937 engine(seed_);
    Lattice lattice = Lattice::box(7, 5, 6, 0.1);
    const std::vector<std::uint32_t> grid_nodes = lattice.nodes();
    ExplicitDynamics<double> dynamics(lattice, soft(0.4, 1), options());
    dynamics.damp_springs(1e-3);
    set_random_motion(dynamics, 0.02 * lattice.cell_size(), 0.1, engine);
    const std::vector<std::uint32_t> order = shuffled_cells(lattice, engine);
    dynamics.remove_cells(lattice, std::span(order).first(120));

    ExplicitDynamics<double> anew(lattice, soft(0.4, 1), options());
    anew.damp_springs(1e-3);
    const std::size_t size = dynamics.node_count();
    const Field u = read<double>(size, [&](const VectorField<double>& out) { dynamics.get_displacements(out); });
    const Field v = read<double>(size, [&](const VectorField<double>& out) { dynamics.get_velocities(out); });
    const Field force = read<double>(size, [&](const VectorField<double>& out) { dynamics.get_effect_forces(out); });
    Field its_u, its_v, left;
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    for (std::size_t n = 0; n < size; ++n) {
        if (std::binary_search(nodes.begin(), nodes.end(), grid_nodes[n])) {
            for (std::size_t a = 3 * n; a < 3 * n + 3; ++a) {
                its_u.push_back(u[a]);
                its_v.push_back(v[a]);
                left.push_back(force[a]);
            }
        } else {
            EXPECT_EQ(std::abs(force[3 * n]) + std::abs(force[3 * n + 1]) + std::abs(force[3 * n + 2]), 0);
        }
    }
    anew.set_displacements(VectorField<const double>::aos(its_u.data(), nodes.size()));
    anew.set_velocities(VectorField<const double>::aos(its_v.data(), nodes.size()));
    const Field expected =
        read<double>(nodes.size(), [&](const VectorField<double>& out) { anew.get_effect_forces(out); });
    double largest = 0;
    for (const double f : expected) {
        largest = std::max(largest, std::abs(f));
    }
    EXPECT_GT(largest, 0);
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_NEAR(left[i], expected[i], 1e-11 * largest);
    }
}

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const InstructionSet set : available_instruction_sets()) {
        for (const char* layout : {"flat-rows", "active-rows"}) {
            all.push_back({set, layout});
        }
    }
    return all;
}

INSTANTIATE_TEST_SUITE_P(Layouts, Cutting, testing::ValuesIn(cases()), [](const auto& each) {
    std::string text = std::string(name(each.param.instruction_set)) + "_" + each.param.layout;
    std::replace(text.begin(), text.end(), '-', '_');
    return text;
});

TEST(Cut, nodes_without_cells_rest_and_lose_their_loads) {
    Lattice lattice = Lattice::box(3, 1, 1, 0.1);
    ExplicitDynamics<double> dynamics(lattice, soft(0.3, 1));
    std::mt19937 engine(1);
    set_random_motion(dynamics, 0.001, 0.1, engine);
    const NodalLoad loads[] = {{0, {1, 2, 3}}, {1, {0, 0, 4}}};
    dynamics.load(loads);
    const StepParameters parameters{0.5 * dynamics.critical_time_step(), {0, -10, 0}, 0};
    const std::uint32_t first[] = {0};
    dynamics.step(parameters, 5);
    EXPECT_EQ(dynamics.remove_cells(lattice, first), 1u);
    const Field before = read<double>(16, [&](const auto& out) { dynamics.get_displacements(out); });

    // Node 0 has lost its only cell, node 1 one of two: the same force on half the mass.
    ExplicitDynamics<double> anew(lattice, soft(0.3, 1));
    Field u(3 * 12), v(3 * 12);
    const Field speeds = read<double>(16, [&](const auto& out) { dynamics.get_velocities(out); });
    const std::vector<std::uint32_t> left = lattice.nodes();
    for (std::size_t n = 0; n < left.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            u[3 * n + a] = before[3 * left[n] + a];
            v[3 * n + a] = speeds[3 * left[n] + a];
        }
    }
    anew.set_displacements(VectorField<const double>::aos(u.data(), 12));
    anew.set_velocities(VectorField<const double>::aos(v.data(), 12));
    const NodalLoad half[] = {{0, {0, 0, 4}}};
    anew.load(half);
    dynamics.step(parameters, 10);
    anew.step(parameters, 10);
    const Field after = read<double>(16, [&](const auto& out) { dynamics.get_displacements(out); });
    const Field expected = read<double>(12, [&](const auto& out) { anew.get_displacements(out); });
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_EQ(after[a], before[a]);
        for (std::size_t n = 0; n < left.size(); ++n) {
            EXPECT_NEAR(after[3 * left[n] + a], expected[3 * n + a], 1e-13);
        }
    }
    EXPECT_NEAR(dynamics.kinetic_energy(), anew.kinetic_energy(), 1e-12 * anew.kinetic_energy());
}

TEST(Cut, is_the_same_on_any_number_of_threads) {
    const auto end = [](int threads) {
        Lattice lattice = Lattice::box(20, 20, 20, 0.1);
        PlanOptions options;
        options.threads = threads;
        ExplicitDynamics<float> dynamics(lattice, soft(0.3, 1), options);
        std::mt19937 engine(1);
        set_random_motion(dynamics, 0.001, 0.1, engine);
        const std::vector<std::uint32_t> order = shuffled_cells(lattice, engine);
        dynamics.step({0.5 * dynamics.critical_time_step()}, 5);
        dynamics.remove_cells(lattice, std::span(order).first(500));
        dynamics.step({0.5 * dynamics.critical_time_step()}, 5);
        return dynamics.exact_state();
    };
    EXPECT_EQ(end(1), end(2));
}

TEST(Cut, refuses_what_it_cannot_do) {
    const auto message = [](auto&& dynamics, Lattice lattice, std::uint32_t cell) -> std::string {
        const Lattice before = lattice;
        try {
            const std::uint32_t cells[] = {0, cell};
            dynamics.remove_cells(lattice, cells);
        } catch (const std::invalid_argument& error) {
            EXPECT_TRUE(std::ranges::equal(before.cell_scales(), lattice.cell_scales()));
            return error.what();
        }
        return "";
    };
    const Lattice lattice = Lattice::box(3, 4, 5, 0.1);
    const Material material = soft(0.3, 1);
    EXPECT_EQ(message(ExplicitDynamics<double>(lattice, material), lattice, 60), "cell 60: the lattice has 60");
    for (const std::string& layout : network_layouts()) {
        PlanOptions options;
        options.layout = layout;
        ExplicitDynamics<double> dynamics(lattice, material, options);
        EXPECT_FALSE(dynamics.can_remove_cells());
        EXPECT_EQ(message(std::move(dynamics), lattice, 1),
                  "layout \"" + layout + "\" cannot be cut while it moves: flat-rows and active-rows can");
    }
    std::vector<float> scales(60, 1.0f);
    scales[0] = scales[1] = 0;
    const Lattice holed = Lattice::from_cells(3, 4, 5, 0.1, scales);
    EXPECT_EQ(message(ExplicitDynamics<double>(holed, material), lattice, 1),
              "the lattice has 60 cells, the body made from it 58");
    ExplicitDynamics<double> dynamics(lattice, material);
    EXPECT_NE(message(dynamics, Lattice::box(3, 4, 5, 0.2), 1).find("the lattice has cells of 0.2"), std::string::npos);
    EXPECT_EQ(message(dynamics, lattice, 1), "");
    EXPECT_NE(message(dynamics, Lattice::box(5, 4, 3, 0.1), 1).find("another grid"), std::string::npos);
}

/// A bar in flight whose ends fly apart; the middle is weaker, and tears.
struct Torn {
    std::vector<Field> displacements; ///< at each look
    std::size_t faces = 0, parts = 0;
    double mass = 0, momentum = 0, worst_jump = 0;
};
Torn torn_bar(double tear_strain, int threads) {
    Lattice lattice = Lattice::box(12, 3, 3, 0.1);
    for (int cell = 0; cell < 9; ++cell) {
        lattice.set_cell_scale(6, cell % 3, cell / 3, 0.5f);
    }
    const Material material = soft(0.4, 1);
    std::vector<std::array<std::uint32_t, 2>> faces;
    SeparatedNetwork body = separate(lattice, material, faces);
    PlanOptions options;
    options.threads = threads;
    Field u(3 * body.network.masses.size()), v(u.size());
    for (std::size_t n = 0; n < body.network.masses.size(); ++n) {
        v[3 * n] = 2 * (body.network.rest_positions[n][0] - 0.6);
    }
    const auto view = [](Field& field) { return VectorField<double>::aos(field.data(), field.size() / 3); };
    auto dynamics = std::make_unique<ExplicitDynamics<double>>(body.network, options);
    dynamics->set_velocities(view(v));
    const double step = 0.5 * dynamics->critical_time_step();
    Torn torn;
    for (int look = 0; look < 150; ++look) {
        dynamics->step({.time_step = step}, 5);
        dynamics->get_displacements(view(u));
        dynamics->get_velocities(view(v));
        torn.displacements.push_back(u);
        const auto now = torn_faces(lattice, body, view(u), tear_strain);
        if (now.empty()) {
            continue;
        }
        faces.insert(faces.end(), now.begin(), now.end());
        const double before = dynamics->potential_energy().total() + dynamics->kinetic_energy();
        SeparatedNetwork after = separate(lattice, material, faces);
        const std::vector<std::uint32_t> from = nodes_before(body, after);
        Field moved_u, moved_v;
        for (const std::uint32_t node : from) {
            for (std::size_t c = 0; c < 3; ++c) {
                moved_u.push_back(u[3 * node + c]);
                moved_v.push_back(v[3 * node + c]);
            }
        }
        u = moved_u;
        v = moved_v;
        body = std::move(after);
        dynamics = std::make_unique<ExplicitDynamics<double>>(body.network, options);
        dynamics->set_displacements(view(u));
        dynamics->set_velocities(view(v));
        const double kept = dynamics->potential_energy().total() + dynamics->kinetic_energy();
        torn.worst_jump = std::max(torn.worst_jump, std::abs(kept / before - 1));
    }
    torn.faces = faces.size();
    std::vector<std::size_t> part(body.network.masses.size());
    std::iota(part.begin(), part.end(), std::size_t{0});
    for (bool changed = true; changed;) {
        changed = false;
        for (const Network::Spring& s : body.network.springs) {
            std::size_t &a = part[static_cast<std::size_t>(s.a)], &b = part[static_cast<std::size_t>(s.b)];
            changed = changed || a != b;
            a = b = std::min(a, b);
        }
    }
    for (std::size_t n = 0; n < part.size(); ++n) {
        torn.parts += part[n] == n;
        torn.mass += body.network.masses[n];
        torn.momentum += body.network.masses[n] * v[3 * n];
    }
    return torn;
}

TEST(Tearing, PartsWhereItIsWeakestAndLosesNothing) {
    const Torn whole = torn_bar(10, 1), torn = torn_bar(0.25, 1);
    EXPECT_EQ(whole.faces, 0u);
    EXPECT_EQ(whole.parts, 1u);
    EXPECT_GE(torn.faces, 9u);
    EXPECT_GE(torn.parts, 2u);
    EXPECT_LT(torn.worst_jump, 1e-12); // each cell keeps its own
    EXPECT_NEAR(torn.mass, 12 * 9, 1e-10);
    EXPECT_NEAR(torn.momentum, 0, 1e-9);
    std::printf("torn: %zu faces, %zu parts\n", torn.faces, torn.parts);
    // The same for any threads, look by look.
    EXPECT_EQ(torn_bar(0.25, 3).displacements, torn.displacements);
}

TEST(Tearing, RefusesWhatIsNone) {
    const Lattice lattice = Lattice::box(2, 1, 1, 0.1);
    const SeparatedNetwork body = separate(lattice, soft(0.3, 1), {});
    Field u(36);
    const auto field = VectorField<const double>::aos(u.data(), 12);
    EXPECT_TRUE(torn_faces(lattice, body, field, 0.1).empty());
    for (std::size_t n = 0; n < 12; ++n) {
        u[3 * n] = 0.3 * body.network.rest_positions[n][0]; // by 30 %
    }
    EXPECT_EQ(torn_faces(lattice, body, field, 0.299).size(), 1u);
    EXPECT_TRUE(torn_faces(lattice, body, field, 0.301).empty());
    EXPECT_THROW(torn_faces(lattice, body, field, 0), std::invalid_argument);
    EXPECT_THROW(torn_faces(lattice, body, VectorField<const double>::aos(u.data(), 11), 0.1), std::invalid_argument);
    EXPECT_THROW(torn_faces(Lattice::box(3, 1, 1, 0.1), body, field, 0.1), std::invalid_argument);
    EXPECT_THROW(nodes_before(body, separate(Lattice::box(3, 1, 1, 0.1), soft(0.3, 1), {})), std::invalid_argument);
}

} // namespace
} // namespace hybmss
