// A batch gives every body the bits it gets alone.

#include "hybmss/batch.hpp"

#include "kernels/kernel_table.hpp"
#include "tests/moving_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace hybmss {
namespace {

/// Bodies of many sizes, one of them a network, one large enough for two threads of its own.
template <class T>
std::vector<ExplicitDynamics<T>> bodies() {
    Material material;
    material.poisson_ratio = 0.4;
    PlanOptions two;
    two.threads = 2;
    std::vector<ExplicitDynamics<T>> all;
    for (int n = 1; n <= 6; ++n) {
        all.emplace_back(Lattice::box(n, 7 - n, 3, 0.25), material);
    }
    all.emplace_back(Lattice::box(20, 20, 20, 0.25), material, two);
    all.emplace_back(Network::from_lattice(Lattice::box(4, 3, 2, 0.25), material), two);
    const PrescribedNode held{0, 5, {0.01, 0, -0.01}, {0, 0, 0}};
    for (auto& body : all) {
        body.prescribe({&held, 1});
    }
    return all;
}

template <class T>
StepParameters parameters_of(const ExplicitDynamics<T>& body) {
    return {0.5 * body.critical_time_step(), {0, -9.81, 0}, 0.3};
}

template <class T>
std::vector<std::uint64_t> bits_of_all(std::vector<ExplicitDynamics<T>>& all) {
    std::vector<std::uint64_t> bits;
    for (auto& body : all) {
        std::vector<T> out(3 * body.node_count());
        body.get_displacements(VectorField<T>::aos(out.data(), body.node_count()));
        const std::uint64_t hash = testing::bits_of(out);
        body.get_velocities(VectorField<T>::aos(out.data(), body.node_count()));
        bits.push_back(testing::bits_of(out, Digest(hash)));
    }
    return bits;
}

template <class T>
struct BatchOf : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(BatchOf, Precisions);

TYPED_TEST(BatchOf, EveryBodyGetsTheBitsItGetsAlone) {
    auto alone = bodies<TypeParam>();
    for (auto& body : alone) {
        body.step(parameters_of(body), 30);
    }
    const auto expected = bits_of_all(alone);
    for (const int threads : {1, 2, 3, 8}) {
        auto together = bodies<TypeParam>();
        std::vector<ExplicitDynamics<TypeParam>*> pointers;
        std::vector<StepParameters> parameters;
        for (auto& body : together) {
            pointers.push_back(&body);
            parameters.push_back(parameters_of(body));
        }
        Batch<TypeParam> batch(threads);
        EXPECT_EQ(batch.threads(), threads);
        batch.step(pointers, parameters, 10);
        for (int i = 0; i < 20; ++i) {
            batch.step(pointers, parameters);
        }
        EXPECT_EQ(bits_of_all(together), expected) << threads;
    }
}

TYPED_TEST(BatchOf, OneSetOfParametersIsForAll) {
    auto alone = bodies<TypeParam>(), together = bodies<TypeParam>();
    StepParameters parameters = parameters_of(alone[0]);
    parameters.time_step *= 0.25;
    for (auto& body : alone) {
        body.step(parameters, 7);
    }
    Batch<TypeParam> batch(2);
    batch.step(together, parameters, 7);
    EXPECT_EQ(bits_of_all(together), bits_of_all(alone));
    batch.step(std::span<ExplicitDynamics<TypeParam>>(), parameters, 7);
}

/// A kind of body, and how many of it lie side by side at most.
struct Kind {
    Lattice lattice;
    Material material;
};
Material material_of(double poisson_ratio, double face_diagonal_ratio) {
    Material material;
    material.poisson_ratio = poisson_ratio;
    material.face_diagonal_ratio = face_diagonal_ratio;
    material.young_modulus = 1e6;
    return material;
}
/// Every volume force with and without face diagonals; rows, columns and layers of one cell; slabs that meet; holes.
std::vector<Kind> kinds() {
    Lattice holes = Lattice::box(7, 5, 8, 0.25);
    for (int c = 0; c < 70; ++c) {
        holes.set_cell_scale(c % 7, 3 * c % 5, c * c % 8, c % 3 == 0 ? 0.0f : 0.5f * static_cast<float>(c % 3));
    }
    return {{Lattice::box(3, 3, 3, 0.25), material_of(0.4, 1)},   {Lattice::box(1, 1, 1, 0.25), material_of(0.4, 0)},
            {Lattice::box(1, 1, 19, 0.25), material_of(0.1, 1)},  {Lattice::box(21, 1, 2, 0.25), material_of(0.1, 0)},
            {Lattice::box(2, 18, 3, 0.25), material_of(0.25, 1)}, {Lattice::box(6, 4, 9, 0.25), material_of(0.25, 0)},
            {Lattice::box(5, 6, 7, 0.25), material_of(0.4, 1)},   {holes, material_of(0.4, 1)}};
}

/// So many of a kind, each displaced, held and loaded in its own way.
template <class T>
std::vector<ExplicitDynamics<T>> alike(const Kind& kind, const PlanOptions& options, std::size_t count) {
    std::vector<ExplicitDynamics<T>> all;
    for (std::size_t b = 0; b < count; ++b) {
        ExplicitDynamics<T>& body = all.emplace_back(kind.lattice, kind.material, options);
        const auto u = testing::random_field<T>(body.node_count(), 0.01, static_cast<unsigned>(b));
        body.set_displacements(VectorField<const T>::aos(u.data(), body.node_count()));
        const auto last = static_cast<std::uint32_t>(body.node_count() - 1);
        const PrescribedNode held{last, static_cast<std::uint8_t>(b % 8), {0.01, 0, -0.01}, {0, 0.1, 0}};
        body.prescribe({&held, 1});
        const NodalLoad loads[] = {{0, {static_cast<double>(b), 0, 5}}, {last / 2, {0, 7, 0}}};
        body.load(std::span(loads).first(b % 3));
    }
    return all;
}

/// Of the set that plans take by themselves.
template <class T>
std::size_t width_of() {
    return static_cast<std::size_t>(kernels::kernel_table<T>(available_instruction_sets().back()).width);
}

/// Levels, sets and integrators that a batch must not tell from steps one by one.
TYPED_TEST(BatchOf, LanesOfAVectorGetTheBitsThatEachGetsAlone) {
    constexpr std::size_t kCount = 19; // a row that is not full, on every set
    for (const InstructionSet set : available_instruction_sets()) {
        for (const Accuracy accuracy : {Accuracy::fast, Accuracy::accurate, Accuracy::exact}) {
            for (std::size_t k = 0; k < kinds().size(); ++k) {
                const Kind kind = kinds()[k];
                PlanOptions options;
                options.instruction_set = set;
                options.accuracy = accuracy;
                options.layout = k == 7 ? "flat-rows" : k == 3 ? "flat-rows-yzx" : "";
                auto alone = alike<TypeParam>(kind, options, kCount),
                     together = alike<TypeParam>(kind, options, kCount);
                StepParameters parameters = parameters_of(alone[0]);
                Batch<TypeParam> batch(k % 2 ? 1 : 3, BatchLayout::side_by_side);
                const auto step = [&](long count) {
                    for (auto& body : alone) {
                        body.step(parameters, count);
                    }
                    batch.step(together, parameters, count);
                    EXPECT_GE(batch.describe().side_by_side, 18u) << to_string(batch.describe());
                };
                step(15);
                step(1);
                EXPECT_EQ(bits_of_all(together), bits_of_all(alone)) << name(set) << name(accuracy) << k;
                parameters.integrator = Integrator::leapfrog;
                step(10);
                parameters.acceleration = {0, 0, 0};
                parameters.mass_damping = 0;
                step(3);
                EXPECT_EQ(bits_of_all(together), bits_of_all(alone)) << name(set) << name(accuracy) << k;
                EXPECT_EQ(together[18].exact_state(), alone[18].exact_state());
                // Where it is not, bits mean nothing.
                EXPECT_TRUE(std::ranges::all_of(alone, [](const auto& body) { return body.finite(); })) << k;
            }
        }
    }
}

/// Whatever is done to bodies between calls, and in whatever order they come.
TYPED_TEST(BatchOf, BodiesAreTheirOwnBetweenCalls) {
    constexpr std::size_t kCount = 20;
    const Kind kind = kinds()[6];
    auto alone = alike<TypeParam>(kind, {}, kCount), together = alike<TypeParam>(kind, {}, kCount);
    StepParameters parameters = parameters_of(alone[0]);
    Batch<TypeParam> batch(2, BatchLayout::side_by_side), other(2, BatchLayout::side_by_side);
    std::vector<std::size_t> order(kCount);
    std::iota(order.begin(), order.end(), 0u);
    // `lanes`: bodies that lie side by side; but one that is left alone.
    const auto step = [&](Batch<TypeParam>& by, std::size_t lanes, long count = 5) {
        std::vector<ExplicitDynamics<TypeParam>*> named;
        for (const std::size_t b : order) {
            alone[b].step(parameters, count);
            named.push_back(&together[b]);
        }
        by.step(named, std::vector<StepParameters>(named.size(), parameters), count);
        EXPECT_EQ(by.describe().side_by_side, lanes - (lanes % width_of<TypeParam>() == 1));
        EXPECT_EQ(by.describe().bodies, named.size());
    };
    const auto both = [&](std::size_t b, const auto& act) {
        act(alone[b]);
        act(together[b]);
    };
    const auto expect_equal = [&](const char* after) { EXPECT_EQ(bits_of_all(together), bits_of_all(alone)) << after; };
    step(batch, kCount);
    step(batch, kCount);
    expect_equal("steps");
    both(3, [](auto& body) {
        const auto u = testing::random_field<TypeParam>(body.node_count(), 0.02, 99);
        body.set_displacements(VectorField<const TypeParam>::aos(u.data(), body.node_count()));
    });
    both(4, [](auto& body) {
        const PrescribedNode held[] = {{7, 7, {0, 0.02, 0}, {0, 0, 0}}, {9, 2, {0, 0.01, 0}, {0, 0, 0}}};
        body.prescribe(held);
    });
    both(5, [](auto& body) { body.prescribe({}); });
    both(6, [](auto& body) {
        const NodalLoad load{3, {0, -500, 100}};
        body.load({&load, 1});
    });
    step(batch, kCount);
    expect_equal("what is set, held and loaded");
    std::swap(order[0], order[11]);
    step(batch, kCount);
    step(other, kCount);
    order.resize(7);
    step(batch, 7);
    order.resize(kCount);
    std::iota(order.rbegin(), order.rend(), 0u);
    step(other, kCount);
    expect_equal("other orders and batches");
    // A spring damper, then a cell less: no longer like the others.
    both(8, [](auto& body) { body.damp_springs(1e-4); });
    step(other, kCount - 1);
    Lattice cut[2] = {kind.lattice, kind.lattice};
    const std::uint32_t cell = 17;
    alone[9].remove_cells(cut[0], {&cell, 1});
    together[9].remove_cells(cut[1], {&cell, 1});
    step(other, kCount - 2);
    both(8, [](auto& body) { body.damp_springs(0); });
    step(other, kCount - 1);
    expect_equal("an effect and a cut");
    parameters.integrator = Integrator::leapfrog;
    step(other, kCount - 1);
    both(2, [](auto& body) { // completes its step: the first kick of the next differs from the others'
        const auto u = testing::random_field<TypeParam>(body.node_count(), 0.02, 98);
        body.set_displacements(VectorField<const TypeParam>::aos(u.data(), body.node_count()));
    });
    // It is the last but two of those that are alike: its row is stepped one by one this time.
    step(other, kCount - 1 - std::min<std::size_t>(3, width_of<TypeParam>()));
    step(other, kCount - 1);
    parameters.integrator = Integrator::symplectic_euler;
    step(other, 0); // likewise all of them
    step(other, kCount - 1);
    expect_equal("leapfrog");
    together.erase(together.begin() + 2); // moves those behind it
    alone.erase(alone.begin() + 2);
    order.resize(kCount - 1);
    std::iota(order.begin(), order.end(), 0u);
    step(other, kCount - 2);
    {
        Batch<TypeParam> gone(1, BatchLayout::side_by_side);
        step(gone, kCount - 2);
    }
    expect_equal("a body and a batch less");
}

TYPED_TEST(BatchOf, BodiesThatAreNotFiniteSayWhen) {
    auto alone = alike<TypeParam>(kinds()[0], {}, 16), together = alike<TypeParam>(kinds()[0], {}, 16);
    Batch<TypeParam> batch(1);
    StepParameters parameters = parameters_of(alone[0]);
    parameters.time_step *= 40;
    for (int call = 0; call < 3; ++call) {
        for (auto& body : alone) {
            body.step(parameters, 50);
        }
        batch.step(together, parameters, 50);
    }
    EXPECT_EQ(batch.describe().side_by_side, 16u);
    for (std::size_t b = 0; b < 16; ++b) {
        EXPECT_FALSE(alone[b].finite());
        EXPECT_EQ(together[b].not_finite_at(), alone[b].not_finite_at());
    }
}

TEST(Batch, SmallBodiesThatAreAlikeAreLanes) {
    const Kind kind = kinds()[0];
    const std::size_t width = width_of<float>();
    const auto stepped = [](std::vector<ExplicitDynamics<float>>& bodies, BatchLayout layout) {
        Batch<float> batch(1, layout);
        batch.step(bodies, {1e-6});
        return to_string(batch.describe());
    };
    const auto line = [](std::size_t lanes, std::size_t vectors, std::size_t others) {
        return std::to_string(lanes + others) + " bodies: " + std::to_string(lanes) + " side by side in " +
               std::to_string(vectors) + " vectors, " + std::to_string(others) + " one by one";
    };
    auto bodies = alike<float>(kind, {}, 2 * width + 3 * width / 4);
    EXPECT_EQ(stepped(bodies, BatchLayout::automatic), line(bodies.size(), 3, 0));
    EXPECT_EQ(stepped(bodies, BatchLayout::one_by_one), line(0, 0, bodies.size()));
    bodies = alike<float>(kind, {}, width + width / 2);
    EXPECT_EQ(stepped(bodies, BatchLayout::automatic), line(width, 1, width / 2));
    EXPECT_EQ(stepped(bodies, BatchLayout::side_by_side), line(width + width / 2, 2, 0));
    const Kind large{Lattice::box(24, 24, 24, 0.25), kind.material};
    bodies = alike<float>(large, {}, width);
    EXPECT_EQ(stepped(bodies, BatchLayout::automatic), line(0, 0, width));
    EXPECT_EQ(stepped(bodies, BatchLayout::side_by_side), line(width, 1, 0));

    // What goes one by one whatever is asked for.
    const auto never = [&](const Kind& of, const char* layout) {
        PlanOptions options;
        options.layout = layout;
        bodies = alike<float>(of, options, width);
        EXPECT_EQ(stepped(bodies, BatchLayout::side_by_side), line(0, 0, width)) << layout;
    };
    never(kind, "network");
    never(kind, "active-rows");
    Kind other = kind;
    other.material.springs = SpringForm::means;
    never(other, "flat-rows");
    other = kind;
    other.material.stiffening = {0.3, 2};
    never(other, "flat-rows");
    other = kind;
    other.lattice.set_tissues({{0.1, 2000}}, std::vector<std::uint8_t>(27, 1));
    never(other, "flat-rows");
    bodies = alike<float>(kind, {}, width);
    bodies[1].damp_springs(1e-4);
    EXPECT_EQ(stepped(bodies, BatchLayout::side_by_side), line(width - 1, 1, 1));
    bodies.clear();
    for (std::size_t b = 0; b < width; ++b) {
        bodies.emplace_back(kind.lattice, material_of(0.3 + 0.01 * static_cast<double>(b), 1));
    }
    EXPECT_EQ(stepped(bodies, BatchLayout::side_by_side), line(0, 0, width));
}

std::string refusal(const std::function<void()>& call) {
    try {
        call();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "accepted";
}

TEST(Batch, RefusesBeforeAnyBodyHasMoved) {
    auto all = bodies<float>();
    const auto before = bits_of_all(all);
    Batch<float> batch(2);
    std::vector<ExplicitDynamics<float>*> pointers = {&all[0], &all[1], &all[2]};
    std::vector<StepParameters> parameters(3, parameters_of(all[0]));

    EXPECT_EQ(refusal([&] { batch.step(pointers, std::span(parameters).first(2)); }),
              "parameters of 2 bodies given for 3: there must be as many of them");
    parameters[2].time_step = NAN;
    EXPECT_EQ(refusal([&] { batch.step(pointers, parameters); }), refusal([&] { all[2].step(parameters[2]); }));
    EXPECT_EQ(refusal([&] { batch.step(all, parameters[2]); }), refusal([&] { all[2].step(parameters[2]); }));
    parameters[2] = parameters[0];
    pointers[2] = &all[0];
    EXPECT_EQ(refusal([&] { batch.step(pointers, parameters); }),
              "bodies[2] is bodies[0] too: each must be named once");
    pointers[1] = nullptr;
    EXPECT_EQ(refusal([&] { batch.step(pointers, parameters); }), "bodies[1] is null: it must point to a body");
    EXPECT_EQ(refusal([&] { batch.step(all, parameters[0], -1); }), refusal([&] { all[0].step(parameters[0], -1); }));
    EXPECT_EQ(refusal([] { Batch<float>(-1); }),
              "threads = -1 is not allowed: it must be at least 0 (0: all of the machine)");
    EXPECT_EQ(bits_of_all(all), before);
}

} // namespace
} // namespace hybmss
