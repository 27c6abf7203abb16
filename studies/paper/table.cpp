#include "studies/paper/table.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <ostream>

namespace hybmss::paper {
namespace {

std::string printed(const Cell& cell, const Column& column) {
    if (!cell.word.empty()) {
        return cell.word;
    }
    if (!std::isfinite(cell.number)) {
        return "-";
    }
    return column.decimals < 0 ? fmt::format("{:.{}g}", cell.number, -column.decimals)
                               : fmt::format("{:.{}f}", cell.number, column.decimals);
}

/// Numbers stand to the right, words to the left.
bool is_wordy(const Table& table, std::size_t column) {
    return std::any_of(table.rows.begin(), table.rows.end(),
                       [column](const auto& row) { return !row[column].word.empty(); });
}

} // namespace

void print_text(const Table& table, std::ostream& out) {
    out << table.title << "\n\n";
    std::vector<std::size_t> widths;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        std::size_t width = table.columns[c].heading.size();
        for (const auto& row : table.rows) {
            width = std::max(width, printed(row[c], table.columns[c]).size());
        }
        widths.push_back(width);
    }
    const auto line = [&](const auto& text_of) {
        std::string text = " ";
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            text += is_wordy(table, c) ? fmt::format(" {:<{}} ", text_of(c), widths[c])
                                       : fmt::format(" {:>{}} ", text_of(c), widths[c]);
        }
        text.erase(text.find_last_not_of(' ') + 1);
        out << text << '\n';
    };
    line([&](std::size_t c) { return table.columns[c].heading; });
    for (const auto& row : table.rows) {
        line([&](std::size_t c) { return printed(row[c], table.columns[c]); });
    }
    for (const std::string& remark : table.remarks) {
        out << "\n  " << remark;
    }
    out << (table.remarks.empty() ? "\n" : "\n\n");
}

void print_markdown(const Table& table, std::ostream& out) {
    out << "## " << table.title << "\n\n";
    for (const std::string& paragraph : table.introduction) {
        out << paragraph << "\n\n";
    }
    out << '|';
    for (const Column& column : table.columns) {
        out << ' ' << column.heading << " |";
    }
    out << "\n|";
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        out << (is_wordy(table, c) ? "---|" : "---:|");
    }
    out << '\n';
    for (const auto& row : table.rows) {
        out << '|';
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            out << ' ' << printed(row[c], table.columns[c]) << " |";
        }
        out << '\n';
    }
    out << '\n';
    for (const std::string& remark : table.remarks) {
        out << "- " << remark << '\n';
    }
    out << (table.remarks.empty() ? "" : "\n");
}

nlohmann::ordered_json to_json(const Table& table) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const auto& row : table.rows) {
        nlohmann::ordered_json entry;
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            nlohmann::ordered_json& value = entry[table.columns[c].key];
            if (!row[c].word.empty()) {
                value = row[c].word;
            } else if (std::isfinite(row[c].number)) {
                value = row[c].number;
            }
        }
        rows.push_back(std::move(entry));
    }
    return {{"name", table.name}, {"title", table.title}, {"rows", rows}, {"remarks", table.remarks}};
}

} // namespace hybmss::paper
