#pragma once

/// \file
/// One row of the benchmark matrix, and the lists of rows.

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/plan_options.hpp"

#include <array>
#include <string>
#include <vector>

namespace hybmss::bench {

using hybmss::Precision;

/// Golec et al.'s three variants and one more, at nu = 0.499.
enum class Model {
    hybmss,                    ///< A = 1, volume force
    without_face_diagonals,    ///< HybMSS-FD: A = 0, volume force
    without_correction_forces, ///< HybMSS-CF: A = 1, springs only
    on_means                   ///< HybMSS-M: A = 0, springs on the means of cells, volume force
};

/// What one row measures. Its name holds every field: operation/mesh/model/layout/instruction set/precision/threads,
/// and behind the precision the accuracy, where it is not `accurate`.
struct BenchRow {
    std::array<int, 3> mesh = {10, 10, 10}; ///< cells
    Model model = Model::hybmss;
    /// "lattice" or "network": the body so described, in the layout that the plan chooses; or a layout's name.
    std::string layout = "lattice";
    InstructionSet instruction_set = InstructionSet::automatic;
    Precision precision = Precision::float32;
    int threads = 1;
    Accuracy accuracy = Accuracy::accurate;
    int wall = 0; ///< above 0: a hollow ball in mesh[0]^3 cells, its wall so many cells thick; else a box
};

/// What was asked for; each benchmark takes of it what it can vary.
struct RowChoices {
    std::vector<InstructionSet> instruction_sets;
    std::vector<std::string> layouts; ///< none: those that the benchmark is about
    std::vector<Precision> precisions = {Precision::float32, Precision::float64};
    std::vector<int> threads; ///< none: one and two; one where `quick`
    Accuracy accuracy = Accuracy::accurate;
    double seconds = 0.5; ///< about, a row
    bool quick = false;   ///< the few rows that tell most
    bool large = false;   ///< the largest bodies too

    /// With what is not named filled in.
    RowChoices with_layouts(std::vector<std::string> otherwise) const;
};

/// E.g. "step/10x10x10/HybMSS/lattice/avx512/float/threads:1"; `operation` is "step" or "hessian".
std::string name(const BenchRow& row, const std::string& operation = "step");
std::string mesh_name(const BenchRow& row); ///< e.g. "10x10x10", "hollow-ball-64"
std::string name(Model model);              ///< "HybMSS", "HybMSS-FD", "HybMSS-CF" or "HybMSS-M"

/// The body, its material and the plan's options that a row asks for.
Lattice row_lattice(const BenchRow& row);
Material row_material(const BenchRow& row);
PlanOptions row_options(const BenchRow& row);
/// Whether the row's body is given as a network (else as a lattice).
bool is_network(const BenchRow& row);

/// The names that a row's layout may have.
std::vector<std::string> row_layouts();
/// Throws std::invalid_argument that lists the known names.
void check_layout(const std::string& layout);

/// Calls append(row) for every row that the choices span, of a mesh and a model.
template <class Append>
void for_rows(const RowChoices& choices, const std::array<int, 3>& mesh, Model model, int wall, const Append& append) {
    for (const std::string& layout : choices.layouts) {
        for (InstructionSet set : choices.instruction_sets) {
            for (Precision precision : choices.precisions) {
                for (int threads : choices.threads) {
                    append(BenchRow{mesh, model, layout, set, precision, threads, choices.accuracy, wall});
                }
            }
        }
    }
}

/// Golec et al.'s Table 6 x three models x what `choices` span, and full HybMSS on a hollow ball. `choices.quick`: the
/// full model on two cubes.
std::vector<BenchRow> step_rows(const RowChoices& choices);

} // namespace hybmss::bench
