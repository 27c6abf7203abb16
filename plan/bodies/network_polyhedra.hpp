#pragma once

#include "hybmss/network.hpp"
#include "kernels/kernel_table.hpp"
#include "plan/bodies/body.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace hybmss {

/// What a network's polyhedra add to its forces and second derivatives, in either layout: by blocks of one shape, which
/// the layout has in its colours; and what volumes of nodes are.
template <class T>
class NetworkPolyhedra {
public:
    using Block = PolyhedronBlock<T>;
    /// What is done with blocks [begin, end) of a shape, 0 to 2.
    using Visit = std::function<void(std::size_t shape, const Block* blocks, kernels::Range begin, kernels::Range end)>;

    /// \param elements of an array of nodes; \param first the first element of a node, by its number
    NetworkPolyhedra(const Network& network, const kernels::KernelTable<T>& table, kernels::Volume volume,
                     std::size_t elements, const std::function<std::size_t(std::size_t node)>& first);

    bool any() const { return any_; }
    /// " + polyhedra<quadratic>", or of nodes; empty where there are none.
    std::string kernels(kernels::Volume volume) const;
    bool of_nodes() const { return inverse_volume_.size() > 0; }
    std::size_t bytes() const { return kappa_.bytes() + inverse_volume_.bytes(); }
    /// Makes the state's own arrays, of volumes of nodes.
    void prepare(State<T>& state) const;

    Visit forces(State<T>& state, const kernels::HessianArrays<T>& fields) const;
    Visit product(State<T>& state, const kernels::HessianArrays<T>& fields) const;
    /// The stages that must have run before these: none unless volumes are nodes'. `over` makes stages of a visit.
    template <class Over>
    std::vector<Stage> before(State<T>& state, const kernels::HessianArrays<T>& fields, const Over& over) const {
        if (!of_nodes()) {
            return {};
        }
        std::vector<Stage> stages = {clear_stage(state)};
        append(over(dilations(state, fields)), stages);
        stages.push_back(pressure_stage(state, fields.direction[0] != nullptr));
        return stages;
    }
    /// J of blocks: 0 where volumes are nodes'.
    double energy(std::size_t shape, const Block* blocks, const kernels::HessianArrays<T>& fields, kernels::Range begin,
                  kernels::Range end) const;
    /// J of nodes, once before() has run.
    double nodal_energy(State<T>& state) const;
    /// Adds the blocks on the diagonal; of nodes' volumes all at once, once before() has run, and nothing by visits.
    Visit diagonal(const kernels::HessianArrays<T>& fields, const kernels::DiagonalBlocks<T>& sums) const;
    void add_nodal_diagonal(State<T>& state, const kernels::DiagonalBlocks<T>& sums) const;

private:
    Visit dilations(State<T>& state, const kernels::HessianArrays<T>& fields) const;
    Stage clear_stage(State<T>& state) const;
    Stage pressure_stage(State<T>& state, bool directed) const;
    kernels::NodalVolumeArrays<T> arrays(State<T>& state) const;

    /// For blocks on the diagonal, where a node's volume makes neighbours meet: the polyhedra, their nodes' first
    /// elements, and which pair of nodes (the volume's, the moved one) each pair of corners is.
    struct Neighbors {
        std::vector<Network::Polyhedron> polyhedra;
        std::vector<std::array<double, 18>> rest; ///< their corners, m
        std::vector<std::uint32_t> pair;          ///< 36 a polyhedron
        std::vector<std::array<std::uint32_t, 2>> pairs;
    };

    const kernels::KernelTable<T>* table_;
    kernels::Volume volume_;
    bool any_;
    AlignedArray<T> kappa_, inverse_volume_; ///< of nodes, or empty
    Neighbors neighbors_;
};

extern template class NetworkPolyhedra<float>;
extern template class NetworkPolyhedra<double>;

} // namespace hybmss
