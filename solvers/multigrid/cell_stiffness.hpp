#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "kernels/grid_arguments.hpp"
#include "solvers/multigrid/lanes.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hybmss {

/// A symmetric matrix over the 24 displacement components of a cell: entry (i, j) of the 3x3 block of the corners a, b
/// is block[a][b][3 i + j].
template <class S>
struct CellMatrixOf {
    S block[8][8][9];
};
using CellMatrix = CellMatrixOf<float>;

/// The springs of a cell lie along 13 directions, each an edge, or a diagonal of faces or of the cube.
inline constexpr std::size_t kSpringDirections = kernels::kSpringDirections;
/// That of the spring between two corners, either way round.
std::size_t spring_direction(std::size_t a, std::size_t b);
/// Its components, each -1, 0 or 1.
std::array<float, 3> spring_signs(std::size_t direction);

/// Second derivatives of cells that deform homogeneously.
struct CellTangents {
    Lanes spring[kSpringDirections][6]; ///< the block of a cell's spring: xx, xy, xz, yy, yz, zz
    Lanes area[9];          ///< dV'/da, dV'/db, dV'/dc: b x c, c x a, a x b, of the cell with edges of length 1
    Lanes volume_stiffness; ///< c in the volume's part c g g^T of the matrix, g = dV'/dx; may be below 0
    bool has_volume;        ///< whether that is not zero in all lanes
    // Of cells with springs on means, what holds their patterns (PatternConstants): by that of the moving and of the
    // other corner, 3x3 blocks by rows, and what g_4 adds to all three axes.
    bool has_patterns;
    Lanes patterns[3][3][9];
    Lanes fourth;
};

/// Second derivatives of the energy of single lattice cells with their shares of the springs, made positive
/// semidefinite: springs under compression without their negative part, cells without what is not convex in the volume.
///
/// Lengths are in units of the cell's edge and stiffnesses in N, those of a cell of scale 1.
class CellStiffness {
public:
    CellStiffness(const Lattice& lattice, const Material& material);

    // `tissue`: the number of a cell's, or of kLanes cells.
    /// At the displacements of the corners, in units of the edge. S is float or double.
    template <class S>
    void evaluate(const double (&displacement)[8][3], double scale, std::size_t tissue, CellMatrixOf<S>& matrix) const;
    /// At deformation gradients, by rows.
    void evaluate(const Lanes (&gradient)[9], const Lanes& scale, const std::uint8_t* tissue,
                  CellTangents& tangents) const;
    /// Of those the volume's stiffness, whatever else there is, and the area vectors.
    Lanes evaluate_volume(const Lanes (&gradient)[9], const Lanes& scale, const std::uint8_t* tissue,
                          Lanes (&area)[9]) const;
    bool on_means() const { return means_; }
    /// Of a tissue, over the material's.
    float density(std::size_t tissue) const { return volumes_[tissue].density; }
    /// The springs' part at rest.
    void springs_at_rest(CellMatrix& matrix) const;

private:
    template <class S>
    void set_springs(const double (&displacement)[8][3], double scale, CellMatrixOf<S>& matrix) const;
    void evaluate_patterns(const Lanes (&gradient)[9], const Lanes& scale, CellTangents& tangents) const;
    template <class S>
    void add_mean_springs(const double (&displacement)[8][3], double scale, CellMatrixOf<S>& matrix) const;

    double share_[4];    ///< k h of a cell's share of a spring, by the number of axes along which its ends differ
    bool means_;         ///< springs on the cell's means:
    double on_means_[4]; ///< k h, likewise
    PatternConstants patterns_; ///< by h
    double crush_;              ///< crush_modulus() h^2
    double crush_ratio_;        ///< J0
    struct Volume {
        double kappa; ///< times h^2
        VolumeEnergy energy;
        float density; ///< over the material's
    };
    std::vector<Volume> volumes_; ///< by tissue
};

/// matrix = P^T matrix P along one axis, for the half of a merged cell on the low or the high side: the corners of the
/// half are interpolated linearly between the corners of the whole.
///
///     low half:   fine 0 = coarse 0,  fine 1 = (coarse 0 + coarse 1) / 2
///     high half:  fine 0 = (coarse 0 + coarse 1) / 2,  fine 1 = coarse 1
void spread_half(CellMatrix& matrix, unsigned axis, bool high);

/// sum += term
void add(const CellMatrix& term, CellMatrix& sum);

} // namespace hybmss
