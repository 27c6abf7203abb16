// Interleaved memory and arrays of a component each: every value goes where it belongs, whole vectors and rest.

#include "kernels/kernel_table.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace hybmss {
namespace {

template <class T>
class Interleaved : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(Interleaved, Reals);

TYPED_TEST(Interleaved, EveryValueGoesWhereItBelongs) {
    using T = TypeParam;
    for (const InstructionSet set : available_instruction_sets()) {
        const kernels::KernelTable<T>& table = kernels::kernel_table<T>(set);
        SCOPED_TRACE(name(set));
        for (std::size_t count = 0; count < 40; ++count) {
            const auto nodes = static_cast<kernels::Range>(count);
            // One element beyond on either side, which stays as it is; and so no vector is aligned.
            std::vector<T> xyz(3 * count + 2), x(count + 2, T(-1)), y(x), z(x);
            std::iota(xyz.begin(), xyz.end(), T(1));
            table.from_interleaved()(xyz.data() + 1, T(2), x.data() + 1, y.data() + 1, z.data() + 1, nodes);
            std::vector<T> added(xyz), put(xyz.size(), T(-1));
            table.to_interleaved(true)(x.data() + 1, y.data() + 1, z.data() + 1, T(3), added.data() + 1, nodes);
            table.to_interleaved(false)(x.data() + 1, y.data() + 1, z.data() + 1, T(3), put.data() + 1, nodes);
            for (std::size_t n = 0; n < count; ++n) {
                EXPECT_EQ(x[n + 1], 2 * xyz[3 * n + 1]) << n << " of " << count;
                EXPECT_EQ(y[n + 1], 2 * xyz[3 * n + 2]) << n << " of " << count;
                EXPECT_EQ(z[n + 1], 2 * xyz[3 * n + 3]) << n << " of " << count;
            }
            for (std::size_t i = 1; i <= 3 * count; ++i) {
                EXPECT_EQ(added[i], 7 * xyz[i]) << i << " of " << count;
                EXPECT_EQ(put[i], 6 * xyz[i]) << i << " of " << count;
            }
            for (const std::vector<T>* array : {&x, &y, &z, &put}) {
                EXPECT_EQ(array->front(), T(-1));
                EXPECT_EQ(array->back(), T(-1));
            }
            EXPECT_EQ(added.front(), xyz.front());
            EXPECT_EQ(added.back(), xyz.back());
        }
    }
}

} // namespace
} // namespace hybmss
