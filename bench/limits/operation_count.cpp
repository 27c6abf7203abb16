// Compiled with bench/counting first on the include path: kernels/simd.hpp is the counting one here.
#include "bench/limits/operation_count.hpp"

#include "kernels/lattice/lattice_sweep.hpp"

#include <iterator>
#include <utility>
#include <vector>

namespace hybmss::bench {
namespace {

using kernels::LatticeLayer;
using kernels::Volume;

/// The arrays of a layer; only their addresses matter.
template <class T>
struct LayerArrays {
    explicit LayerArrays(std::ptrdiff_t vectors) {
        constexpr std::ptrdiff_t kRow = 5;
        layer.row = kRow;
        layer.lanes = layer.cell_lanes = vectors * kernels::kMaxWidth;
        layer.plane = layer.lanes + 2 * kernels::kMaxWidth;
        // Two planes, and the last vector reaches one row further.
        memory.assign(static_cast<std::size_t>(kArrays * stride()), T(0));
        T* next = memory.data();
        const auto take = [&] { return std::exchange(next, next + stride()); };
        for (int c = 0; c < 3; ++c) {
            layer.displacement[c] = take();
            layer.velocity[c] = take();
            layer.partial[c] = take();
            layer.above[c] = take();
        }
        layer.inverse_mass = take();
        for (auto& stiffness : layer.stiffness) {
            stiffness = take();
        }
        layer.volume_ratio = T(0.75);
        layer.finish = kernels::Finish::integrate_driven;
        layer.step = {T(0.01), T(0.99), T(0.02), {T(0.1), T(0.2), T(0.3)}};
    }

    std::ptrdiff_t stride() const { return 3 * layer.plane; }
    bool in(const std::set<const void*>& touched, const T* array) const {
        const auto first = touched.lower_bound(array);
        return first != touched.end() && *first < array + stride();
    }

    static constexpr std::ptrdiff_t kArrays = 20;
    LatticeLayer<T> layer{};
    std::vector<T> memory;
};

template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
KernelCount count() {
    using T = kernels::Scalar<V>;
    KernelCount result{};
    result.width = kernels::kWidth<V>;
    // The difference of two lengths is free of what happens before the loop.
    OperationCount counts[2];
    for (const int vectors : {2, 3}) {
        const LayerArrays<T> arrays(vectors);
        kernels::ledger = {};
        kernels::lattice_layer<face_diagonals, volume, accuracy, V>(arrays.layer);
        counts[vectors - 2] = kernels::ledger.count;
        result.arrays_read = result.arrays_updated = result.planes_read = 0;
        for (const T* array : arrays.layer.stiffness) {
            result.planes_read += arrays.in(kernels::ledger.read, array);
        }
        std::vector<const T*> bodies = {arrays.layer.inverse_mass};
        bodies.insert(bodies.end(), std::begin(arrays.layer.displacement), std::end(arrays.layer.displacement));
        bodies.insert(bodies.end(), std::begin(arrays.layer.velocity), std::end(arrays.layer.velocity));
        for (const T* array : bodies) {
            const bool written = arrays.in(kernels::ledger.written, array);
            result.arrays_updated += written;
            result.arrays_read += !written && arrays.in(kernels::ledger.read, array);
        }
    }
    const double vectors = static_cast<double>(kernels::kMaxWidth / kernels::kWidth<V>);
    for (double OperationCount::*heading :
         {&OperationCount::multiplications, &OperationCount::additions, &OperationCount::others,
          &OperationCount::estimates, &OperationCount::square_roots, &OperationCount::divisions, &OperationCount::loads,
          &OperationCount::stores}) {
        result.vector.*heading = (counts[1].*heading - counts[0].*heading) / vectors;
    }
    return result;
}

template <Accuracy accuracy, class V>
KernelCount count_model(Model model) {
    switch (model) {
    case Model::without_face_diagonals:
        return count<false, Volume::quadratic, accuracy, V>();
    case Model::without_correction_forces:
        return count<true, Volume::none, accuracy, V>();
    default:
        return count<true, Volume::quadratic, accuracy, V>();
    }
}

template <InstructionSet set>
KernelCount count_set(const BenchRow& row) {
    constexpr bool kAlike = true;
    using F = kernels::Counted<float, set, !kAlike>;
    using D = kernels::Counted<double, set, !kAlike>;
    using AlikeF = kernels::Counted<float, set, kAlike>;
    using AlikeD = kernels::Counted<double, set, kAlike>;
    const bool single = row.precision == Precision::float32;
    switch (row.accuracy) {
    case Accuracy::fast:
        return single ? count_model<Accuracy::fast, F>(row.model) : count_model<Accuracy::fast, D>(row.model);
    case Accuracy::exact:
        return single ? count_model<Accuracy::exact, AlikeF>(row.model)
                      : count_model<Accuracy::exact, AlikeD>(row.model);
    default:
        return single ? count_model<Accuracy::accurate, F>(row.model) : count_model<Accuracy::accurate, D>(row.model);
    }
}

} // namespace

KernelCount count_operations(const BenchRow& row) {
    switch (row.instruction_set) {
    case InstructionSet::avx512:
        return count_set<InstructionSet::avx512>(row);
    case InstructionSet::avx2:
        return count_set<InstructionSet::avx2>(row);
    case InstructionSet::neon:
        return count_set<InstructionSet::neon>(row);
    default:
        return count_set<InstructionSet::sse2>(row);
    }
}

} // namespace hybmss::bench
