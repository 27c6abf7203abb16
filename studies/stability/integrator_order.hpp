#pragma once

/// \file
/// How the error of each time integrator falls with the step, and what it does to the energy.

#include <nlohmann/json_fwd.hpp>

#include <ostream>
#include <string>
#include <vector>

namespace hybmss::stability {

/// One integrator on the slowest free vibration of a small cube, whose motion is u cos(omega t) as long as it is small.
struct IntegratorStudy {
    std::string integrator;
    std::vector<int> steps_per_period;
    std::vector<double> errors; ///< greatest over two periods of |u - exact| over the amplitude
    /// log2 of the last error but one over the last: the order of convergence.
    double observed_order() const;

    double energy_time_step = 0;  ///< in periods
    std::vector<double> energies; ///< after each sample, over the start's
};

/// Every integrator there is, from 40 to 640 steps a period; the energy over 20 periods of 40 steps.
std::vector<IntegratorStudy> study_integrators();

void print_integrators(const std::vector<IntegratorStudy>& studies, std::ostream& out);
nlohmann::ordered_json integrators_json(const std::vector<IntegratorStudy>& studies);

} // namespace hybmss::stability
