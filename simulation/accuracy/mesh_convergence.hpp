#pragma once

/// \file
/// Meshes of one body, coarse to fine, and how far results still are from their limit, told by those of two or three.

#include "hybmss/simulation/scene.hpp"
#include "hybmss/simulation/simulation.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// The smallest whole numbers in the ratio of a box's edges, each at most 1000; zeros where there are none.
std::array<std::int64_t, 3> whole_ratio(const std::array<double, 3>& size);

/// A box in `multiple` times so many cells, or a body of labels with each cell cut in `multiple`^3.
class MeshFamily {
public:
    /// Throws SceneError where no cubes fill a box of the given size.
    explicit MeshFamily(const Scene& scene);

    /// Whether the scene leaves the mesh free.
    bool is_free() const { return free_; }
    /// The scene's own mesh, where it has one.
    std::int64_t own_multiple() const { return own_; }
    /// The first with at least so many cells along the shortest edge.
    std::int64_t multiple_of(std::int64_t cells_across) const;
    std::array<std::int64_t, 3> cells(std::int64_t multiple) const;
    double cell_size(std::int64_t multiple) const { return unit_edge_ / static_cast<double>(multiple); }
    /// The body on that mesh; its labels too.
    SceneBody body(std::int64_t multiple) const;

private:
    SceneBody body_;
    std::array<std::int64_t, 3> unit_ = {1, 1, 1}; ///< cells at multiple 1
    double unit_edge_ = 1;                         ///< m
    std::int64_t own_ = 1;
    bool free_ = false;
};

/// One figure of a result, and the size that its errors are measured by: see AccuracyReport.
struct ResultFigure {
    std::string name;
    std::vector<double> values;
    double scale = 0;
    double whole = 0; ///< the problem's own size of it, >= scale
};
/// Of the whole, down to which a figure is measured by itself.
inline constexpr double kLeastShare = 0.01;
/// The figures of a simulation at rest. The same names for the same scene on any mesh.
std::vector<ResultFigure> result_figures(const Simulation& simulation, const Summary& summary);

/// The greatest relative difference of two results of one scene, by the second one's scales. `name`, where not null:
/// whose it is.
double greatest_difference(std::span<const ResultFigure> a, std::span<const ResultFigure> b,
                           std::string* name = nullptr);

/// One mesh's figures, and its cells along an edge.
struct MeshFigures {
    double cells = 0;
    std::vector<ResultFigure> figures;
};

struct ErrorEstimate {
    double error = 0; ///< relative, of the finest mesh
    double order = 0;
    std::string name;   ///< whose it is
    double cells = 0;   ///< that would bring all to the error that was asked for
    std::string finest; ///< which of them needs so many; "" where those of the last mesh do
};
/// Of the last of two or more meshes, coarse to fine: |q2 - q1| / (r^p - 1), r being the ratio of cells and p the order
/// that the last three meshes show, within [0.7, 2.2]; `assumed_order` where they show none, or are two. `wanted`: the
/// error for which `cells` is told. `noise`: the part of the whole that two solves of the same problem may differ by;
/// a figure that changes by no more does not count, for it shows nothing of the mesh.
ErrorEstimate estimate_error(std::span<const MeshFigures> meshes, double assumed_order, double wanted,
                             double noise = 0);

/// The exponent lambda with which the displacement leaves a clamped edge where a free surface meets it at a right
/// angle, u ~ r^lambda, the smallest root in (0, 1] of
///   (3 - 4 nu) sin^2(lambda pi / 2) = 4 (1 - nu)^2 - lambda^2
/// (Williams 1952, plane strain). Errors of functionals and of L2 fall with h^(2 lambda), of H1 with h^lambda, where no
/// other order is below.
double clamped_edge_exponent(double poisson_ratio);

} // namespace hybmss
