#include "integrations/petsc/equilibrium.hpp"

#include <Eigen/Dense>

namespace hybmss::distributed {
namespace {

struct Problem {
    BlockForces& forces;
    std::array<double, 3> gravity;
    std::vector<HeldComponent> held;
    OwnedVec scratch;
    std::vector<Eigen::Matrix3d> inverse_blocks; ///< of the owned nodes
};

/// F(u) = -(f + m g) at free components, u - u_held at held ones; at nodes without a cell u itself.
void residual(Problem& problem, Vec displacement, Vec out) {
    problem.forces.set_displacement(displacement);
    problem.forces.get_forces(out);
    const PetscScalar *m = nullptr, *u = nullptr;
    PetscScalar* r = nullptr;
    PetscInt size = 0;
    check(VecGetLocalSize(out, &size));
    check(VecGetArrayRead(problem.forces.masses(), &m));
    check(VecGetArrayRead(displacement, &u));
    check(VecGetArray(out, &r));
    for (PetscInt i = 0; i < size; ++i) {
        r[i] = m[i] > 0 ? -r[i] - m[i] * problem.gravity[static_cast<std::size_t>(i % 3)] : u[i];
    }
    for (const HeldComponent& component : problem.held) {
        r[component.index] = u[component.index] - component.displacement;
    }
    check(VecRestoreArray(out, &r));
    check(VecRestoreArrayRead(displacement, &u));
    check(VecRestoreArrayRead(problem.forces.masses(), &m));
}

/// y = K p between free components, y = p at held ones and where no cell is: symmetric as K is.
void product(Problem& problem, Vec direction, Vec out) {
    check(VecCopy(direction, problem.scratch));
    clear_held(problem.scratch, problem.held);
    problem.forces.get_hessian_product(problem.scratch, out);
    const PetscScalar *m = nullptr, *p = nullptr;
    PetscScalar* y = nullptr;
    PetscInt size = 0;
    check(VecGetLocalSize(out, &size));
    check(VecGetArrayRead(problem.forces.masses(), &m));
    check(VecGetArrayRead(direction, &p));
    check(VecGetArray(out, &y));
    for (PetscInt i = 0; i < size; ++i) {
        if (!(m[i] > 0)) {
            y[i] = p[i];
        }
    }
    for (const HeldComponent& component : problem.held) {
        y[component.index] = p[component.index];
    }
    check(VecRestoreArray(out, &y));
    check(VecRestoreArrayRead(direction, &p));
    check(VecRestoreArrayRead(problem.forces.masses(), &m));
}

/// The matrix is the forces at the latest displacement: only the preconditioner's blocks are made anew.
void set_matrix(Problem& problem, Vec displacement, Mat matrix) {
    problem.forces.set_displacement(displacement);
    const std::vector<double> blocks = problem.forces.hessian_diagonal();
    const std::size_t nodes = blocks.size() / 6;
    problem.inverse_blocks.resize(nodes);
    std::vector<bool> held(3 * nodes);
    for (const HeldComponent& component : problem.held) {
        held[component.index] = true;
    }
    for (std::size_t n = 0; n < nodes; ++n) {
        const double* b = &blocks[6 * n];
        Eigen::Matrix3d block;
        block << b[0], b[3], b[4], b[3], b[1], b[5], b[4], b[5], b[2];
        // Conjugate gradients need a positive definite preconditioner, which a compressed node's block may not be.
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> parts(block);
        const double greatest = parts.eigenvalues().cwiseAbs().maxCoeff();
        const Eigen::Vector3d least = Eigen::Vector3d::Constant(greatest > 0 ? 1e-3 * greatest : 1);
        const Eigen::Vector3d values = parts.eigenvalues().cwiseAbs().cwiseMax(least);
        problem.inverse_blocks[n] =
            parts.eigenvectors() * values.cwiseInverse().asDiagonal() * parts.eigenvectors().transpose();
        if (held[3 * n] || !(greatest > 0)) {
            problem.inverse_blocks[n].setIdentity();
        }
    }
    check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
}

void precondition(const Problem& problem, Vec in, Vec out) {
    const PetscScalar* r = nullptr;
    PetscScalar* z = nullptr;
    check(VecGetArrayRead(in, &r));
    check(VecGetArray(out, &z));
    for (std::size_t n = 0; n < problem.inverse_blocks.size(); ++n) {
        Eigen::Map<Eigen::Vector3d>(z + 3 * n) =
            problem.inverse_blocks[n] * Eigen::Map<const Eigen::Vector3d>(r + 3 * n);
    }
    check(VecRestoreArray(out, &z));
    check(VecRestoreArrayRead(in, &r));
}

PetscErrorCode residual_callback(SNES, Vec displacement, Vec out, void* problem) {
    return guarded([&] { residual(*static_cast<Problem*>(problem), displacement, out); });
}
PetscErrorCode product_callback(Mat matrix, Vec direction, Vec out) {
    return guarded([&] {
        Problem* problem = nullptr;
        check(MatShellGetContext(matrix, &problem));
        product(*problem, direction, out);
    });
}
PetscErrorCode matrix_callback(SNES, Vec displacement, Mat matrix, Mat, void* problem) {
    return guarded([&] { set_matrix(*static_cast<Problem*>(problem), displacement, matrix); });
}
PetscErrorCode precondition_callback(PC preconditioner, Vec in, Vec out) {
    return guarded([&] {
        Problem* problem = nullptr;
        check(PCShellGetContext(preconditioner, &problem));
        precondition(*problem, in, out);
    });
}

} // namespace

DistributedEquilibrium solve_equilibrium(BlockForces& forces, const Supports& supports,
                                         const std::array<double, 3>& gravity, Vec displacement) {
    Problem problem{forces, gravity, held_components(forces.block(), supports), {}, {}};
    const MPI_Comm communicator = forces.block().communicator();
    check(VecDuplicate(displacement, problem.scratch.make()));
    set_held(displacement, problem.held);

    PetscInt local = 0, global = 0;
    check(VecGetLocalSize(displacement, &local));
    check(VecGetSize(displacement, &global));
    OwnedMat matrix;
    check(MatCreateShell(communicator, local, local, global, global, &problem, matrix.make()));
    check(MatShellSetOperation(matrix, MATOP_MULT, reinterpret_cast<void (*)()>(product_callback)));
    check(MatSetOption(matrix, MAT_SYMMETRIC, PETSC_TRUE));

    OwnedSnes snes;
    OwnedVec unbalanced;
    check(VecDuplicate(displacement, unbalanced.make()));
    check(SNESCreate(communicator, snes.make()));
    check(SNESSetFunction(snes, unbalanced, residual_callback, &problem));
    check(SNESSetJacobian(snes, matrix, matrix, matrix_callback, &problem));
    check(SNESSetTolerances(snes, 1e-50, 1e-10, 0, 50, PETSC_MAX_INT));
    KSP ksp = nullptr;
    PC preconditioner = nullptr;
    check(SNESGetKSP(snes, &ksp));
    check(KSPSetType(ksp, KSPCG));
    check(KSPSetTolerances(ksp, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, 20000));
    check(KSPGetPC(ksp, &preconditioner));
    check(PCSetType(preconditioner, PCSHELL));
    check(PCShellSetContext(preconditioner, &problem));
    check(PCShellSetApply(preconditioner, precondition_callback));
    check(SNESSetFromOptions(snes));
    check(SNESSolve(snes, nullptr, displacement));

    DistributedEquilibrium result;
    SNESConvergedReason reason{};
    PetscInt newton = 0, linear = 0;
    check(SNESGetConvergedReason(snes, &reason));
    check(SNESGetIterationNumber(snes, &newton));
    check(SNESGetLinearSolveIterations(snes, &linear));
    check(SNESGetFunctionNorm(snes, &result.residual));
    result.converged = reason > 0;
    result.reason = SNESConvergedReasons[reason];
    result.newton_iterations = static_cast<int>(newton);
    result.linear_iterations = static_cast<int>(linear);
    forces.set_displacement(displacement);
    return result;
}

std::array<double, 3> support_force(BlockForces& forces, PetscInt layer) {
    OwnedVec force;
    check(VecDuplicate(forces.masses(), force.make()));
    forces.get_forces(force);
    const PetscScalar* f = nullptr;
    check(VecGetArrayRead(force, &f));
    const NodeBox& mine = forces.block().owned();
    std::array<double, 3> own = {0, 0, 0}, total = {0, 0, 0};
    if (layer >= mine.low[1] && layer < mine.low[1] + mine.size[1]) {
        for (PetscInt k = 0; k < mine.size[2]; ++k) {
            for (PetscInt i = 0; i < mine.size[0]; ++i) {
                const std::size_t n = mine.index(mine.low[0] + i, layer, mine.low[2] + k);
                for (std::size_t c = 0; c < 3; ++c) {
                    own[c] -= f[3 * n + c];
                }
            }
        }
    }
    check(VecRestoreArrayRead(force, &f));
    MPI_Allreduce(own.data(), total.data(), 3, MPI_DOUBLE, MPI_SUM, forces.block().communicator());
    return total;
}

} // namespace hybmss::distributed
