// Compiled once for each instruction set: forces and energies of a network's cells with springs on means.
#include "kernels/compiled_set.hpp"
#include "kernels/means/cell_corners.hpp"
#include "kernels/means/mean_cell.hpp"

namespace hybmss::kernels {
namespace {

/// Adds the forces of mean_cell_forces.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
void network_means(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes, Range begin, Range end) {
    for_each_vector<V>(cells, begin, end, [&](Range i, int lane, const MeanFactors<V>& by) HYBMSS_INLINE_BODY {
        Vector3<V> corner[8];
        load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, corner);
        const CornerForces<V> force =
            mean_cell_forces<face_diagonals, volume, accuracy>(corner, by.stiffness, by.kappa, cells.constants);
        for (int c = 0; c < 4; ++c) {
            corner[c] = force.odd[c] - force.even[c];
            corner[7 - c] = Vector3<V>{-force.odd[c].x, -force.odd[c].y, -force.odd[c].z} - force.even[c];
        }
        add_corners(cells, i, lane, corner, nodes.product);
    });
}

template <bool face_diagonals, Volume volume, class V>
LayerEnergy network_mean_energy(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes, Range begin,
                                Range end) {
    LayerEnergy energy{0, 0};
    for_each_vector<V>(cells, begin, end, [&](Range i, int lane, const MeanFactors<V>& by) HYBMSS_INLINE_BODY {
        Vector3<V> corner[8];
        load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, corner);
        const V springs = mean_cell_energy<face_diagonals>(corner, by.stiffness, cells.constants);
        energy.springs += sum_in_double(divide(springs, by.inverse_edge));
        if constexpr (volume != Volume::none) {
            const V volumes = mean_cell_volume_energy<volume>(corner, by.kappa);
            energy.volume += sum_in_double(divide(volumes, by.inverse_edge));
        }
    });
    return energy;
}

} // namespace

HYBMSS_DEFINE_KERNEL(network_means);
HYBMSS_DEFINE_KERNEL(network_mean_energy);

} // namespace hybmss::kernels
