#pragma once

#include <cstddef>
#include <functional>
#include <span>

namespace hybmss {

/// The largest eigenvalue of a symmetric positive semidefinite operator of `size` rows, by Lanczos' method from a fixed
/// start: approached from below, usually to a thousandth after some thirty products. Stops where it has settled to
/// `tolerance`, relative. 0 where there is none above rounding.
double largest_eigenvalue(std::size_t size,
                          const std::function<void(std::span<const double> in, std::span<double> out)>& multiply,
                          int most_products = 200, double tolerance = 1e-5);

} // namespace hybmss
