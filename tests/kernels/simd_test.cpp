// Every vector operation against scalar arithmetic, on every instruction set of the machine.

#include "tests/kernels/simd_probe.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

namespace hybmss::testing {

#define HYBMSS_BUILT_ONLY
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    namespace set {                                                                                                    \
    extern const SimdProbe<float> float_probe;                                                                         \
    extern const SimdProbe<double> double_probe;                                                                       \
    }
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET

namespace {

constexpr int kMaxWidth = 16;

template <class T>
std::vector<const SimdProbe<T>*> probes() {
    std::vector<const SimdProbe<T>*> all;
    const auto add = [&](InstructionSet set, const SimdProbe<float>& float_probe,
                         const SimdProbe<double>& double_probe) {
        const std::vector<InstructionSet> here = available_instruction_sets();
        if (std::find(here.begin(), here.end(), set) == here.end()) {
            return;
        }
        if constexpr (std::is_same_v<T, float>) {
            all.push_back(&float_probe);
        } else {
            all.push_back(&double_probe);
        }
        EXPECT_EQ(all.back()->instruction_set, set);
    };
#define HYBMSS_INSTRUCTION_SET(set, ...) add(InstructionSet::set, set::float_probe, set::double_probe);
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
    return all;
}

template <class T>
struct Simd : ::testing::Test {
    static constexpr double kEpsilon = static_cast<double>(std::numeric_limits<T>::epsilon());

    /// Random magnitudes over many binades, either sign.
    std::vector<T> random(double low_exponent, double high_exponent, bool positive = false) {
        std::uniform_real_distribution<double> exponent(low_exponent, high_exponent);
        std::vector<T> values;
        for (int i = 0; i < kMaxWidth; ++i) {
            const double sign = positive || engine() % 2 ? 1 : -1;
            values.push_back(static_cast<T>(sign * std::exp2(exponent(engine))));
        }
        return values;
    }
    static std::vector<T> zeros() { return std::vector<T>(kMaxWidth, T(0)); }

    /// Relative error of a unary operation against `exact`, at `rounds` random vectors and the given edge values.
    template <class Exact>
    void expect_unary(const SimdProbe<T>& probe, void (*operation)(const T*, T*), const Exact& exact, double low,
                      double high, bool positive, double tolerance, const char* what) {
        for (int round = 0; round < 2000; ++round) {
            const auto a = random(low, high, positive);
            auto out = zeros();
            operation(a.data(), out.data());
            for (int i = 0; i < probe.width; ++i) {
                const auto n = static_cast<std::size_t>(i);
                const double x = static_cast<double>(a[n]), want = exact(x);
                ASSERT_LE(std::abs(static_cast<double>(out[n]) - want), tolerance * std::abs(want))
                    << name(probe.instruction_set) << " " << what << "(" << x << ")";
            }
        }
    }

    std::mt19937 engine{20200101};
};

using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Simd, Precisions);

// With fused operations one rounding, without two: one epsilon of the larger operand either way.
TYPED_TEST(Simd, FusedOperations) {
    using T = TypeParam;
    for (const auto* p : probes<T>()) {
        for (int round = 0; round < 500; ++round) {
            const auto a = this->random(-3, 3), b = this->random(-3, 3), c = this->random(-3, 3);
            auto sum = this->zeros(), negative = this->zeros(), difference = this->zeros(), minus_sum = this->zeros();
            p->multiply_add(a.data(), b.data(), c.data(), sum.data());
            p->subtract_product(a.data(), b.data(), c.data(), negative.data());
            p->multiply_subtract(a.data(), b.data(), c.data(), difference.data());
            p->minus_product_minus(a.data(), b.data(), c.data(), minus_sum.data());
            for (int i = 0; i < p->width; ++i) {
                const auto n = static_cast<std::size_t>(i);
                const double ab = static_cast<double>(a[n]) * static_cast<double>(b[n]);
                const double cc = static_cast<double>(c[n]);
                const double tolerance = this->kEpsilon * (std::abs(ab) + std::abs(cc));
                EXPECT_NEAR(static_cast<double>(sum[n]), ab + cc, tolerance) << name(p->instruction_set);
                EXPECT_NEAR(static_cast<double>(negative[n]), cc - ab, tolerance) << name(p->instruction_set);
                EXPECT_NEAR(static_cast<double>(difference[n]), ab - cc, tolerance) << name(p->instruction_set);
                EXPECT_NEAR(static_cast<double>(minus_sum[n]), -ab - cc, tolerance) << name(p->instruction_set);
            }
        }
    }
}

TYPED_TEST(Simd, LanesMoveWhereTheyShould) {
    using T = TypeParam;
    for (const auto* p : probes<T>()) {
        std::vector<T> previous, current;
        for (int i = 0; i < kMaxWidth; ++i) {
            previous.push_back(static_cast<T>(100 + i));
            current.push_back(static_cast<T>(200 + i));
        }
        auto out = this->zeros();
        p->shift_in(previous.data(), current.data(), out.data());
        EXPECT_EQ(out[0], static_cast<T>(100 + p->width - 1)) << name(p->instruction_set);
        for (int i = 1; i < p->width; ++i) {
            EXPECT_EQ(out[static_cast<std::size_t>(i)], static_cast<T>(200 + i - 1)) << name(p->instruction_set);
        }

        std::vector<T> base(64, T(-1));
        for (std::size_t i = 0; i < base.size(); ++i) {
            base[i] = static_cast<T>(i);
        }
        std::vector<std::int32_t> index;
        for (int i = 0; i < kMaxWidth; ++i) {
            index.push_back((i * 37 + 5) % 64);
        }
        p->gather(base.data(), index.data(), out.data());
        std::vector<T> target(64, T(-1));
        p->scatter(current.data(), target.data(), index.data());
        for (int i = 0; i < p->width; ++i) {
            const auto n = static_cast<std::size_t>(i);
            EXPECT_EQ(out[n], static_cast<T>(index[n])) << name(p->instruction_set);
            EXPECT_EQ(target[static_cast<std::size_t>(index[n])], current[n]) << name(p->instruction_set);
            target[static_cast<std::size_t>(index[n])] = T(-1);
        }
        EXPECT_EQ(target, std::vector<T>(64, T(-1))) << name(p->instruction_set);

        double sum = 0;
        for (int i = 0; i < p->width; ++i) {
            sum += 200 + i;
        }
        EXPECT_EQ(p->sum_in_double(current.data()), sum) << name(p->instruction_set);
    }
}

TYPED_TEST(Simd, ComparisonsAndRounding) {
    using T = TypeParam;
    for (const auto* p : probes<T>()) {
        for (int round = 0; round < 200; ++round) {
            auto a = this->random(-8, 4), b = this->random(-8, 4);
            a[0] = T(0);
            auto larger = this->zeros(), gate = this->zeros(), gated = this->zeros(), rounded = this->zeros();
            p->maximum(a.data(), b.data(), larger.data());
            p->one_where_positive(a.data(), gate.data());
            p->where_positive(a.data(), b.data(), gated.data());
            p->round_fraction_to_11_bits(a.data(), rounded.data());
            for (int i = 0; i < p->width; ++i) {
                const auto n = static_cast<std::size_t>(i);
                EXPECT_EQ(larger[n], std::max(a[n], b[n])) << name(p->instruction_set);
                EXPECT_EQ(gate[n], a[n] > 0 ? T(1) : T(0)) << name(p->instruction_set);
                EXPECT_EQ(gated[n], a[n] > 0 ? b[n] : T(0)) << name(p->instruction_set);
                // Half a unit rounds away from zero, which random numbers do not meet.
                const T unit = std::exp2(std::floor(std::log2(std::abs(a[n]))) - T(11));
                if (a[n] != 0) {
                    EXPECT_EQ(rounded[n], std::round(a[n] / unit) * unit) << name(p->instruction_set);
                }
            }
        }
    }
}

// The level `exact` is built on them.
TYPED_TEST(Simd, RootsAndQuotientsAreCorrectlyRounded) {
    using T = TypeParam;
    for (const auto* p : probes<T>()) {
        for (int round = 0; round < 2000; ++round) {
            const auto a = this->random(-60, 60, true), b = this->random(-3, 3);
            auto root = this->zeros(), quotient = this->zeros();
            p->square_root(a.data(), root.data());
            p->divide(b.data(), a.data(), quotient.data());
            for (std::size_t n = 0; n < static_cast<std::size_t>(p->width); ++n) {
                ASSERT_EQ(root[n], std::sqrt(a[n])) << name(p->instruction_set) << ' ' << a[n];
                ASSERT_EQ(quotient[n], b[n] / a[n]) << name(p->instruction_set) << ' ' << b[n] << " / " << a[n];
            }
        }
    }
}

TYPED_TEST(Simd, Roots) {
    using T = TypeParam;
    for (const auto* p : probes<T>()) {
        this->expect_unary(
            *p, p->cube_root_seed, [](double x) { return std::cbrt(x); }, -60, 60, true, 0.04, "cbrt seed");
        if (p->reciprocal_square_root_seed) {
            this->expect_unary(
                *p, p->reciprocal_square_root_seed, [](double x) { return 1 / std::sqrt(x); }, -60, 60, true,
                p->seed_error, "rsqrt seed");
            this->expect_unary(
                *p, p->reciprocal_seed, [](double x) { return 1 / x; }, -60, 60, true, p->seed_error, "rcp seed");
        }
    }
}

// 1 - 1/sqrt(1 + s) = s / (1 + s + sqrt(1 + s)), the right side free of cancellation.
//
// Above zero, and below it down to -1/2, a few epsilon at every magnitude. Towards s = -1 (coincident ends) the result
// grows like 1/sqrt(1 + s) and 1 + s keeps fewer digits: hence the bound below.
TYPED_TEST(Simd, SpringFactorKeepsItsDigits) {
    using T = TypeParam;
    const auto exact = [](double s) { return s / (1 + s + std::sqrt(1 + s)); };
    for (const auto* p : probes<T>()) {
        for (auto* operation : {p->one_minus_rsqrt_accurate, p->one_minus_rsqrt_exact}) {
            this->expect_unary(*p, operation, exact, -100, 20, true, 4 * this->kEpsilon, "spring factor");
            this->expect_unary(*p, operation, exact, -100, -1, false, 4 * this->kEpsilon, "spring factor");
        }
        // The estimates' errors at any magnitude, and no other.
        const double estimates = p->reciprocal_seed ? 2 * p->seed_error + 0x1p-19 : 4 * this->kEpsilon;
        this->expect_unary(*p, p->one_minus_rsqrt_fast, exact, -100, 20, true, estimates, "fast spring factor");
        this->expect_unary(*p, p->one_minus_rsqrt_fast, exact, -100, -1, false, estimates, "fast spring factor");
    }
}

TYPED_TEST(Simd, SpringFactorIsFiniteForCoincidentEnds) {
    using T = TypeParam;
    for (const auto* p : probes<T>()) {
        for (auto* operation : {p->one_minus_rsqrt_fast, p->one_minus_rsqrt_accurate, p->one_minus_rsqrt_exact}) {
            auto out = this->zeros();
            for (double rounding : {-4.0, -1.0, 0.0, 1.0, 100.0}) {
                const std::vector<T> s(kMaxWidth, static_cast<T>(-1 + rounding * this->kEpsilon));
                operation(s.data(), out.data());
                for (int i = 0; i < p->width; ++i) {
                    const double factor = static_cast<double>(out[static_cast<std::size_t>(i)]);
                    EXPECT_TRUE(std::isfinite(factor) && factor < 0 && factor > -0x1.8p20)
                        << name(p->instruction_set) << " " << factor;
                }
            }
        }
    }
}

TYPED_TEST(Simd, SquaredStrain) {
    using T = TypeParam;
    const auto exact = [](double s) { return std::pow(s / (1 + std::sqrt(1 + s)), 2); };
    for (const auto* p : probes<T>()) {
        this->expect_unary(*p, p->squared_strain, exact, -50, 20, true, 6 * this->kEpsilon, "squared strain");
    }
}

TYPED_TEST(Simd, CubeRootMinusOneKeepsItsDigits) {
    using T = TypeParam;
    // e = cbrt(1 + j) - 1 = j / (1 + c + c^2)
    const auto exact = [](double j) {
        const double c = std::cbrt(1 + j);
        return j / (1 + c + c * c);
    };
    const auto slope = [&](double j) {
        const double e = exact(j);
        return 3 * e / ((1 + e) * (1 + e));
    };
    for (const auto* p : probes<T>()) {
        this->expect_unary(*p, p->cube_root_minus_one, exact, -60, 15, true, 8 * this->kEpsilon, "cbrt(1+j)-1");
        this->expect_unary(*p, p->cube_root_minus_one, exact, -60, -0.2, false, 8 * this->kEpsilon, "cbrt(1+j)-1");
        this->expect_unary(*p, p->mean_stretch_slope, slope, -60, 15, true, 16 * this->kEpsilon, "phi'");
    }
}

TYPED_TEST(Simd, MeanStretchIsLinearWhereCrushed) {
    using T = TypeParam;
    for (const auto* p : probes<T>()) {
        for (double ratio : {0.125, 0.1, 0.0, -0.5, -30.0}) {
            const std::vector<T> j(kMaxWidth, static_cast<T>(ratio - 1));
            auto slope = this->zeros(), energy = this->zeros();
            p->mean_stretch_slope(j.data(), slope.data());
            p->mean_stretch_energy(j.data(), energy.data());
            for (int i = 0; i < p->width; ++i) {
                const auto n = static_cast<std::size_t>(i);
                EXPECT_NEAR(static_cast<double>(slope[n]), -6, 40 * this->kEpsilon) << name(p->instruction_set);
                EXPECT_NEAR(static_cast<double>(energy[n]), 1.125 - 6 * (ratio - 0.125),
                            40 * this->kEpsilon * (1 + std::abs(ratio)))
                    << name(p->instruction_set);
            }
        }
    }
}

} // namespace
} // namespace hybmss::testing
