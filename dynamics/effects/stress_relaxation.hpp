#pragma once

#include "dynamics/step.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace hybmss {

/// What a lattice's cells remember, by a Prony series. With the mean displacement gradient H of a cell, of the means of
/// its parallel edges, and a strain h of each branch's own,
///
///     E = 1/2 (H + H^T + H^T H),   dh/dt = dE/dt - h / tau,   S = sum of part (lambda tr h I + 2 G h),
///     P = (I + H) S,   force on a corner = -h0^2 / 4 (+-P_x +-P_y +-P_z)
///
/// G and lambda being those of the whole cell, its volume energy too, and h0 its edge. For strains that change steadily
/// through a time x tau, h <- e^-x h + (1 - e^-x)/x (E - E before) is exact (Taylor, Pister and Goudreau 1970), and so
/// is what the branch takes out meanwhile, part V0 / tau times the integral of lambda (tr h)^2 + 2 G h:h.
///
/// Cells find their stress at the beginning of a step, nodes gather it in the order of the cells: the same for any
/// number of threads. In double whatever T is: what a step changes is small beside what there is.
template <class T>
class StressRelaxation final : public StepEffect<T> {
public:
    /// Throws as ExplicitDynamics::relax() does.
    StressRelaxation(const Body<T>& body, State<T>& state, const Lattice& lattice, const Material& material,
                     std::span<const Relaxation> branches);

    std::string_view name() const override { return "relaxation"; }
    std::size_t bytes() const override;
    void narrow(StepBounds& bounds) const override;
    double energy(const Body<T>& body, State<T>& state) const override;
    double dissipated(const Body<T>& body, State<T>& state) const override;
    void add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const override;
    void add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                    std::vector<Stage>& stages) override;
    void add_last_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                         std::vector<Stage>& stages) override;
    void body_was_cut(const Body<T>& body, const Lattice& lattice, const NodeNumbers& numbers,
                      std::span<const CutNode> nodes) override;
    std::vector<double> memory() const override;
    std::size_t memory_size() const override { return 1 + strains_.size() * 6 + dissipated_.size(); }
    void set_memory(std::span<const double> memory) override;

private:
    using Strain = std::array<double, 6>;     ///< xx, yy, zz, xy, yz, xz
    using Gradient = std::array<double, 9>;   ///< H, or P, row by row
    static constexpr std::size_t kPiece = 64; ///< cells, or nodes

    struct Cell {
        std::array<std::uint32_t, 8> corners; ///< places in the body's fields
        std::uint32_t grid;                   ///< index of the cell in the grid
        double shear, lame;                   ///< G and lambda times V0, J; 0 where it has been cut away
    };
    /// What the time since the last state makes of a branch.
    struct Course {
        double left, gained;  ///< of the strain that there was, and of what is new
        double dissipated[3]; ///< of the old strain's square, of its product with the new one, of that one's square
    };
    using Components = std::array<Component<const T>, 3>;
    static Components components(const NodeField<T>& field);
    static std::size_t pieces(std::size_t count) { return (count + kPiece - 1) / kPiece; }
    std::vector<Course> courses() const;
    Gradient gradient(const Cell& cell, const Components& displacement) const;
    static Strain strain(const Gradient& h);
    static double product(const Cell& cell, const Strain& a, const Strain& b);
    /// The strains of a cell now, E and one of each branch.
    std::span<Strain> strains(std::size_t cell) {
        return std::span(strains_).subspan(cell * (1 + branches_.size()), 1 + branches_.size());
    }
    std::span<const Strain> strains(std::size_t cell) const {
        return std::span(strains_).subspan(cell * (1 + branches_.size()), 1 + branches_.size());
    }
    /// Takes a cell's strains on to a state. Returns what that has taken out, J.
    double advance(const Cell& cell, std::span<const Course> courses, const Strain& now,
                   std::span<Strain> strains) const;
    Gradient stress(const Cell& cell, const Gradient& h, std::span<const Strain> strains) const;
    std::array<double, 3> gathered(std::size_t node, std::span<const Gradient> stresses) const;
    /// visit(cell, its number, its strains at the state, what has been taken out on the way there, H) for all cells.
    template <class Visit>
    void for_each_cell(const State<T>& state, const Visit& visit) const;

    double by_edge_;    ///< the unit of length over the edge of a cell
    double per_length_; ///< 1 / (4 h0): stresses are by V0
    std::vector<Relaxation> branches_;
    std::vector<Cell> cells_;
    std::vector<std::size_t> places_;      ///< of the nodes in the body's fields
    std::vector<std::uint32_t> first_use_; ///< of a node in uses_, one more than nodes
    std::vector<std::uint32_t> uses_;      ///< 8 times the cell plus the corner
    std::vector<Strain> strains_;
    std::vector<Gradient> stresses_; ///< V0 P of the step at hand
    std::vector<double> dissipated_; ///< J, one a piece of cells
    double elapsed_ = 0;             ///< s since the state that strains_ are of
};

extern template class StressRelaxation<float>;
extern template class StressRelaxation<double>;

} // namespace hybmss
