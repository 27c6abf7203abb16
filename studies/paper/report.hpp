#pragma once

/// \file
/// The tables as one document.

#include "studies/paper/table.hpp"

#include <iosfwd>
#include <string>
#include <vector>

namespace hybmss::paper {

/// A page of Markdown: docs/report/paper.md. `calculix` says where CalculiX's figures come from.
void write_page(const std::vector<Table>& tables, const std::string& calculix, std::ostream& out);
void write_json(const std::vector<Table>& tables, const std::string& calculix, std::ostream& out);

} // namespace hybmss::paper
