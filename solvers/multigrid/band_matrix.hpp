#pragma once

#include <cstddef>
#include <vector>

namespace hybmss {

/// A symmetric, positive semidefinite matrix whose entries lie near the diagonal, and its Cholesky factors.
class BandMatrix {
public:
    /// `width`: the greatest distance of an entry from the diagonal.
    BandMatrix(std::size_t size, std::size_t width);

    void clear();
    /// Of row i, column j; j <= i <= j + width.
    double& at(std::size_t i, std::size_t j) { return entries_[i * (width_ + 1) + j + width_ - i]; }
    /// Replaces the matrix by its factors. A pivot below this part of its diagonal entry counts as that entry: what is
    /// singular is held there.
    void factor(double smallest_pivot);
    /// x = K^-1 x
    void solve(std::vector<double>& x) const;

    /// Multiplications that factor() takes.
    static double work(double size, double width) { return size * width * width / 2; }

private:
    std::size_t size_, width_;
    std::vector<double> entries_; ///< by rows, from the column `width` before the diagonal to it
};

} // namespace hybmss
