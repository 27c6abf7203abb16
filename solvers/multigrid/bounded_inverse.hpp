#pragma once

#include <Eigen/Dense>

#include <array>

namespace hybmss {

/// The inverse of a symmetric 3x3 block (xx, xy, xz, yy, yz, zz) on the axes that are not held (bit 0: x, 1: y, 2: z),
/// zero on the others. Eigenvalues count by their magnitude, at least `smallest` of the largest, so the inverse is
/// positive definite; a block of zeros has the inverse `of_zero` times one.
inline std::array<double, 6> bounded_inverse(const std::array<double, 6>& block, unsigned held, double smallest,
                                             double of_zero) {
    Eigen::Matrix3d matrix;
    matrix << block[0], block[1], block[2], block[1], block[3], block[4], block[2], block[4], block[5];
    const Eigen::Vector3d free(held & 1 ? 0 : 1, held & 2 ? 0 : 1, held & 4 ? 0 : 1);
    matrix = free.asDiagonal() * matrix * free.asDiagonal();
    if (held == 0) {
        // Most blocks are positive definite (Sylvester's criterion) and far from singular: the adjugate will do.
        const double determinant = matrix.determinant(), trace = matrix.trace();
        if (trace > 0 && determinant > 0.01 * trace * trace * trace / 27 && matrix(0, 0) > 0 &&
            matrix(0, 0) * matrix(1, 1) > matrix(0, 1) * matrix(0, 1)) {
            const Eigen::Matrix3d inverse = matrix.inverse();
            return {inverse(0, 0), inverse(0, 1), inverse(0, 2), inverse(1, 1), inverse(1, 2), inverse(2, 2)};
        }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
    const Eigen::Vector3d magnitudes = solver.eigenvalues().cwiseAbs();
    const double largest = magnitudes.maxCoeff();
    Eigen::Vector3d values = Eigen::Vector3d::Constant(of_zero);
    if (largest > 0) {
        values = magnitudes.cwiseMax(smallest * largest).cwiseInverse();
    }
    Eigen::Matrix3d inverse = solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
    inverse = free.asDiagonal() * inverse * free.asDiagonal();
    return {inverse(0, 0), inverse(0, 1), inverse(0, 2), inverse(1, 1), inverse(1, 2), inverse(2, 2)};
}

/// The same without what is nearly singular: directions below `smallest` of the largest eigenvalue get zero.
inline std::array<double, 6> bounded_pseudoinverse(const std::array<double, 6>& block, double smallest) {
    Eigen::Matrix3d matrix;
    matrix << block[0], block[1], block[2], block[1], block[3], block[4], block[2], block[4], block[5];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
    const double largest = solver.eigenvalues()[2];
    Eigen::Vector3d values = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
        if (largest > 0 && solver.eigenvalues()[i] > smallest * largest) {
            values[i] = 1 / solver.eigenvalues()[i];
        }
    }
    const Eigen::Matrix3d inverse = solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
    return {inverse(0, 0), inverse(0, 1), inverse(0, 2), inverse(1, 1), inverse(1, 2), inverse(2, 2)};
}

} // namespace hybmss
