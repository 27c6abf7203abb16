#pragma once

/// \file
/// The regression matrix for people and for programs.

#include "app/verify/verify_matrix.hpp"

#include <ostream>

namespace hybmss::verify {

/// Aligned columns, one line a row (forces and energy of one key share a line), the legend below.
void print_table(const RowTable& table, std::ostream& out);

/// {"version", "seed", "seconds", "passed", "rows": [{"check", "layout", ..., "error", "tolerance", "passed"}]}, errors
/// relative (not in epsilons).
void write_json(const RowTable& table, const MatrixOptions& options, double seconds, std::ostream& out);

bool all_passed(const RowTable& table);

} // namespace hybmss::verify
