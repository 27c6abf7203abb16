#pragma once

#include "dynamics/step.hpp"
#include "hybmss/explicit_dynamics.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace hybmss {

/// Cells that are of another size at rest than they were made with, and what that adds to a body's energy and its
/// derivatives: kernels/actuated_cell.hpp. Cells find what their corners feel, nodes gather it in the order of the
/// cells: the same for any number of threads.
template <class T>
class ActuatedBody {
public:
    /// Throws as ExplicitDynamics::actuate() does.
    ActuatedBody(const Body<T>& body, const Lattice& lattice, const Material& material,
                 std::span<const std::uint32_t> cells, std::span<const RestStretch> stretches);

    void set(std::span<const RestStretch> stretches);
    std::span<const RestStretch> stretches() const { return given_; }
    std::size_t bytes() const;
    /// By how much a cell's stiffness by its mass may be larger than that of a cell as it was made, >= 1.
    double greatest_stiffening() const;
    /// Those of the lattice's cells that are no more there act no more.
    void cut(const Lattice& lattice, std::span<const CutNode> nodes);

    /// J.
    double energy(const State<T>& state) const;
    /// The stages after which forces_at() holds; on `state` as it is when they run.
    void add_stages(const State<T>& state, std::vector<Stage>& stages) const;
    /// Of a node among those that these cells touch, N.
    std::array<double, 3> force_at(std::size_t node) const { return gathered(node, 3, {0, 1, 2}); }
    std::span<const std::size_t> places() const { return places_; } ///< of these nodes in the body's fields

    /// field += factor times the forces at a state, N.
    void add_forces(const Body<T>& body, const State<T>& state, double factor, NodeField<T>& field) const;
    /// product += second derivatives times `direction`, which is in the body's unit, in N.
    void add_product(const Body<T>& body, const State<T>& state, const NodeField<T>& direction,
                     NodeField<T>& product) const;
    /// blocks[e][place] += second derivatives of the node's own, in N by the body's unit: xx, yy, zz, xy, xz, yz.
    void add_diagonal(const Body<T>& body, const State<T>& state, AlignedArray<T> (&blocks)[6]) const;

private:
    static constexpr std::size_t kPiece = 128; ///< cells or nodes
    static std::size_t pieces(std::size_t count) { return (count + kPiece - 1) / kPiece; }
    kernels::ActuatedCells<T> arguments(const State<T>& state, const NodeField<T>* direction) const;
    /// The sum over a node's corners of three entries of those that each corner has so many of.
    std::array<double, 3> gathered(std::size_t node, std::size_t of_corner, std::array<std::size_t, 3> entries) const;
    using Kernel = void(const kernels::ActuatedCells<T>&, kernels::Range begin, kernels::Range end);
    /// Of a kernel over all cells.
    Stage stage(Kernel* kernel, const State<T>& state, const NodeField<T>* direction) const;
    /// field += factor times what the kernel has set.
    void add_gathered(const Body<T>& body, double factor, NodeField<T>& field) const;

    const kernels::KernelTable<T>* table_;
    bool means_;
    double edge_, length_unit_;
    kernels::ActuatedCells<T> cells_; ///< but for the fields
    std::size_t padded_;
    std::vector<RestStretch> given_;
    std::vector<std::uint32_t> grid_;      ///< the cells' indices in the grid
    std::vector<std::uint32_t> corners_;   ///< 8 arrays: places in a component of the body's fields, by their stride
    std::vector<T> values_;                ///< weight, kappa, stretches: five arrays
    mutable std::vector<T> result_;        ///< scratch, up to six entries a corner
    std::vector<std::size_t> places_;      ///< of nodes in the body's fields
    std::vector<std::uint32_t> numbers_;   ///< of nodes in the body, ascending
    std::vector<std::uint32_t> first_use_; ///< of a node in uses_, one more than nodes
    std::vector<std::uint32_t> uses_;      ///< 8 times the cell plus the corner
};

/// As an effect of explicit steps: forces at the beginning of a step. What a change of the sizes stores at once has
/// been put in by it.
template <class T>
class Actuation final : public StepEffect<T> {
public:
    Actuation(const Body<T>& body, const Lattice& lattice, const Material& material,
              std::span<const std::uint32_t> cells, std::span<const RestStretch> stretches)
        : cells_(body, lattice, material, cells, stretches) {}

    /// From now on, at a state.
    void set(const State<T>& state, std::span<const RestStretch> stretches);
    /// Counts what is stored now as put in, as if sizes had changed here.
    void start(const State<T>& state) { put_in_ = cells_.energy(state); }
    std::span<const RestStretch> stretches() const { return cells_.stretches(); }

    std::string_view name() const override { return "actuation"; }
    std::size_t bytes() const override { return cells_.bytes(); }
    void narrow(StepBounds& bounds) const override;
    double energy(const Body<T>&, State<T>& state) const override { return cells_.energy(state); }
    double dissipated(const Body<T>&, State<T>&) const override { return -put_in_; }
    void add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const override {
        cells_.add_forces(body, state, 1, force);
    }
    void add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                    std::vector<Stage>& stages) override;
    void body_was_cut(const Body<T>&, const Lattice& lattice, const NodeNumbers&,
                      std::span<const CutNode> nodes) override {
        cells_.cut(lattice, nodes);
    }
    std::vector<double> memory() const override { return {put_in_}; }
    std::size_t memory_size() const override { return 1; }
    void set_memory(std::span<const double> memory) override { put_in_ = memory[0]; }

private:
    ActuatedBody<T> cells_;
    double put_in_ = 0; ///< J
};

extern template class ActuatedBody<float>;
extern template class ActuatedBody<double>;
extern template class Actuation<float>;
extern template class Actuation<double>;

} // namespace hybmss
