#pragma once

/// \file
/// Many bodies stepped side by side.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/export.h"

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace hybmss {

/// How a batch steps its bodies.
enum class BatchLayout {
    automatic,  ///< small bodies that are alike side by side, where there are enough of them; all others one by one
    one_by_one, ///< each by itself, as its own step() does
    /// In each lane of a vector one of the bodies that are alike: lattices in flat-rows with the same cells and
    /// material, made with the same options, with springs between nodes, without effects, stiffening, crush resistance
    /// and tissues' own volumes, stepped with the same parameters. All others one by one.
    side_by_side
};

/// Of the last call of step().
struct BatchDescription {
    std::size_t bodies = 0;
    std::size_t side_by_side = 0; ///< of these
    std::size_t vectors = 0;      ///< that they are the lanes of
};

/// "1003 bodies: 1000 side by side in 125 vectors, 3 one by one"
HYBMSS_EXPORT std::string to_string(const BatchDescription& description);

/// Steps bodies each by one thread, several bodies at a time. T is float or double.
///
/// For many small bodies: one of 10^3 cells is too short a piece of work to share among threads, many such are not.
/// Every body goes through exactly what its own step() does, to the bit, whatever the threads and the layout; the
/// threads that its plan chose do not matter here. Steps of one call run through body by body, or vector by vector, so
/// that bodies stay in the caches of their core: prefer one call of many steps. Not for concurrent use of one object.
///
/// Bodies that are stepped side by side have their state among each other's until somebody calls one of their own
/// functions: it is then brought back, and put there again by the next call here. So is each body that the next call
/// does not name in the same place. The bodies may outlive the batch.
///
///     std::vector<ExplicitDynamics<float>> bodies = ...;
///     Batch<float> batch;
///     batch.step(bodies, parameters, 100);
template <class T>
class HYBMSS_EXPORT Batch {
public:
    /// `threads`: at most, >= 0; 0 for all of the machine. Throws std::invalid_argument where it is negative.
    explicit Batch(int threads = 0, BatchLayout layout = BatchLayout::automatic);
    Batch(Batch&&) noexcept;
    Batch& operator=(Batch&&) noexcept;
    ~Batch();

    /// Threads that work at the same time, the caller's included.
    int threads() const;

    /// Takes `count` steps of every body, all with the same parameters. Throws what ExplicitDynamics::step throws for
    /// them, before any body has moved.
    void step(std::span<ExplicitDynamics<T>> bodies, const StepParameters& parameters, long count = 1);

    /// Takes `count` steps of every body; parameters[i] are those of *bodies[i]. The bodies stay the caller's. Throws
    /// std::invalid_argument, before any body has moved: as above, and where the sizes differ, a pointer is null or a
    /// body is named twice.
    void step(std::span<ExplicitDynamics<T>* const> bodies, std::span<const StepParameters> parameters, long count = 1);

    BatchDescription describe() const;

private:
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

extern template class Batch<float>;
extern template class Batch<double>;

} // namespace hybmss
