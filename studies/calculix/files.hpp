#pragma once

/// \file
/// The text files that CalculiX reads and those in which it leaves its results.

#include "studies/calculix/problem.hpp"

#include <array>
#include <cstddef>
#include <filesystem>
#include <ostream>
#include <string_view>
#include <vector>

namespace hybmss::calculix {

/// Nodes and elements are numbered from 1. One step, *STATIC with its default increments; displacements of all nodes
/// and forces on the supported ones are printed at its end.
void write_deck(const Problem& problem, std::ostream& out);

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
