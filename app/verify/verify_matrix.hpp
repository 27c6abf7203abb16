#pragma once

/// \file
/// The regression matrix: every kernel of this machine against the scalar reference. Nothing here prints; the command
/// line and the tests share it.

#include "app/verify/verify_bodies.hpp"
#include "app/verify/verify_rows.hpp"

#include "hybmss/plan_options.hpp"

#include <vector>

namespace hybmss::verify {

struct MatrixOptions {
    std::vector<InstructionSet> instruction_sets; ///< each is forced in turn; empty: all of this machine
    Extent extent = Extent::full;
    unsigned seed = 1; ///< of all random bodies and displacements
};

/// {layout} x {instruction set} x {accuracy} x {float, double} x {bodies} x {variants} x {strains}: forces, energies
/// and Hessian products, in separate arrays and interleaved ones by turns.
void run_force_matrix(const MatrixOptions& options, RowTable& table);

/// What must hold besides single values: the forced instruction set runs, forces are added, padding is left alone,
/// coincident nodes give finite forces, no total force or torque, rigid motions cost nothing.
void run_properties(const MatrixOptions& options, RowTable& table);

/// Fifty steps of ExplicitDynamics: with gravity, damping and prescribed nodes, and with none of them.
void run_dynamics(const MatrixOptions& options, RowTable& table);

/// All three.
RowTable run_matrix(const MatrixOptions& options);

/// For each layout that the body can be planned in, each instruction set and each accuracy: a key that names these and
/// the precision.
std::vector<RowKey> kernel_keys(const TestBody& body, const std::vector<InstructionSet>& sets,
                                const std::string& precision);

/// The options that ask for what a key names.
PlanOptions plan_options(const RowKey& key);

/// A ForcePlan or an ExplicitDynamics of the body.
template <class Planned>
Planned make_planned(const TestBody& body, const PlanOptions& options) {
    return body.lattice ? Planned(*body.lattice, body.material, options) : Planned(body.network, options);
}

} // namespace hybmss::verify
