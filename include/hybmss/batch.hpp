#pragma once

/// \file
/// Many bodies stepped side by side.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/export.h"

#include <memory>
#include <span>

namespace hybmss {

/// Steps bodies each by one thread, several bodies at a time. T is float or double.
///
/// For many small bodies: one of 10^3 cells is too short a piece of work to share among threads, many such are not.
/// Every body goes through exactly what its own step() does, to the bit, whatever the threads; the threads that its
/// plan chose do not matter here. Steps of one call run through body by body, so that a body stays in the caches of its
/// core: prefer one call of many steps. Not for concurrent use of one object.
///
///     std::vector<ExplicitDynamics<float>> bodies = ...;
///     Batch<float> batch;
///     batch.step(bodies, parameters, 100);
template <class T>
class HYBMSS_EXPORT Batch {
public:
    /// `threads`: at most, >= 0; 0 for all of the machine. Throws std::invalid_argument where it is negative.
    explicit Batch(int threads = 0);
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

private:
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

extern template class Batch<float>;
extern template class Batch<double>;

} // namespace hybmss
