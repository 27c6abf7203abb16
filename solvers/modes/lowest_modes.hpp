#pragma once

#include "hybmss/equilibrium.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <functional>

namespace hybmss {

/// The lowest eigenvalues of K x = omega^2 M x over a potential's free components at a state, by LOBPCG (Knyazev, SIAM
/// J. Sci. Comput. 23, 2001). Motions of the whole body that cost nothing are taken out first; where there are any, the
/// potential has a pull that makes K definite when `choose` is asked for the preconditioner.
template <class T>
ModesResult lowest_modes(Potential<T>& potential, State<T>& state,
                         const std::function<Preconditioner<T>&(bool moves)>& choose, const ModesOptions& options);

extern template ModesResult lowest_modes(Potential<float>&, State<float>&,
                                         const std::function<Preconditioner<float>&(bool)>&, const ModesOptions&);
extern template ModesResult lowest_modes(Potential<double>&, State<double>&,
                                         const std::function<Preconditioner<double>&(bool)>&, const ModesOptions&);

} // namespace hybmss
