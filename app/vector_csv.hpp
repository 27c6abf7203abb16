#pragma once

/// \file
/// One 3-vector a row: x,y,z.

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// Reads exactly `rows` rows of three finite numbers; a first line without numbers is a header, and empty lines are
/// passed over. Throws std::invalid_argument "FILE:LINE: what is wrong".
std::vector<std::array<double, 3>> read_vector_csv(const std::string& path, std::size_t rows);

/// Writes a header line and a row each, whole or not at all. `digits`: significant decimal digits.
void write_vector_csv(const std::string& path, std::span<const std::array<double, 3>> values, int digits);

} // namespace hybmss
