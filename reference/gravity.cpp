#include "reference/gravity.hpp"

namespace hybmss::reference {

// f = m g
std::vector<Vector3d> gravity_forces(const Body& body, const Vector3d& g) {
    std::vector<Vector3d> f;
    for (double m : body.mass) {
        f.push_back(m * g);
    }
    return f;
}

// W = -sum m g . u
double gravity_energy(const Body& body, std::span<const Vector3d> u, const Vector3d& g) {
    double sum = 0;
    for (std::size_t n = 0; n < body.mass.size(); ++n) {
        sum -= body.mass[n] * g.dot(u[n]);
    }
    return sum;
}

} // namespace hybmss::reference
