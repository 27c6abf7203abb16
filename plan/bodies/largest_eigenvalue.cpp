#include "plan/bodies/largest_eigenvalue.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <cstdint>
#include <vector>

namespace hybmss {
namespace {

/// Different on every component, so that no eigenvector is left out by a symmetry of the body.
Eigen::VectorXd start_vector(Eigen::Index size) {
    Eigen::VectorXd v(size);
    std::uint64_t state = 1;
    for (double& component : v) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        component = static_cast<double>(state >> 11) * 0x1p-53 - 0.5;
    }
    return v.normalized();
}

/// Of the symmetric tridiagonal matrix.
double largest_of(const std::vector<double>& diagonal, const std::vector<double>& beside) {
    const auto size = static_cast<Eigen::Index>(diagonal.size());
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(Eigen::Map<const Eigen::VectorXd>(diagonal.data(), size),
                                  Eigen::Map<const Eigen::VectorXd>(beside.data(), size - 1), Eigen::EigenvaluesOnly);
    return solver.eigenvalues()[size - 1];
}

} // namespace

double largest_eigenvalue(std::size_t size,
                          const std::function<void(std::span<const double> in, std::span<double> out)>& multiply,
                          int most_products, double tolerance) {
    const auto rows = static_cast<Eigen::Index>(size);
    Eigen::VectorXd v = start_vector(rows), before = Eigen::VectorXd::Zero(rows), w(rows);
    std::vector<double> diagonal, beside;
    double found = 0, coupling = 0;
    constexpr int kBetweenChecks = 5;
    for (int product = 1; product <= most_products; ++product) {
        multiply({v.data(), size}, {w.data(), size});
        const double alpha = v.dot(w);
        w -= alpha * v + coupling * before;
        diagonal.push_back(alpha);
        coupling = w.norm();
        const bool exhausted = !(coupling > 1e-14 * std::abs(alpha)) || product == most_products;
        if (exhausted || product % kBetweenChecks == 0) {
            const double last = found;
            found = largest_of(diagonal, beside);
            if (exhausted || found - last <= tolerance * found) {
                break;
            }
        }
        beside.push_back(coupling);
        before.swap(v);
        v = w / coupling;
    }
    return std::max(found, 0.0);
}

} // namespace hybmss
