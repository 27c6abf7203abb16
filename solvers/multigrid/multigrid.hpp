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
    /// `ranks`: of which the body is a part, in boxes whose cells can be merged at least once; else null. Levels go
    /// down to where cells would lie across a cut.
    Multigrid(const Body<float>& body, const Lattice& lattice, const Material& material, const Ranks* ranks = nullptr);
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

    /// The cells of a level, x fastest, then y, then z.
    struct Cells {
        explicit Cells(CellGradients& of) : gradients(&of) {}
        CellGradients* gradients;
        std::vector<int> pattern;
        std::vector<float> scale;         ///< of those with a pattern, and kLanes more
        std::vector<std::uint8_t> tissue; ///< likewise
        /// Where `matrices` holds that of the cell, which another without a pattern is merged of; -1: nowhere.
        std::vector<std::int32_t> kept;
        std::vector<CellMatrix> matrices;
    };

    /// A node that touches an obstacle, in the cell of a coarse level: its block, between the cell's corners.
    struct Touch {
        int i, j;
        std::array<float, 8> weight;
        std::array<float, 9> block;
    };

    /// Runs of neighbouring nodes in the padded grid that are neighbours in the body's layout.
    struct Run {
        std::size_t grid, place, length;
    };

    /// Of a cell, over that of a whole one of the material.
    float mass_of(std::size_t cell) const {
        return stiffness_.density(tissues_[cell]) * (fills_.empty() ? 1.0f : fills_[cell]);
    }
    void find_runs();
    template <class Visit>
    void for_each_run(const Visit& visit) const;
    void gather(const NodeField<float>& from, GridVector& to) const;
    /// to += from on free components.
    void scatter_add(const GridVector& from, const NodeVector<float>& free, NodeVector<float>& to) const;
    /// What depends on the supports alone: the cells' patterns on all levels.
    void find_patterns(std::span<const std::uint8_t> held);
    /// C^T K C of a cell's rotations against each of the cells around it, at rest.
    void find_rest_rotations();
    void find_gradients(const Potential<float>& potential);
    void assemble(const Potential<float>& potential);
    /// Where nodes touch obstacles, on all coarse levels.
    void find_touches(const Potential<float>& potential);
    /// What CoarseLevel::assemble() asks for; level 1 is the first coarse one.
    template <class Add>
    void add_layer(std::size_t level, int k, const Potential<float>& potential, const Add& add);
    bool finest_matrix(int i, int j, int k, const Potential<float>& potential, CellMatrix& matrix) const;
    /// Of a cell without a pattern, from those that it is merged of.
    void merge(std::size_t level, int i, int j, int k, const Potential<float>& potential, CellMatrix& matrix) const;
    void find_rotations();
    void cycle(std::size_t level);

    /// The right side of the level l (levels_.size(): the direct one's) from what is left on the finer one.
    void restrict_to_level(const PaddedGrid& fine, const SharedGrid* shared, GridVector& rest, std::size_t l);

    const Body<float>* body_;
    const Workers* workers_;
    std::optional<SharedGrid> shared_; ///< of the finest level
    CellStiffness stiffness_;
    PaddedGrid grid_;
    double unit_;                        ///< the body's unit of length by the cell's edge
    std::vector<float> scales_;          ///< times unit_: matrices are by the body's unit
    std::vector<std::uint8_t> tissues_;  ///< by cell
    std::vector<float> fills_;           ///< by cell; none where all are whole
    std::vector<std::uint32_t> places_;  ///< of the body's nodes in the layout
    std::vector<std::uint32_t> node_at_; ///< the body's node of a padded grid node; kNoNode where there is none
    std::vector<float> touching_;        ///< cells at each of the body's nodes, by mass_of()
    std::vector<Run> runs_;
    CellPatterns patterns_;
    std::vector<std::uint8_t> held_; ///< by which they were found
    CellGradients gradients_;
    std::vector<Cells> cells_; ///< the finest first
    std::vector<std::vector<std::vector<Touch>>>
        touches_;                                     ///< by level and the cells' height; none where nothing touches
    std::vector<std::array<float, 6>> rest_rotation_; ///< stiffness of a cell's rotations by each of 27 cells at rest
    std::optional<CellRotations> rotations_;
    std::vector<std::unique_ptr<CoarseLevel>> levels_;
    std::unique_ptr<DirectLevel> direct_;
    BlockJacobi<float> blocks_{Curvature::convex};
    std::unique_ptr<FineLevel> fine_;
    GridVector grid_in_, grid_out_;
    const int most_terms_;
    const bool stiff_volume_;
    int degree_ = 0;
    double low_part_ = 1;
};

} // namespace hybmss
