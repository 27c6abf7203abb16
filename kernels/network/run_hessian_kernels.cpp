// Compiled once for each instruction set: second derivatives of a packed network's runs. A run is made a block with
// indices and goes through the kernels for those: their arithmetic, not their loads, is what takes the time.
#include "kernels/compiled_set.hpp"
#include "kernels/network/packed_hessian.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
HYBMSS_INLINE void set_nodes(std::int32_t first, std::int32_t* nodes) {
    for (int i = 0; i < kBlockItems; ++i) {
        nodes[i] = first + kRow<V>.index[i];
    }
}

template <class T>
HYBMSS_INLINE void copy_row(const T* from, T* to) {
    for (int i = 0; i < kBlockItems; ++i) {
        to[i] = from[i];
    }
}

template <class V>
HYBMSS_INLINE void set_block(const SpringRuns<Scalar<V>>& springs, std::ptrdiff_t i, SpringBlock<Scalar<V>>& block) {
    const SpringRun& run = springs.runs[i];
    const SpringRunShape<Scalar<V>>& shape = springs.shapes[run.shape];
    set_nodes<V>(run.low, block.a);
    set_nodes<V>(run.high, block.b);
    for (int axis = 0; axis < 3; ++axis) {
        copy_row(shape.rest[axis], block.rest[axis]);
    }
    copy_row(springs.stiffnesses[run.stiffness].lane, block.stiffness);
    copy_row(shape.inverse_length2, block.inverse_length2);
}

template <class V>
HYBMSS_INLINE void set_block(const CellRuns<Scalar<V>>& cells, std::ptrdiff_t i, CellBlock<Scalar<V>>& block) {
    const CellRun& run = cells.runs[i];
    const CellRunShape<Scalar<V>>& shape = cells.shapes[run.shape];
    for (int corner = 0; corner < 8; ++corner) {
        set_nodes<V>(run.node[corner], block.node[corner]);
    }
    for (int e = 0; e < 9; ++e) {
        copy_row(shape.rest_edge[e], block.rest_edge[e]);
    }
    copy_row(cells.kappas[run.weights].lane, block.kappa);
    copy_row(shape.inverse_volume, block.inverse_volume);
}

template <SpringLaw law, Accuracy accuracy, class V>
void run_spring_product(const SpringRuns<Scalar<V>>& springs, const PackedHessian<Scalar<V>>& nodes,
                        std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        SpringBlock<Scalar<V>> block;
        set_block<V>(springs, i, block);
        packed_spring_product<law, accuracy, V>(&block, nodes, 0, 1);
    }
}

template <Volume volume, class V>
void run_cell_product(const CellRuns<Scalar<V>>& cells, const PackedHessian<Scalar<V>>& nodes, std::ptrdiff_t begin,
                      std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        CellBlock<Scalar<V>> block;
        set_block<V>(cells, i, block);
        packed_cell_product<volume, V>(&block, nodes, 0, 1);
    }
}

template <SpringLaw law, Accuracy accuracy, class V>
void run_spring_diagonal(const SpringRuns<Scalar<V>>& springs, const Scalar<V>* displacement,
                         const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        SpringBlock<Scalar<V>> block;
        set_block<V>(springs, i, block);
        packed_spring_diagonal<law, accuracy, V>(&block, displacement, blocks, 0, 1);
    }
}

template <Volume volume, class V>
void run_cell_diagonal(const CellRuns<Scalar<V>>& cells, const Scalar<V>* displacement,
                       const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        CellBlock<Scalar<V>> block;
        set_block<V>(cells, i, block);
        packed_cell_diagonal<volume, V>(&block, displacement, blocks, 0, 1);
    }
}

template <class V>
double run_stiffening_energy(const SpringRuns<Scalar<V>>& springs, const PackedHessian<Scalar<V>>& nodes,
                             std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        SpringBlock<Scalar<V>> block;
        set_block<V>(springs, i, block);
        double of_run = 0;
        for (int lane = 0; lane < kBlockItems; lane += kTogether<V> * kWidth<V>) {
            V stored[kTogether<V>];
            for (int v = 0; v < kTogether<V>; ++v) {
                stored[v] = block_stiffening<V>(block, lane + v * kWidth<V>, nodes);
            }
            add_run(of_run, stored);
        }
        energy += of_run;
    }
    return energy;
}

} // namespace

HYBMSS_DEFINE_ORDERED_KERNEL(run_spring_product);
HYBMSS_DEFINE_COMMON_KERNEL(run_cell_product);
HYBMSS_DEFINE_COMMON_KERNEL(run_spring_diagonal);
HYBMSS_DEFINE_COMMON_KERNEL(run_cell_diagonal);
HYBMSS_DEFINE_ORDERED_KERNEL(run_stiffening_energy);

} // namespace hybmss::kernels
