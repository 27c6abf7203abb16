#include "app/verify/verify.hpp"

#include "hybmss/version.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>
#include <limits>

namespace hybmss::verify {
namespace {

/// What forces are printed beside.
constexpr const char* kCompanions[] = {"energy", "hessian product"};

bool is_printed_with_forces(const RowKey& key) {
    return key.check == "forces" ||
           std::find(std::begin(kCompanions), std::end(kCompanions), key.check) != std::end(kCompanions);
}

const Row* companion(const RowTable& table, const Row& forces, const char* check) {
    RowKey key = forces.key;
    key.check = check;
    for (const Row& row : table.rows()) {
        if (row.key == key) {
            return &row;
        }
    }
    return nullptr;
}

std::string kernel_columns(const RowKey& key) {
    return fmt::format("{:<13} {:<7} {:<8} {:<7}", key.layout, name(key.instruction_set), name(key.accuracy),
                       key.precision);
}

std::string measure(const Row& row) {
    return fmt::format("{:>9.3g} {:>6g}", row.error, row.tolerance);
}

void print_properties(const RowTable& table, std::ostream& out) {
    out << fmt::format("{:<13} {:<7} {:<8} {:<7} {:<21} {:>6} {:>9} {:>6}  {:<6}  {}\n", "layout", "isa", "level",
                       "type", "property", "cases", "error", "limit", "result", "worst at");
    for (const Row& row : table.rows()) {
        if (!is_printed_with_forces(row.key)) {
            out << fmt::format("{} {:<21} {:>6} {}  {:<6}  {}\n", kernel_columns(row.key), row.key.check, row.cases,
                               measure(row), row.passed() ? "pass" : "FAIL", row.worst_body);
        }
    }
}

void print_forces(const RowTable& table, std::ostream& out) {
    out << fmt::format("\n{:<13} {:<7} {:<8} {:<7} {:<21} {:>7} {:>6} {:>9} {:>6} {:>9} {:>6} {:>9} {:>6}  {:<6}  {}\n",
                       "layout", "isa", "level", "type", "variant", "strain", "bodies", "forces", "limit", "energy",
                       "limit", "K p", "limit", "result", "worst at");
    for (const Row& row : table.rows()) {
        if (row.key.check != "forces") {
            continue;
        }
        const Row* failed = row.passed() ? nullptr : &row;
        std::string measures = measure(row);
        for (const char* check : kCompanions) {
            const Row* other = companion(table, row, check);
            measures += ' ';
            measures += other != nullptr ? measure(*other) : std::string(16, ' ');
            if (failed == nullptr && other != nullptr && !other->passed()) {
                failed = other;
            }
        }
        out << fmt::format("{} {:<21} {:>7g} {:>6} {}  {:<6}  {}\n", kernel_columns(row.key), row.key.variant,
                           row.key.strain, row.cases, measures, failed == nullptr ? "pass" : "FAIL",
                           failed == nullptr ? row.worst_body : failed->worst_body);
    }
}

void print_total(const RowTable& table, std::ostream& out) {
    const auto failed =
        std::count_if(table.rows().begin(), table.rows().end(), [](const Row& row) { return !row.passed(); });
    int cases = 0;
    for (const Row& row : table.rows()) {
        cases += row.cases;
    }
    out << fmt::format("{} checks in {} rows: {}\n", cases, table.rows().size(),
                       failed == 0 ? "all passed" : fmt::format("{} rows FAILED", failed));
}

} // namespace

std::span<const ListedKernel> listed_kernels() {
    static constexpr ListedKernel kListed[] = {
#define HYBMSS_KERNEL(name, proof, ...) {#name, proof},
#include "kernels/kernels.inc"
#undef HYBMSS_KERNEL
    };
    return kListed;
}

bool all_passed(const RowTable& table) {
    return !table.rows().empty() &&
           std::all_of(table.rows().begin(), table.rows().end(), [](const Row& row) { return row.passed(); });
}

void print_summary(const RowTable& table, std::ostream& out) {
    struct Line {
        std::string layout, precision;
        std::vector<InstructionSet> sets;
        int checks = 0, failed = 0;
        const Row* worst = nullptr; ///< beside its limit
    };
    const auto share = [](const Row& row) {
        return row.tolerance > 0 ? row.error / row.tolerance
               : row.passed()    ? 0.0
                                 : std::numeric_limits<double>::infinity();
    };
    std::vector<Line> lines;
    for (const Row& row : table.rows()) {
        auto line = std::find_if(lines.begin(), lines.end(), [&](const Line& l) {
            return l.layout == row.key.layout && l.precision == row.key.precision;
        });
        if (line == lines.end()) {
            line = lines.insert(lines.end(), Line{row.key.layout, row.key.precision, {}, 0, 0, nullptr});
        }
        if (std::find(line->sets.begin(), line->sets.end(), row.key.instruction_set) == line->sets.end()) {
            line->sets.push_back(row.key.instruction_set);
        }
        line->checks += row.cases;
        line->failed += !row.passed();
        if (line->worst == nullptr || share(row) > share(*line->worst)) {
            line->worst = &row;
        }
    }
    out << fmt::format("{:<13} {:<7} {:<19} {:>8}  {:<6}  {}\n", "layout", "type", "instruction sets", "checks",
                       "result", "nearest its limit");
    for (const Line& line : lines) {
        std::string sets;
        for (const InstructionSet set : line.sets) {
            sets += sets.empty() ? "" : " ";
            sets += name(set);
        }
        out << fmt::format("{:<13} {:<7} {:<19} {:>8}  {:<6}  {}: {:.3g} of {:g} epsilons\n", line.layout,
                           line.precision, sets, line.checks, line.failed == 0 ? "pass" : "FAIL", line.worst->key.check,
                           line.worst->error, line.worst->tolerance);
    }
    for (const Row& row : table.rows()) {
        if (!row.passed()) {
            out << fmt::format("FAIL {} {} {} strain {:g}: {} of {}, {}\n", kernel_columns(row.key), row.key.check,
                               row.key.variant, row.key.strain, row.error, row.tolerance, row.worst_body);
        }
    }
    print_total(table, out);
}

void print_table(const RowTable& table, std::ostream& out) {
    out << "Errors and limits in units of epsilon of the row's type (float 1.2e-7, double 2.2e-16).\n\n";
    print_properties(table, out);
    print_forces(table, out);
    out << '\n';
    for (const std::string& paragraph : tolerance_legend()) {
        out << paragraph << '\n';
    }
    out << '\n';
    print_total(table, out);
}

void write_json(const RowTable& table, const MatrixOptions& options, double seconds, std::ostream& out) {
    nlohmann::ordered_json kernels = nlohmann::json::array();
    for (const ListedKernel& kernel : listed_kernels()) {
        kernels.push_back({{"kernel", kernel.name}, {"check", kernel.check}});
    }
    nlohmann::ordered_json rows = nlohmann::json::array();
    for (const Row& row : table.rows()) {
        const double eps = epsilon(row.key.precision);
        rows.push_back({{"check", row.key.check},
                        {"layout", row.key.layout},
                        {"instruction_set", name(row.key.instruction_set)},
                        {"accuracy", name(row.key.accuracy)},
                        {"precision", row.key.precision},
                        {"variant", row.key.variant},
                        {"strain", row.key.strain},
                        {"cases", row.cases},
                        {"error", row.error * eps}, // infinite: null
                        {"error_in_epsilons", row.error},
                        {"tolerance", row.tolerance * eps},
                        {"tolerance_in_epsilons", row.tolerance},
                        {"worst_body", row.worst_body},
                        {"passed", row.passed()}});
    }
    const nlohmann::ordered_json report = {
        {"version", kVersion},          {"seed", options.seed}, {"seconds", seconds}, {"passed", all_passed(table)},
        {"legend", tolerance_legend()}, {"kernels", kernels},   {"rows", rows}};
    out << report.dump(1) << '\n';
}

} // namespace hybmss::verify
