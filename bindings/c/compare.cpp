#include "hybmss/record.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

namespace hybmss {
namespace {

const RecordedState& state_of(const Record& record, std::size_t state) {
    if (state >= record.states.size()) {
        throw std::invalid_argument("state " + std::to_string(state) + ": the record has " +
                                    std::to_string(record.states.size()) + " states");
    }
    return record.states[state];
}

template <class T>
double tolerance(const Record& record) {
    return std::is_same_v<T, float> ? record.float_tolerance : record.double_tolerance;
}

/// Infinite where a number is not finite: it must not pass.
double relative(double difference, double scale) {
    const double error = std::abs(difference) / scale;
    return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

} // namespace

template <class T>
RecordDifference compare_forces(const Record& record, std::size_t state, VectorField<const T> forces) {
    const RecordedState& recorded = state_of(record, state);
    if (forces.size != recorded.forces.size()) {
        throw std::invalid_argument("forces of " + std::to_string(forces.size) + " nodes given: the record has " +
                                    std::to_string(recorded.forces.size()));
    }
    RecordDifference difference{0, tolerance<T>(record), 0};
    const T* const components[3] = {forces.x, forces.y, forces.z};
    for (std::size_t n = 0; n < forces.size; ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            const T value = components[c][static_cast<std::ptrdiff_t>(n) * forces.stride];
            const double error = relative(static_cast<double>(value) - recorded.forces[n][c], recorded.force_scale);
            if (error > difference.error) {
                difference.error = error;
                difference.node = n;
            }
        }
    }
    return difference;
}

template <class T>
RecordDifference compare_energy(const Record& record, std::size_t state, const PotentialEnergy& energy) {
    const PotentialEnergy& recorded = state_of(record, state).energy;
    // The volume energy is negative where kappa is.
    const double scale = std::abs(recorded.springs) + std::abs(recorded.volume);
    const double springs = energy.springs - recorded.springs, volume = energy.volume - recorded.volume;
    if (scale == 0) {
        return {springs == 0 && volume == 0 ? 0 : std::numeric_limits<double>::infinity(), tolerance<T>(record), 0};
    }
    return {std::max(relative(springs, scale), relative(volume, scale)), tolerance<T>(record), 0};
}

template RecordDifference compare_forces(const Record&, std::size_t, VectorField<const float>);
template RecordDifference compare_forces(const Record&, std::size_t, VectorField<const double>);
template RecordDifference compare_energy<float>(const Record&, std::size_t, const PotentialEnergy&);
template RecordDifference compare_energy<double>(const Record&, std::size_t, const PotentialEnergy&);

} // namespace hybmss
