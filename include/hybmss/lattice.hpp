#pragma once

/// \file
/// A body of cubic cells of one grid. Boxes, voxel bodies, cuts and mixed materials are all arrays of cell scales.

#include "hybmss/export.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// How many springs of each kind.
struct SpringCounts {
    std::size_t edges = 0;
    std::size_t face_diagonals = 0;
    std::size_t cube_diagonals = 0;
    std::size_t total() const { return edges + face_diagonals + cube_diagonals; }
};

struct Material;

/// What the cells of a tissue have of their own, in place of the body's material.
struct Tissue {
    double poisson_ratio; ///< in (-1, 1/2)
    double density;       ///< kg/m^3, > 0
    bool operator==(const Tissue&) const = default;
};

/// nx * ny * nz cubic cells of one edge length, each with a stiffness scale (0 = no cell, 1 = the material as given)
/// and perhaps a tissue. The scale is that of the shear modulus, which the springs carry.
///
/// Index order everywhere: x fastest, then y, then z. Grid nodes are the (nx+1)(ny+1)(nz+1) corners; the body's nodes
/// are those of them that touch a cell, numbered in the same order. A box has all of them.
class HYBMSS_EXPORT Lattice {
public:
    /// Grid nodes that can be numbered.
    static constexpr double kMostNodes = 1e9;

    /// A full box. Throws std::invalid_argument unless all counts are >= 1 and cell_size is in [1e-9, 1e9] m.
    static Lattice box(int nx, int ny, int nz, double cell_size);

    /// Cells with the given scales (nx * ny * nz values, finite and >= 0).
    static Lattice from_cells(int nx, int ny, int nz, double cell_size, std::vector<float> scales);

    /// Cells of several materials, x fastest: label 0 is no cell, n is materials[n - 1]. The first is the body's, of
    /// which plans are to be made; the others may differ from it in Young's modulus, Poisson's ratio and density.
    /// `fills`: where given, the part of each cell that holds its material, of its stiffness and of its mass.
    /// Throws std::invalid_argument where one differs in anything else, or where a label has no material.
    static Lattice from_materials(int nx, int ny, int nz, double cell_size, std::span<const std::uint8_t> labels,
                                  std::span<const Material> materials, std::span<const float> fills = {});

    const std::array<int, 3>& cells() const { return cells_; }
    double cell_size() const { return cell_size_; }
    std::span<const float> cell_scales() const { return scales_; }
    std::size_t cell_index(int i, int j, int k) const;
    float cell_scale(int i, int j, int k) const { return scales_[cell_index(i, j, k)]; }
    void set_cell_scale(int i, int j, int k, float scale);
    /// Sets the scale of each listed cell to zero.
    void remove_cells(std::span<const std::array<int, 3>> cells);

    /// Gives each cell the number of its tissue: 0 is the body's material, n is tissues[n - 1]. Throws
    /// std::invalid_argument unless there are numbers for all cells, or none and no tissues, each with its tissue.
    void set_tissues(std::vector<Tissue> tissues, std::vector<std::uint8_t> of_cells);
    /// None where all cells are of the body's material.
    std::span<const Tissue> tissues() const { return tissues_; }
    std::size_t cell_tissue(std::size_t cell) const { return tissue_of_.empty() ? 0 : tissue_of_[cell]; }

    /// Gives each cell the part of a whole cell's mass that it has. Stiffness is the scale's alone: a cell that a
    /// surface cuts has both by its part that is inside. Throws std::invalid_argument unless there is one for every
    /// cell, finite and above 0 where the scale is, or none at all.
    void set_fills(std::vector<float> fills);
    /// Empty where all cells are whole.
    std::span<const float> fills() const { return fills_; }
    float cell_fill(std::size_t cell) const { return fills_.empty() ? 1.0f : fills_[cell]; }

    std::size_t grid_node_count() const;
    /// i + (nx+1) (j + (ny+1) k). That 0 <= i <= nx and so on is not checked.
    std::size_t grid_node_index(int i, int j, int k) const;
    /// The grid indices of the body's nodes, ascending: entry n is the grid index of node n. O(cells).
    std::vector<std::uint32_t> nodes() const;
    /// Rest position in m of a grid node; the grid's low corner is the origin. That it is below
    /// grid_node_count() is not checked.
    std::array<double, 3> rest_position(std::size_t grid_node) const;

    /// Cells with a scale above zero. O(cells), like the counts below.
    std::size_t cell_count() const;
    /// Springs after merging those that neighbouring cells share; face diagonals counted only where `face_diagonals`.
    SpringCounts merged_springs(bool face_diagonals = true) const;
    /// Springs as the paper's Table 6 counts them: edges merged, 12 face diagonals a cell.
    SpringCounts unmerged_springs(bool face_diagonals = true) const;

private:
    Lattice(std::array<int, 3> cells, double cell_size, std::vector<float> scales);

    std::array<int, 3> cells_;
    double cell_size_;
    std::vector<float> scales_;
    std::vector<Tissue> tissues_;
    std::vector<std::uint8_t> tissue_of_; ///< by cell; empty where there are no tissues
    std::vector<float> fills_;            ///< by cell; empty where all are whole
};

/// The material of a tissue's cells at the scale 1, by its number: `material` with the tissue's Poisson's ratio and
/// density, and the same shear modulus.
HYBMSS_EXPORT Material material_of(const Lattice& lattice, std::size_t tissue, const Material& material);

/// Whether some tissue's Poisson's ratio is not the material's: volume forces, if any, then do not go by the stiffness
/// scales.
HYBMSS_EXPORT bool has_own_volumes(const Lattice& lattice, const Material& material);

/// Throws std::invalid_argument for a material that is not valid, or not one of such a lattice: springs on means take
/// one Poisson's ratio.
HYBMSS_EXPORT void validate(const Lattice& lattice, const Material& material);

/// The springs of a lattice of this material: merged ones between nodes, or those that each cell has on its means.
HYBMSS_EXPORT SpringCounts springs_of(const Lattice& lattice, const Material& material);

} // namespace hybmss
