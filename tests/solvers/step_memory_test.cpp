// What later implicit steps depend on is the state and the solver's memory, with every bit, and nothing else.

#include "hybmss/equilibrium.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace hybmss {
namespace {

/// A bar whose far end is turned and pushed by a little more in every step.
template <class T>
class Bar {
public:
    Bar(InstructionSet set, double poisson_ratio)
        : lattice_(Lattice::box(4, 5, 6, 0.1)),
          solver_(lattice_, {.young_modulus = 1e4, .poisson_ratio = poisson_ratio}, options(set)),
          u_(3 * solver_.node_count()), v_(u_.size()) {}

    void step(int number) {
        Loading loading;
        for (std::uint32_t n = 0; n < solver_.node_count(); ++n) {
            const std::uint32_t y = n / 5 % 6;
            if (y == 0 || y == 5) {
                loading.supports.push_back({.node = n, .axes = 7});
                if (y == 5) {
                    loading.supports.back().displacement = {0.01 * number, 0, 0.005 * number};
                }
            }
        }
        loading.acceleration = {0, -10, 0};
        EquilibriumOptions solve;
        solve.preconditioner = PreconditionerKind::multigrid;
        solve.tolerance = 1e-4;
        const auto field = [&](std::vector<T>& values) {
            return VectorField<T>::aos(values.data(), solver_.node_count());
        };
        EXPECT_EQ(solver_.step(loading, 0.13, 0.3, field(u_), field(v_), solve).status, EquilibriumStatus::converged);
    }
    /// Another solver that is given this one's state.
    Bar successor(InstructionSet set, double poisson_ratio) const {
        Bar next(set, poisson_ratio);
        next.u_ = u_;
        next.v_ = v_;
        next.solver_.set_memory(solver_.memory());
        return next;
    }
    bool operator==(const Bar& other) const {
        return u_ == other.u_ && v_ == other.v_ && solver_.memory() == other.solver_.memory();
    }

private:
    static PlanOptions options(InstructionSet set) {
        PlanOptions options;
        options.instruction_set = set;
        return options;
    }
    Lattice lattice_;
    EquilibriumSolver<T> solver_;
    std::vector<T> u_, v_;
};

template <class T>
void check(double poisson_ratio) {
    for (const InstructionSet set : available_instruction_sets()) {
        Bar<T> bar(set, poisson_ratio);
        for (int number = 1; number <= 5; ++number) {
            Bar<T> successor = bar.successor(set, poisson_ratio);
            bar.step(number);
            successor.step(number);
            EXPECT_TRUE(bar == successor) << name(set) << ", step " << number << ", nu = " << poisson_ratio;
        }
    }
}

// nu = 0.499 has rotations among the smoother's corrections, nu = 0.2 has not.
TEST(StepMemory, IsAllThatLaterStepsDependOn) {
    for (const double poisson_ratio : {0.2, 0.499}) {
        check<float>(poisson_ratio);
        check<double>(poisson_ratio);
    }
}

} // namespace
} // namespace hybmss
