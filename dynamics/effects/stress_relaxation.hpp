#pragma once

#include "dynamics/step.hpp"

#include <algorithm>
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
/// Cells find their stress at the beginning of a step, nodes gather it: the same for any number of threads
/// (kernels/relaxation_kernels.cpp). In float strains keep what they have been rounded by, since what a step changes is
/// small beside what there is; Green's strain needs none of it, as its changes add up to what it is.
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
    std::size_t memory_size() const override { return 1 + strains_.size() + dissipated_.size(); }
    void set_memory(std::span<const double> memory) override;

private:
    using Courses = std::array<kernels::RelaxationCourse<T>, kernels::kMaxRelaxations>;
    static constexpr std::size_t kWidth = kernels::kMaxWidth;
    static constexpr std::size_t kMargin = 2 * kWidth; ///< of an array over the slots, at both ends
    static constexpr std::size_t kPiece = 16 * kWidth; ///< slots
    static constexpr std::int32_t kNowhere = INT32_MIN;

    /// Where three rows beside each block lie.
    struct Rows {
        std::vector<kernels::SlotRow> rows;
        std::vector<std::int32_t> lanes;
        /// The block's next row, by its slots' places; those that are kNowhere do with any place that serves, as
        /// `elsewhere` does.
        template <class Serves>
        void add(std::span<const std::int32_t> places, std::int32_t elsewhere, const Serves& serves);
    };

    std::size_t pieces() const { return (nodes_ + kPiece - 1) / kPiece; }
    /// From which on to which, of a piece.
    std::array<kernels::Range, 2> blocks(std::size_t piece) const {
        constexpr std::size_t kBlocks = kPiece / kWidth;
        return {static_cast<kernels::Range>(piece * kBlocks),
                static_cast<kernels::Range>(std::min((piece + 1) * kBlocks, blocks_))};
    }
    template <class Visit>
    void for_runs(std::size_t piece, const Visit& visit) const {
        for (std::size_t run = first_run_[piece]; run < first_run_[piece + 1]; ++run) {
            visit(runs_[run]);
        }
    }
    T* slots(std::size_t array) const { return slots_.data() + array * length_ + kMargin; }
    /// Numbers that each slot has.
    std::size_t lines() const { return 6 + branches_.size() * kernels::kRelaxationLines<T>; }
    void find_rows(std::span<const std::array<std::uint32_t, 8>> corners);
    /// What the time since the last state makes of the branches.
    Courses courses() const;
    /// What the nodes of a piece have moved by, and all.
    void read(const State<T>& state, std::size_t piece) const;
    void read_all(const State<T>& state) const {
        for (std::size_t piece = 0; piece < pieces(); ++piece) {
            read(state, piece);
        }
    }
    /// field += factor times the nodes' forces, times their weights where there are any.
    void add(const std::array<Component<T>, 3>& field, double factor, const T* weight, std::size_t piece) const;
    kernels::RelaxingCells<T> cells(const Courses& courses, T* strains) const;
    kernels::RelaxingNodes<T> nodes() const;
    /// Strains at a state, and what corners feel in scratch; adds to `taken` what has been taken out on the way there,
    /// J.
    std::vector<T> strains_at(const State<T>& state, double& taken) const;

    const kernels::KernelTable<T>* table_;
    T quarter_by_edge_ = 0;
    double unit_ = 0;   ///< J: G V0, by which energies of strains are
    double newton_ = 0; ///< and forces of nodes
    std::vector<Relaxation> branches_;
    std::size_t nodes_;
    std::vector<NodeRun> runs_;          ///< neighbours in the body's fields too, none in two pieces
    std::vector<std::size_t> first_run_; ///< of each piece, one more than pieces
    std::size_t blocks_ = 0;             ///< of slots
    std::size_t length_ = 0;             ///< of an array over them
    Rows further_, before_;              ///< of the corners of cells, of the cells around nodes
    std::vector<T> strains_;
    std::vector<double> dissipated_; ///< J, one a piece
    double elapsed_ = 0;             ///< s since the state that strains_ are of
    Courses course_{};               ///< of the step at hand
    /// Arrays over the slots: scratch, but for the moduli, which are by G.
    mutable std::vector<T> slots_;
    static constexpr std::size_t kDisplacement = 0, kForce = 3, kPull = 6, kShear = 18, kLame = 19, kArrays = 20;
};

extern template class StressRelaxation<float>;
extern template class StressRelaxation<double>;

} // namespace hybmss
