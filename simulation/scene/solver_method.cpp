#include "hybmss/simulation/scene.hpp"

namespace hybmss {

std::string_view name(SolverMethod method) {
    switch (method) {
    case SolverMethod::symplectic_euler:
        return "symplectic-euler";
    case SolverMethod::backward_euler:
        return "backward-euler";
    case SolverMethod::static_equilibrium:
        return "static";
    }
    return "unknown";
}

} // namespace hybmss
