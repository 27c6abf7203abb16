// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian_diagonal_impl.hpp"
#include "kernels/lattice/lattice_hessian_impl.hpp"

namespace hybmss::kernels {
namespace {

template <bool face_diagonals, Accuracy accuracy, class V>
constexpr void set_sweeps(LatticeHessianKernels<Scalar<V>>& table) {
    constexpr int a = tangent_index(accuracy), none = static_cast<int>(Volume::none),
                  quadratic = static_cast<int>(Volume::quadratic), mean = static_cast<int>(Volume::mean_stretch);
    auto& product = table.product.layer[face_diagonals];
    product[none][a] = lattice_hessian_product<face_diagonals, Volume::none, accuracy, V>;
    product[quadratic][a] = lattice_hessian_product<face_diagonals, Volume::quadratic, accuracy, V>;
    product[mean][a] = lattice_hessian_product<face_diagonals, Volume::mean_stretch, accuracy, V>;
    table.product.top[face_diagonals][a] = lattice_hessian_product_top<face_diagonals, accuracy, V>;
    auto& diagonal = table.diagonal.layer[face_diagonals];
    diagonal[none][a] = lattice_hessian_diagonal<face_diagonals, Volume::none, accuracy, V>;
    diagonal[quadratic][a] = lattice_hessian_diagonal<face_diagonals, Volume::quadratic, accuracy, V>;
    diagonal[mean][a] = lattice_hessian_diagonal<face_diagonals, Volume::mean_stretch, accuracy, V>;
    table.diagonal.top[face_diagonals][a] = lattice_hessian_diagonal_top<face_diagonals, accuracy, V>;
}

template <class V>
constexpr LatticeHessianKernels<Scalar<V>> lattice_hessian_kernels() {
    LatticeHessianKernels<Scalar<V>> table{};
    set_sweeps<false, Accuracy::accurate, V>(table);
    set_sweeps<false, Accuracy::exact, V>(table);
    set_sweeps<true, Accuracy::accurate, V>(table);
    set_sweeps<true, Accuracy::exact, V>(table);
    table.product.join = lattice_hessian_join<3, V>;
    table.diagonal.join = lattice_hessian_join<kBlockEntries, V>;
    return table;
}

} // namespace

constinit const LatticeHessianKernels<float> HYBMSS_KERNEL_SET::kLatticeHessianFloat =
    lattice_hessian_kernels<FloatBatch>();
constinit const LatticeHessianKernels<double> HYBMSS_KERNEL_SET::kLatticeHessianDouble =
    lattice_hessian_kernels<DoubleBatch>();

} // namespace hybmss::kernels
