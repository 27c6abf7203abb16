// Compiled once for each instruction set: forces and energies of a network's cells with springs on means.
#include "kernels/compiled_set.hpp"
#include "kernels/means/cell_corners.hpp"
#include "kernels/means/mean_cell.hpp"

#include <iterator>

namespace hybmss::kernels {
namespace {

/// Adds the forces of mean_cell_forces.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
void network_means(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes, Range begin, Range end) {
    const auto forces = [&](Range i, int lane, const MeanFactors<V>& by, Vector3<V>(&corner)[8]) HYBMSS_INLINE_BODY {
        load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, corner);
        const CornerForces<V> force =
            mean_cell_forces<face_diagonals, volume, accuracy>(corner, by.stiffness, by.kappa, cells.constants);
        for (int c = 0; c < 4; ++c) {
            corner[c] = force.odd[c] - force.even[c];
            corner[7 - c] = Vector3<V>{-force.odd[c].x, -force.odd[c].y, -force.odd[c].z} - force.even[c];
        }
    };
    add_to_corners<V>(cells, begin, end, nodes.product, forces);
}

template <bool face_diagonals, Volume volume, class V>
LayerEnergy network_mean_energy(const MeanCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes, Range begin,
                                Range end) {
    double sum[volume == Volume::none ? 1 : 2] = {};
    add_of_cells<V>(
        cells, begin, end, sum, [&](Range i, int lane, const MeanFactors<V>& by, auto& found) HYBMSS_INLINE_BODY {
            Vector3<V> corner[8];
            load_corners(cells, i, lane, nodes.displacement, by.inverse_edge, corner);
            found[0] = divide(mean_cell_energy<face_diagonals>(corner, by.stiffness, cells.constants), by.inverse_edge);
            if constexpr (volume != Volume::none) {
                found[1] = divide(mean_cell_volume_energy<volume>(corner, by.kappa), by.inverse_edge);
            }
        });
    return {sum[0], volume == Volume::none ? 0 : sum[std::size(sum) - 1]};
}

} // namespace

HYBMSS_DEFINE_ORDERED_KERNEL(network_means);
HYBMSS_DEFINE_ORDERED_KERNEL(network_mean_energy);

} // namespace hybmss::kernels
