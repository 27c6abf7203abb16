#pragma once

/// \file
/// The bodies of the regression matrix, and the plans that are made of them.

#include "app/verify/verify.hpp"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "hybmss/plan_options.hpp"
#include "reference/body.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hybmss::verify {

/// One body in one variant: a lattice with its material, or a network made by hand.
struct TestBody {
    std::string name;    ///< e.g. "box 3x2x5"
    std::string variant; ///< e.g. "A=1 quadratic"
    std::optional<Lattice> lattice;
    Material material;    ///< of the lattice
    Network network;      ///< where there is no lattice
    double cell_size = 1; ///< m; a strain of 1 means displacements of this size
};

/// Boxes, masks and networks, each in all of its variants. Random parts follow from the seed alone.
std::vector<TestBody> test_bodies(Extent extent, unsigned seed);

/// A few small ones, for checks that need many runs of each: a box, a mask with mixed stiffness, a network.
std::vector<TestBody> property_bodies(unsigned seed);

reference::Body reference_body(const TestBody& body);

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

/// check(body, table) for all bodies, on all of the machine's processors; the same table as one after the other.
void for_each_body(const std::vector<TestBody>& bodies, RowTable& table,
                   const std::function<void(const TestBody&, RowTable&)>& check);

// ---- the parts of run_matrix

/// {layout} x {instruction set} x {accuracy} x {float, double} x {bodies} x {variants} x {strains}: forces, energies
/// and Hessian products, in separate arrays and interleaved ones by turns.
void run_force_matrix(const MatrixOptions& options, RowTable& table);

/// What must hold besides single values: the forced instruction set runs, forces are added, padding is left alone,
/// coincident nodes give finite forces, no total force or torque, rigid motions cost nothing, diagonals are the
/// product's.
void run_properties(const MatrixOptions& options, RowTable& table);

/// Fifty steps of ExplicitDynamics: with gravity, damping and prescribed nodes, and with none of them.
void run_dynamics(const MatrixOptions& options, RowTable& table);

} // namespace hybmss::verify
