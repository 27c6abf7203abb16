#pragma once

/// \file
/// How far a kernel may be from the reference, and why.

#include "app/verify/verify_rows.hpp"

#include <string>
#include <vector>

namespace hybmss::verify {

/// In units of the precision's epsilon.
double tolerance(const RowKey& key);

/// The meaning of each check's error and the reason for its tolerance, one paragraph each.
std::vector<std::string> tolerance_legend();

} // namespace hybmss::verify
