#include "integrations/petsc/finite_elements.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace hybmss::distributed {
namespace {

/// A node of a rank's ghosted box, by corner of a cell: bit 0 the high side in x, bit 1 in y, bit 2 in z.
using CellNodes = std::array<PetscInt, 8>;

struct Elements {
    std::array<PetscInt, 3> cells{};
    double mu = 0, lambda = 0, weight = 0, tolerance = 0;
    std::array<std::array<Eigen::Vector3d, 8>, 8> slopes; ///< of a corner's shape function, by point and corner
    OwnedDm nodes;
    OwnedVec ghosted, ghosted_force;
    std::array<PetscInt, 3> low{}, size{}, ghost_low{}, ghost_size{};
    double largest_support = 0, plate_force = 0; ///< at the last residual
    double residual = 0;

    bool is_held(PetscInt j) const { return j == 0 || j == cells[1]; }
    PetscInt ghost_index(PetscInt i, PetscInt j, PetscInt k) const {
        return i - ghost_low[0] + ghost_size[0] * (j - ghost_low[1] + ghost_size[1] * (k - ghost_low[2]));
    }

    /// visit(nodes, held) for every cell whose low corner the rank owns; bit a of `held`: the corner a.
    template <class Visit>
    void for_each_cell(const Visit& visit) const {
        for (PetscInt k = low[2]; k < std::min(low[2] + size[2], cells[2]); ++k) {
            for (PetscInt j = low[1]; j < std::min(low[1] + size[1], cells[1]); ++j) {
                for (PetscInt i = low[0]; i < std::min(low[0] + size[0], cells[0]); ++i) {
                    CellNodes at;
                    unsigned held = 0;
                    for (unsigned a = 0; a < 8; ++a) {
                        const PetscInt y = j + static_cast<PetscInt>(a >> 1 & 1u);
                        at[a] = ghost_index(i + static_cast<PetscInt>(a & 1u), y, k + static_cast<PetscInt>(a >> 2));
                        held |= (is_held(y) ? 1u : 0u) << a;
                    }
                    visit(at, held);
                }
            }
        }
    }
};

Elements make_elements(MPI_Comm communicator, const std::array<PetscInt, 3>& cells, double h,
                       const Material& material) {
    Elements elements;
    elements.cells = cells;
    const double nu = material.poisson_ratio;
    elements.mu = material.young_modulus / (2 * (1 + nu));
    elements.lambda = material.young_modulus * nu / ((1 + nu) * (1 - 2 * nu));
    elements.weight = h * h * h / 8;
    const double place[2] = {(1 - 1 / std::sqrt(3.0)) / 2, (1 + 1 / std::sqrt(3.0)) / 2}; // in edges
    for (unsigned point = 0; point < 8; ++point) {
        for (unsigned a = 0; a < 8; ++a) {
            for (unsigned axis = 0; axis < 3; ++axis) {
                double slope = (a >> axis & 1u ? 1 : -1) / h;
                for (unsigned other = 0; other < 3; ++other) {
                    const double at = place[point >> other & 1u];
                    slope *= other == axis ? 1 : a >> other & 1u ? at : 1 - at;
                }
                elements.slopes[point][a][axis] = slope;
            }
        }
    }
    check(DMDACreate3d(communicator, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DMDA_STENCIL_BOX,
                       cells[0] + 1, cells[1] + 1, cells[2] + 1, PETSC_DECIDE, PETSC_DECIDE, PETSC_DECIDE, 3, 1,
                       nullptr, nullptr, nullptr, elements.nodes.make()));
    check(DMSetUp(elements.nodes));
    check(DMDASetUniformCoordinates(elements.nodes, 0, h * cells[0], 0, h * cells[1], 0, h * cells[2]));
    check(DMCreateLocalVector(elements.nodes, elements.ghosted.make()));
    check(DMCreateLocalVector(elements.nodes, elements.ghosted_force.make()));
    auto &low = elements.low, &size = elements.size, &ghost = elements.ghost_low, &ghosts = elements.ghost_size;
    check(DMDAGetCorners(elements.nodes, &low[0], &low[1], &low[2], &size[0], &size[1], &size[2]));
    check(DMDAGetGhostCorners(elements.nodes, &ghost[0], &ghost[1], &ghost[2], &ghosts[0], &ghosts[1], &ghosts[2]));
    return elements;
}

Eigen::Matrix3d deformation(const Elements& elements, unsigned point, const CellNodes& at, const PetscScalar* u) {
    Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
    for (unsigned a = 0; a < 8; ++a) {
        F += Eigen::Map<const Eigen::Vector3d>(u + 3 * at[a]) * elements.slopes[point][a].transpose();
    }
    return F;
}

/// Sums of dW/du over the points; false where a cell is inside out. With P = mu (F - F^-T) + lambda ln J F^-T.
bool add_forces(const Elements& elements, const PetscScalar* u, PetscScalar* force) {
    bool good = true;
    elements.for_each_cell([&](const CellNodes& at, unsigned) {
        for (unsigned point = 0; point < 8; ++point) {
            const Eigen::Matrix3d F = deformation(elements, point, at, u);
            const double J = F.determinant();
            if (!(J > 0)) {
                good = false;
                return;
            }
            const Eigen::Matrix3d inverse = F.inverse().transpose();
            const Eigen::Matrix3d stress = elements.mu * (F - inverse) + elements.lambda * std::log(J) * inverse;
            for (unsigned a = 0; a < 8; ++a) {
                Eigen::Map<Eigen::Vector3d>(force + 3 * at[a]) +=
                    elements.weight * (stress * elements.slopes[point][a]);
            }
        }
    });
    return good;
}

PetscErrorCode residual_callback(SNES snes, Vec displacement, Vec out, void* context) {
    return guarded([&] {
        Elements& elements = *static_cast<Elements*>(context);
        check(DMGlobalToLocal(elements.nodes, displacement, INSERT_VALUES, elements.ghosted));
        check(VecSet(elements.ghosted_force, 0));
        const PetscScalar* u = nullptr;
        PetscScalar* f = nullptr;
        check(VecGetArrayRead(elements.ghosted, &u));
        check(VecGetArray(elements.ghosted_force, &f));
        int good = add_forces(elements, u, f) ? 1 : 0, all_good = 0;
        check(VecRestoreArray(elements.ghosted_force, &f));
        check(VecRestoreArrayRead(elements.ghosted, &u));
        MPI_Comm communicator = MPI_COMM_NULL;
        check(PetscObjectGetComm(reinterpret_cast<PetscObject>(snes), &communicator));
        MPI_Allreduce(&good, &all_good, 1, MPI_INT, MPI_MIN, communicator);
        if (all_good == 0) {
            check(SNESSetFunctionDomainError(snes));
        }
        check(VecSet(out, 0));
        check(DMLocalToGlobal(elements.nodes, elements.ghosted_force, ADD_VALUES, out));
        check(VecGetArray(out, &f));
        double support = 0, plate = 0;
        std::size_t n = 0;
        for (PetscInt k = 0; k < elements.size[2]; ++k) {
            for (PetscInt j = elements.low[1]; j < elements.low[1] + elements.size[1]; ++j) {
                for (PetscInt i = 0; i < elements.size[0]; ++i, n += 3) {
                    if (!elements.is_held(j)) {
                        continue;
                    }
                    plate += j > 0 ? f[n + 1] : 0;
                    for (std::size_t c = 0; c < 3; ++c) {
                        support = std::max(support, std::abs(f[n + c]));
                        f[n + c] = 0;
                    }
                }
            }
        }
        check(VecRestoreArray(out, &f));
        MPI_Allreduce(&support, &elements.largest_support, 1, MPI_DOUBLE, MPI_MAX, communicator);
        MPI_Allreduce(&plate, &elements.plate_force, 1, MPI_DOUBLE, MPI_SUM, communicator);
    });
}

// With g_a = F^-T grad N_a: K_ab = mu (grad N_a . grad N_b) 1 + (mu - lambda ln J) g_b g_a^T + lambda g_a g_b^T.
PetscErrorCode matrix_callback(SNES, Vec displacement, Mat, Mat matrix, void* context) {
    return guarded([&] {
        Elements& elements = *static_cast<Elements*>(context);
        check(DMGlobalToLocal(elements.nodes, displacement, INSERT_VALUES, elements.ghosted));
        const PetscScalar* u = nullptr;
        check(VecGetArrayRead(elements.ghosted, &u));
        check(MatZeroEntries(matrix));
        const double mu = elements.mu, lambda = elements.lambda;
        elements.for_each_cell([&](const CellNodes& at, unsigned held) {
            Eigen::Matrix<double, 24, 24, Eigen::RowMajor> K = Eigen::Matrix<double, 24, 24, Eigen::RowMajor>::Zero();
            for (unsigned point = 0; point < 8; ++point) {
                const Eigen::Matrix3d F = deformation(elements, point, at, u);
                const Eigen::Matrix3d inverse = F.inverse().transpose();
                const double volume = lambda * std::log(F.determinant());
                std::array<Eigen::Vector3d, 8> g;
                for (unsigned a = 0; a < 8; ++a) {
                    g[a] = inverse * elements.slopes[point][a];
                }
                for (unsigned a = 0; a < 8; ++a) {
                    for (unsigned b = 0; b < 8; ++b) {
                        Eigen::Matrix3d block =
                            (mu - volume) * g[b] * g[a].transpose() + lambda * g[a] * g[b].transpose();
                        block.diagonal().array() += mu * elements.slopes[point][a].dot(elements.slopes[point][b]);
                        K.block<3, 3>(3 * a, 3 * b) += elements.weight * block;
                    }
                }
            }
            // Held nodes keep a diagonal of the others' size.
            const double size = K.trace() / 24;
            for (unsigned a = 0; a < 8; ++a) {
                if (held >> a & 1u) {
                    K.middleRows<3>(3 * a).setZero();
                    K.middleCols<3>(3 * a).setZero();
                    K.block<3, 3>(3 * a, 3 * a) = size * Eigen::Matrix3d::Identity();
                }
            }
            check(MatSetValuesBlockedLocal(matrix, 8, at.data(), 8, at.data(), K.data(), ADD_VALUES));
        });
        check(VecRestoreArrayRead(elements.ghosted, &u));
        check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
        check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
    });
}

PetscErrorCode convergence_callback(SNES snes, PetscInt, PetscReal, PetscReal, PetscReal norm,
                                    SNESConvergedReason* reason, void* context) {
    return guarded([&] {
        Elements& elements = *static_cast<Elements*>(context);
        Vec unbalanced = nullptr;
        double largest = 0;
        check(SNESGetFunction(snes, &unbalanced, nullptr, nullptr));
        check(VecNorm(unbalanced, NORM_INFINITY, &largest));
        elements.residual = largest / elements.largest_support;
        *reason = !std::isfinite(norm)                      ? SNES_DIVERGED_FNORM_NAN
                  : elements.residual <= elements.tolerance ? SNES_CONVERGED_FNORM_RELATIVE
                                                            : SNES_CONVERGED_ITERATING;
    });
}

} // namespace

FiniteElementSolution press_finite_elements(MPI_Comm communicator, const std::array<PetscInt, 3>& cells,
                                            double cell_size, const Material& material, double compression,
                                            double tolerance) {
    Elements elements = make_elements(communicator, cells, cell_size, material);
    elements.tolerance = tolerance;
    OwnedVec u, unbalanced;
    OwnedMat matrix;
    check(DMCreateGlobalVector(elements.nodes, u.make()));
    check(VecDuplicate(u, unbalanced.make()));
    check(DMSetMatType(elements.nodes, MATAIJ));
    check(DMCreateMatrix(elements.nodes, matrix.make()));
    check(MatSetOption(matrix, MAT_SYMMETRIC, PETSC_TRUE));
    Vec coordinates = nullptr;
    check(DMGetCoordinates(elements.nodes, &coordinates));
    MatNullSpace rigid = nullptr;
    check(MatNullSpaceCreateRigidBody(coordinates, &rigid));
    check(MatSetNearNullSpace(matrix, rigid));
    check(MatNullSpaceDestroy(&rigid));

    const PetscScalar* x = nullptr;
    PetscScalar* values = nullptr;
    PetscInt local = 0;
    check(VecGetLocalSize(u, &local));
    check(VecGetArrayRead(coordinates, &x));
    check(VecGetArray(u, &values));
    for (PetscInt i = 1; i < local; i += 3) {
        values[i] = -compression * x[i];
    }
    check(VecRestoreArray(u, &values));
    check(VecRestoreArrayRead(coordinates, &x));

    OwnedSnes snes;
    KSP ksp = nullptr;
    PC preconditioner = nullptr;
    check(SNESCreate(communicator, snes.make()));
    check(SNESSetFunction(snes, unbalanced, residual_callback, &elements));
    check(SNESSetJacobian(snes, matrix, matrix, matrix_callback, &elements));
    check(SNESSetConvergenceTest(snes, convergence_callback, &elements, nullptr));
    check(SNESKSPSetUseEW(snes, PETSC_TRUE));
    check(SNESGetKSP(snes, &ksp));
    check(KSPSetType(ksp, KSPGMRES)); // on the way the matrix is not always definite
    check(KSPGetPC(ksp, &preconditioner));
    check(PCSetType(preconditioner, PCGAMG));
    check(PCGAMGSetReuseInterpolation(preconditioner, PETSC_TRUE));
    check(SNESSetFromOptions(snes));
    check(SNESSolve(snes, nullptr, u));

    FiniteElementSolution solution;
    SNESConvergedReason reason{};
    PetscInt newton = 0, krylov = 0;
    check(SNESGetConvergedReason(snes, &reason));
    check(SNESGetIterationNumber(snes, &newton));
    check(SNESGetLinearSolveIterations(snes, &krylov));
    solution.converged = reason > 0;
    solution.reason = SNESConvergedReasons[reason];
    solution.newton_iterations = static_cast<int>(newton);
    solution.krylov_iterations = static_cast<int>(krylov);
    solution.residual = elements.residual;
    solution.plate_force = elements.plate_force;
    return solution;
}

} // namespace hybmss::distributed
