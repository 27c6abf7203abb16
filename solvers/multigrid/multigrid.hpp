#pragma once

#include "solvers/multigrid/coarse_level.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <memory>
#include <optional>
#include <vector>

namespace hybmss {

/// Geometric multigrid for a lattice: one V-cycle.
///
/// Cells are merged two by two along every axis, any sizes, masks and supports. A merged cell's matrix is the sum of
/// its cells', brought over by trilinear interpolation that is restricted to the free components (Galerkin), level
/// after level down to a few cells that are solved directly. The finest level has no matrix: it is smoothed through the
/// body's own Hessian product. Smoothers are Chebyshev polynomials over the nodes' blocks and, where the volume is
/// stiff, the cells' rotations.
///
/// Matrices are made positive semidefinite cell by cell and the direct solve is shifted, so the cycle is positive
/// definite whatever the body's second derivatives are. All is float: it only preconditions.
class Multigrid final : public Preconditioner<float> {
public:
    Multigrid(const Body<float>& body, const Lattice& lattice, const Material& material);
    ~Multigrid() override;

    void update(const Potential<float>& potential) override;
    void apply(const NodeVector<float>& r, NodeVector<float>& z) override;
    std::string_view name() const override { return "multigrid"; }

    /// Where the estimate of the finest spectrum ended, which the next one starts from: three values a node in the
    /// body's order; none before the first.
    std::vector<float> memory() const;
    void set_memory(const VectorSpace<float>& space, std::span<const float> values);

private:
    static constexpr std::uint32_t kNoNode = ~std::uint32_t{0};
    struct FineLevel; ///< the finest level as chebyshev() sees it
    struct Node {
        std::size_t grid;      ///< in the padded grid
        std::size_t places[3]; ///< of its components: flat in the array of the component
    };

    /// C^T K C of a cell's rotations against each of the cells around it, at rest.
    void find_rest_rotations();
    void merge_finest(const Potential<float>& potential);
    void merge(std::span<const CellMatrix> fine_cells, const PaddedGrid& fine, const PaddedGrid& coarse);
    void find_rotations(const Potential<float>& potential);
    void cycle(std::size_t level);

    const Body<float>* body_;
    const Workers* workers_;
    CellStiffness stiffness_;
    PaddedGrid grid_;
    double unit_;                        ///< the body's unit of length by the cell's edge
    std::vector<float> scales_;          ///< times unit_: matrices are by the body's unit
    std::vector<std::uint32_t> places_;  ///< of the body's nodes in the layout
    std::vector<std::uint32_t> node_at_; ///< the body's node of a padded grid node; kNoNode where there is none
    std::vector<float> touching_;        ///< cells at each of the body's nodes
    std::vector<CellMatrix> merged_, merged_next_;
    std::vector<CellShape> shapes_;                   ///< of the finest cells, for the rotations
    std::vector<std::array<float, 9>> rest_rotation_; ///< stiffness of a cell's rotations by each of 27 cells at rest
    std::optional<CellRotations> rotations_;
    std::vector<std::unique_ptr<CoarseLevel>> levels_;
    std::unique_ptr<DirectLevel> direct_;
    BlockJacobi<float> blocks_;
    std::unique_ptr<FineLevel> fine_;
    GridVector grid_in_, grid_out_;
    int degree_;
    double low_part_;
};

} // namespace hybmss
