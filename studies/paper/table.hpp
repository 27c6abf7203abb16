#pragma once

/// \file
/// A table that prints itself for a terminal, as Markdown and as JSON.

#include <nlohmann/json_fwd.hpp>

#include <iosfwd>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace hybmss::paper {

struct Column {
    std::string key;     ///< in JSON
    std::string heading; ///< with the unit
    int decimals = 0;    ///< of its numbers; negative: as many significant digits instead
};

/// Nothing (printed as "-"), a word, or a number.
struct Cell {
    std::string word;
    double number = std::numeric_limits<double>::quiet_NaN(); ///< where there is no word

    Cell() = default;
    Cell(double value) : number(value) {}
    Cell(std::string text) : word(std::move(text)) {}
};

struct Table {
    std::string name;                      ///< what the command line and JSON call it
    std::string title;                     ///< one line
    std::vector<std::string> introduction; ///< paragraphs above
    std::vector<Column> columns;
    std::vector<std::vector<Cell>> rows; ///< as wide as the columns
    std::vector<std::string> remarks;    ///< below, one a line
};

void print_text(const Table& table, std::ostream& out);
void print_markdown(const Table& table, std::ostream& out);
nlohmann::ordered_json to_json(const Table& table);

} // namespace hybmss::paper
