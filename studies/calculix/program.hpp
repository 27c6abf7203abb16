#pragma once

/// \file
/// CalculiX run as a program: `ccx`, where it is installed (Debian package calculix-ccx); the text files that it reads,
/// and those in which it leaves its results.

#include "studies/calculix/problem.hpp"

#include <array>
#include <cstddef>
#include <filesystem>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss::calculix {

/// Whether a program named ccx is on PATH.
bool is_installed();

/// What to say where it is not.
inline constexpr const char* kNotInstalled = "CalculiX is not installed: no ccx on PATH (Debian package calculix-ccx)";

/// What the program calls its version, e.g. "2.20"; "" where it is not installed.
std::string version();

/// Solves the problem on one thread, in a directory of its own under the system's temporary one, which is removed.
/// Throws std::runtime_error in one line where ccx is not installed or fails.
Solution solve(const Problem& problem);

/// The lowest frequencies, Hz, those of free motions of the whole body left out: `count` with them. Loads are not used.
/// Throws as solve() does.
std::vector<double> frequencies(const Problem& problem, int count);

// ---- its files
/// Nodes and elements are numbered from 1. One step: *STATIC with its default increments, with displacements of all
/// nodes and forces on the supported ones printed at its end; or *FREQUENCY for so many of them.
void write_deck(const Problem& problem, std::ostream& out, int frequencies = 0);

/// Hz, from a .dat file, those above a thousandth of the greatest. Throws std::runtime_error where there are none.
std::vector<double> read_frequencies(const std::filesystem::path& path);

/// The last table of vectors in a .dat file whose heading begins with `heading` ("displacements", "forces"), one entry
/// for each of `nodes` nodes; zero where a node is not listed. Throws std::runtime_error where there is no such table,
/// or a node out of range in it.
std::vector<std::array<double, 3>> read_node_table(const std::filesystem::path& path, std::string_view heading,
                                                   std::size_t nodes);

/// The last table of stresses in a .dat file as Solution has them. Throws std::runtime_error where one of the elements
/// has none, or one is out of range.
std::vector<std::array<double, 6>> read_stresses(const std::filesystem::path& path, std::size_t elements);

/// Newton iterations of all increments, from a .sta file; 0 where it does not exist.
int read_iterations(const std::filesystem::path& path);

/// The first complaint in what the program printed, in one line; "" without any.
std::string read_complaint(const std::filesystem::path& path);

} // namespace hybmss::calculix
