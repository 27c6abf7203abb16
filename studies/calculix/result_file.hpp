#pragma once

/// \file
/// The text files in which CalculiX leaves its results.

#include <array>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

namespace hybmss::calculix {

/// The last table of vectors in a .dat file whose heading begins with `heading` ("displacements", "forces"), one entry
/// for each of `nodes` nodes; zero where a node is not listed. Throws std::runtime_error where there is no such table,
/// or a node out of range in it.
std::vector<std::array<double, 3>> read_node_table(const std::filesystem::path& path, std::string_view heading,
                                                   std::size_t nodes);

/// Newton iterations of all increments, from a .sta file; 0 where it does not exist.
int read_iterations(const std::filesystem::path& path);

/// The first complaint in what the program printed, in one line; "" without any.
std::string read_complaint(const std::filesystem::path& path);

} // namespace hybmss::calculix
