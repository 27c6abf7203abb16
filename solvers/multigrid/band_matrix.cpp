#include "solvers/multigrid/band_matrix.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

double dot(const double* a, const double* b, std::size_t count) {
    const auto n = static_cast<Eigen::Index>(count);
    return Eigen::Map<const Eigen::VectorXd>(a, n).dot(Eigen::Map<const Eigen::VectorXd>(b, n));
}

} // namespace

BandMatrix::BandMatrix(std::size_t size, std::size_t width)
    : size_(size), width_(width), entries_(size * (width + 1)) {}

void BandMatrix::clear() {
    std::fill(entries_.begin(), entries_.end(), 0.0);
}

void BandMatrix::factor(double smallest_pivot) {
    for (std::size_t i = 0; i < size_; ++i) {
        const std::size_t first = i > width_ ? i - width_ : 0;
        double* const row = &at(i, first);
        for (std::size_t j = first; j < i; ++j) {
            const std::size_t from = std::max(first, j > width_ ? j - width_ : 0);
            const double sum = dot(row + (from - first), &at(j, from), j - from);
            row[j - first] = (row[j - first] - sum) * at(j, j);
        }
        const double diagonal = at(i, i), pivot = diagonal - dot(row, row, i - first);
        // The factor's diagonal is kept as its inverse.
        at(i, i) = 1 / std::sqrt(pivot > smallest_pivot * diagonal ? pivot : diagonal > 0 ? diagonal : 1);
    }
}

void BandMatrix::solve(std::vector<double>& x) const {
    const auto row = [&](std::size_t i, std::size_t first) {
        return entries_.data() + i * (width_ + 1) + first + width_ - i;
    };
    for (std::size_t i = 0; i < size_; ++i) {
        const std::size_t first = i > width_ ? i - width_ : 0;
        const double* const l = row(i, first);
        x[i] = (x[i] - dot(l, x.data() + first, i - first)) * l[i - first];
    }
    for (std::size_t i = size_; i-- > 0;) {
        const std::size_t first = i > width_ ? i - width_ : 0;
        const double* const l = row(i, first);
        x[i] *= l[i - first];
        for (std::size_t j = first; j < i; ++j) {
            x[j] -= l[j - first] * x[i];
        }
    }
}

} // namespace hybmss
