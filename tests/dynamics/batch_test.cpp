// A batch gives every body the bits it gets alone.

#include "hybmss/batch.hpp"

#include "tests/moving_body.hpp"

#include <gtest/gtest.h>

#include <cmath>
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
    EXPECT_EQ(refusal([] { Batch<float>(-1); }),
              "threads = -1 is not allowed: it must be at least 0 (0: all of the machine)");
    EXPECT_EQ(bits_of_all(all), before);
}

} // namespace
} // namespace hybmss
