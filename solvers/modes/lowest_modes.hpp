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

/// The least factors a > 0 with K x = -a K_g x over the free components, by LOBPCG for the pencil of K_g and K, whose
/// least eigenvalue is -1/a. K is that at `rest`, K_g half its change from `reversed` to `loaded` over `part`, the part
/// of the loading that is there; `set(part)` sets what of it second derivatives know. The preconditioner is K's.
template <class T>
BucklingResult buckling_loads(Potential<T>& potential, State<T>& rest, State<T>& reversed, State<T>& loaded,
                              double part, const std::function<void(double part)>& set,
                              Preconditioner<T>& preconditioner, const ModesOptions& options);

extern template BucklingResult buckling_loads(Potential<float>&, State<float>&, State<float>&, State<float>&, double,
                                              const std::function<void(double)>&, Preconditioner<float>&,
                                              const ModesOptions&);
extern template BucklingResult buckling_loads(Potential<double>&, State<double>&, State<double>&, State<double>&,
                                              double, const std::function<void(double)>&, Preconditioner<double>&,
                                              const ModesOptions&);
extern template ModesResult lowest_modes(Potential<float>&, State<float>&,
                                         const std::function<Preconditioner<float>&(bool)>&, const ModesOptions&);
extern template ModesResult lowest_modes(Potential<double>&, State<double>&,
                                         const std::function<Preconditioner<double>&(bool)>&, const ModesOptions&);

} // namespace hybmss
