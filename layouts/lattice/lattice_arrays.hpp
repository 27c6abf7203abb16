#pragma once

#include "layouts/aligned_array.hpp"
#include "layouts/lattice/cell_shares.hpp"
#include "layouts/lattice/vector_neighbors.hpp"
#include "layouts/node_runs.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace hybmss {

/// A lattice in memory: what flat_rows() and active_rows() fill, each in its own order, and what a sweep from plane to
/// plane needs. See kernels::LatticeLayer.
template <class T>
struct LatticeArrays {
    LatticeAxes axes;
    std::size_t row = 0;            ///< flat-rows: nodes of a row
    std::size_t cell_lanes = 0;     ///< flat-rows: of `lanes`, those that hold all cells, whole vectors of the widest
    std::size_t planes = 0;         ///< of nodes
    std::size_t plane = 0;          ///< flat-rows: distance of planes; else length of the longest
    std::vector<std::size_t> begin; ///< of each plane; one more entry at the end of the last
    std::vector<std::size_t> lanes; ///< of each plane: elements that a sweep visits
    /// Where each plane begins in the arrays of stiffness. Planes with the same cells below and above share one: a box
    /// has three, and a sweep finds the one in the middle in cache, layer for layer.
    std::vector<std::size_t> stiffness_begin;
    double cell_size = 0;
    AlignedArray<T> stiffness[7];           ///< k h, N; of face diagonals only where there are any
    AlignedArray<T> inverse_mass;           ///< 1 / (m h); 0 at void nodes
    std::vector<VectorNeighbors> neighbors; ///< active-rows
    std::size_t width = 0;                  ///< active-rows: lanes of a vector
    T volume_ratio = 0;                     ///< kappa h^2 / (32 k_c h)
    std::vector<double> masses;             ///< kg, one a node of the body
    std::vector<NodeRun> runs;              ///< of the body's nodes, ascending

    /// Elements of every array.
    std::size_t size() const { return inverse_mass.size(); }
    std::size_t bytes() const {
        return (size() + (stiffness[3].size() > 0 ? 7 : 4) * stiffness[0].size()) * sizeof(T) +
               (begin.size() + lanes.size() + stiffness_begin.size()) * sizeof(std::size_t) +
               neighbors.size() * sizeof(VectorNeighbors) + masses.size() * sizeof(double) +
               runs.size() * sizeof(NodeRun);
    }

    /// Room for `elements`, and for so many of stiffness, and what fills the last vector of the widest kind: loops over
    /// whole arrays have no tail.
    void allocate(std::size_t elements, std::size_t stiffness_elements, bool face_diagonals) {
        for (std::size_t kind = 0; kind < 7; ++kind) {
            if (face_diagonals || kind < 3 || kind == 6) {
                stiffness[kind] = AlignedArray<T>(padded(stiffness_elements));
            }
        }
        inverse_mass = AlignedArray<T>(padded(elements));
    }
    /// Where the stiffness of planes begins that share none.
    std::vector<std::size_t> own_stiffness() const { return {begin.begin(), begin.end() - 1}; }
    /// Gives every plane a stiffness of its own, so that its nodes can be set apart. Changes nothing where memory does
    /// not suffice.
    void separate_planes() {
        if (stiffness[0].size() == size()) {
            return;
        }
        std::vector<std::size_t> places = own_stiffness();
        AlignedArray<T> own[7];
        for (std::size_t kind = 0; kind < 7; ++kind) {
            if (stiffness[kind].size() == 0) {
                continue;
            }
            own[kind] = AlignedArray<T>(size());
            for (std::size_t k = 0; k < planes; ++k) {
                std::copy_n(stiffness[kind].data() + stiffness_begin[k], begin[k + 1] - begin[k],
                            own[kind].data() + places[k]);
            }
        }
        std::move(own, own + 7, stiffness);
        stiffness_begin.swap(places);
    }
    /// Sets node n, whose stiffness is at `place`.
    void set_node(std::size_t n, std::size_t place, const CellShares::Node& node, const CellShares& shares) {
        for (std::size_t kind = 0; kind < 7; ++kind) {
            if (stiffness[kind].size() == 0) {
                continue;
            }
            stiffness[kind][place] = static_cast<T>(node.stiffness[kind]);
        }
        inverse_mass[n] = node.cells > 0 ? static_cast<T>(shares.inverse_mass(node.cells)) : T(0);
    }
};

} // namespace hybmss
