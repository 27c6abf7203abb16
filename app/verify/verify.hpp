#pragma once

/// \file
/// `hybmss verify`, the regression matrix: every kernel of this machine against the scalar reference. A row is a check,
/// layout, instruction set, accuracy, precision, variant and strain. Nothing here prints but what is asked to; the
/// command line and the tests share it.

#include "hybmss/accuracy.hpp"
#include "hybmss/instruction_set.hpp"
#include "plan/bodies/plan_description.hpp"

#include <cstddef>
#include <map>
#include <ostream>
#include <span>
#include <string>
#include <tuple>
#include <vector>

namespace hybmss::verify {

struct RowKey {
    std::string check;  ///< "forces", "energy", "hessian product", or one of the properties
    std::string layout; ///< as the plan names it
    InstructionSet instruction_set = InstructionSet::automatic;
    Accuracy accuracy = Accuracy::accurate;
    std::string precision; ///< "float" or "double"
    std::string variant;   ///< "" where the check covers all variants
    double strain = 0;     ///< 0 where the check has no strain
    bool operator==(const RowKey&) const = default;
    /// In no order that means anything.
    bool operator<(const RowKey& other) const { return values() < other.values(); }

private:
    std::tuple<const std::string&, const std::string&, InstructionSet, Accuracy, const std::string&, const std::string&,
               double>
    values() const {
        return {check, layout, instruction_set, accuracy, precision, variant, strain};
    }
};

/// The worst error over all bodies of one key, in units of the precision's epsilon.
struct Row {
    RowKey key;
    int cases = 0;
    double error = 0;
    double tolerance = 0;
    std::string worst_body; ///< where the error was worst
    /// An error that is not a number, or infinite, fails too.
    bool passed() const { return cases > 0 && error <= tolerance; }
};

class RowTable {
public:
    /// Counts one case; keeps its error, relative, if it is the worst of its row. NaN counts as infinite.
    void record(const RowKey& key, double error, const std::string& body);
    /// As if all that `later` has recorded came after what is here.
    void append(const RowTable& later);
    const std::vector<Row>& rows() const { return rows_; }

private:
    Row& row_of(const RowKey& key);

    std::vector<Row> rows_; ///< in order of first appearance
    std::map<RowKey, std::size_t> places_;
};

/// epsilon of the named precision ("float" or "double").
double epsilon(const std::string& precision);

/// How far a row may be from the reference, in units of the precision's epsilon.
double tolerance(const RowKey& key);

/// The meaning of each check's error and the reason for its tolerance, one paragraph each.
std::vector<std::string> tolerance_legend();

/// How much of the matrix to run.
enum class Extent {
    full, ///< all bodies
    quick ///< those of at most 1000 cells
};

struct MatrixOptions {
    std::vector<InstructionSet> instruction_sets; ///< each is forced in turn; empty: all of this machine
    Extent extent = Extent::full;
    unsigned seed = 1; ///< of all random bodies and displacements
};

/// All rows: forces, energies and second derivatives of many bodies, what must hold besides single values, and steps.
RowTable run_matrix(const MatrixOptions& options);

/// A kernel of the list in kernels/kernels.inc, and the check that compares it with the reference.
struct ListedKernel {
    std::string_view name, check;
};
std::span<const ListedKernel> listed_kernels();

bool all_passed(const RowTable& table);

/// A line for each layout and type, and the rows that failed.
void print_summary(const RowTable& table, std::ostream& out);

/// Aligned columns, one line a row (forces, energy and product of one key share a line), the legend below.
void print_table(const RowTable& table, std::ostream& out);

/// {"version", "seed", "seconds", "passed", "kernels": [{"kernel", "check"}], "rows": [{"check", "layout", ...,
/// "error", "tolerance", "passed"}]}, errors relative (not in epsilons).
void write_json(const RowTable& table, const MatrixOptions& options, double seconds, std::ostream& out);

} // namespace hybmss::verify
