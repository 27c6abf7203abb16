#pragma once

/// \file
/// What `hybmss verify` reports: one row per check, layout, instruction set, accuracy, precision, variant and
/// strain.

#include "hybmss/accuracy.hpp"
#include "hybmss/instruction_set.hpp"

#include <string>
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
    /// Counts one case; keeps its error if it is the worst of its row. NaN counts as infinite.
    void record(const RowKey& key, double error, const std::string& body);
    const std::vector<Row>& rows() const { return rows_; }

private:
    std::vector<Row> rows_; ///< in order of first appearance
};

/// epsilon of the named precision ("float" or "double").
double epsilon(const std::string& precision);

template <class T>
constexpr const char* precision_name() {
    return sizeof(T) == sizeof(float) ? "float" : "double";
}

} // namespace hybmss::verify
