#include "studies/price/price_tables.hpp"

#include "studies/paper/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hybmss::price {
namespace {

using paper::Cell;
using paper::Table;

/// An error within so many uncertainties of the reference says nothing.
constexpr double kTrust = 3;

std::string mesh_text(paper::Kind kind, int across) {
    const auto [nx, ny, nz] = paper::mesh(experiment(kind, across));
    return nx == nz ? fmt::format("{}^3", nx) : fmt::format("{} x {} x {}", nx, ny, nz);
}

double uncertainty(const Reference& reference, std::size_t index) {
    return index < reference.values.size() ? reference.values[index].uncertainty : reference.field_uncertainty;
}

bool is_trusted(const Reference& reference, const Point& point, std::size_t index) {
    return point.failure.empty() && point.errors[index] > kTrust * uncertainty(reference, index);
}

Way static_in(Precision precision, paper::Model model = paper::Model::hybmss) {
    return {{}, Method::static_solve, model, precision};
}

/// nullptr where there is none, or no answer.
const Point* point_on(const std::vector<Point>& points, const Way& way, int across) {
    const auto found = std::find_if(points.begin(), points.end(), [&](const Point& point) {
        return point.way == way && point.across == across && point.failure.empty();
    });
    return found == points.end() ? nullptr : &*found;
}

Cell observed(const Reference& reference, const std::vector<Point>& points, const Point& point, std::size_t index) {
    const Point* coarse = point_on(points, point.way, point.across / 2);
    if (coarse == nullptr || !is_trusted(reference, point, index)) {
        return {};
    }
    return paper::observed_order(coarse->errors[index], coarse->across, point.errors[index], point.across);
}

/// By the four finest meshes; not a number with fewer.
double limit_of_means(const std::vector<Point>& points, std::size_t index, double expected_order) {
    std::vector<double> values;
    for (const Point& point : points) {
        if (point.way == static_in(Precision::float64, paper::Model::hybmss_m) && point.failure.empty()) {
            values.push_back(point.values[index]);
        }
    }
    if (values.size() < 4) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    return extrapolate({values.end() - 4, values.end()}, expected_order).value;
}

Table reference_table(const Solutions& solutions) {
    Table table{
        "references",
        "What the solutions converge to",
        {"Limits of static solves in double on meshes of which each is twice as fine, by Richardson's "
         "extrapolation with the observed order; the uncertainty is what the limits of the coarser and of the "
         "finer three of four meshes differ by. nu = 0.3, strains of 1e-5, A = 1. HybMSS-M's limits come from the "
         "four finest of its meshes below: both forms must agree."},
        {{"problem", "problem"},
         {"quantity", "quantity"},
         {"limit", "limit", -7},
         {"uncertainty", "uncertainty, %", -2},
         {"order", "order", 2},
         {"expected_order", "expected", 2},
         {"hybmss_m", "HybMSS-M's", -7},
         {"to_hybmss_m", "to limit, %", 3},
         {"calculix", "C3D20 on its finest mesh", -7},
         {"to_calculix", "to limit, %", 3}},
        {},
        {"Expected: 2 lambda, where displacements leave a clamped edge as r^lambda. A beam's tip moves by "
         "bending too, whose error falls with order 2 and is the larger one on coarse meshes."}};
    for (std::size_t r = 0; r < solutions.references.size(); ++r) {
        const Reference& reference = solutions.references[r];
        const Point* fine = nullptr;
        for (const Point& point : solutions.points[r]) {
            if (point.way.elements == calculix::ElementType::c3d20 && point.failure.empty()) {
                fine = &point;
            }
        }
        for (std::size_t v = 0; v < reference.values.size(); ++v) {
            const Extrapolation& limit = reference.values[v];
            const double means = limit_of_means(solutions.points[r], v, reference.expected_order);
            table.rows.push_back({std::string(paper::name(reference.kind)), error_names(reference.kind)[v], limit.value,
                                  100 * limit.uncertainty, limit.order, reference.expected_order, means,
                                  100 * (means / limit.value - 1), fine ? Cell(fine->values[v]) : Cell(),
                                  fine ? Cell(100 * (fine->values[v] / limit.value - 1)) : Cell()});
        }
    }
    return table;
}

Table point_table(const Solutions& solutions) {
    Table table{"solutions",
                "The price of a percent in a solution",
                {"Errors against the limits, relative, in percent, and the seconds from the scene to the result on one "
                 "thread (of CalculiX: of the program; least of three rounds in turns, where they take less than 1 s). "
                 "`order` is observed from the mesh before. L2 and H1 are those of the whole field of displacements, "
                 "interpolated as its cells do. Errors within three times the limit's uncertainty have no order."},
                {{"problem", "problem"},
                 {"way", "way"},
                 {"model", "model"},
                 {"precision", "type"},
                 {"mesh", "mesh"},
                 {"across", "across", 0},
                 {"steps", "steps", 0},
                 {"seconds", "s", -3},
                 {"error", "error, %", -3},
                 {"order", "order", 2},
                 {"volume_error", "of e, %", -3},
                 {"volume_order", "order", 2},
                 {"l2", "L2, %", -3},
                 {"l2_order", "order", 2},
                 {"h1", "H1, %", -3},
                 {"h1_order", "order", 2}},
                {},
                {}};
    for (std::size_t r = 0; r < solutions.references.size(); ++r) {
        const Reference& reference = solutions.references[r];
        std::vector<Point> points = solutions.points[r];
        std::stable_sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
            const auto rank = [](const Point& p) {
                return std::tuple(p.way.elements.has_value(), p.way.elements, p.way.method, p.way.model,
                                  p.way.precision == Precision::float32);
            };
            return rank(a) < rank(b);
        });
        const std::size_t count = reference.values.size();
        for (const Point& point : points) {
            const bool lattice = !point.way.elements;
            std::vector<Cell> row = {std::string(paper::name(reference.kind)),
                                     name(point.way),
                                     lattice ? Cell(std::string(paper::name(point.way.model))) : Cell(),
                                     lattice ? Cell(std::string(name(point.way.precision))) : Cell(),
                                     mesh_text(reference.kind, point.across),
                                     static_cast<double>(point.across),
                                     lattice ? Cell(static_cast<double>(point.steps)) : Cell(),
                                     point.seconds};
            if (!point.failure.empty()) {
                row.push_back(std::string("failed"));
                row.resize(table.columns.size());
                table.rows.push_back(row);
                continue;
            }
            const auto add = [&](std::size_t index) {
                row.emplace_back(100 * point.errors[index]);
                row.push_back(observed(reference, solutions.points[r], point, index));
            };
            add(0);
            if (count > 1) {
                add(1);
            } else {
                row.insert(row.end(), 2, Cell());
            }
            add(count);
            add(count + 1);
            table.rows.push_back(std::move(row));
        }
    }
    const double order = solutions.references.empty() ? 0 : solutions.references.front().expected_order;
    table.remarks = {
        fmt::format("Expected orders, from the clamped edges: {:.2f} of figures and L2, {:.2f} of H1.", order,
                    order / 2),
        "HybMSS-CF has no volume force and is right at nu = 1/4 alone: here, at 0.3, its error is the model's and does "
        "not fall with the mesh.",
        "On the finest mesh the error is Richardson's own estimate; fields are not compared there."};
    return table;
}

/// What figures and L2 cost, digit by digit.
Table form_table(const Solutions& solutions) {
    const Way nodes = static_in(Precision::float64), means = static_in(Precision::float64, paper::Model::hybmss_m);
    Table table{"forms",
                "What a digit costs: springs between nodes, springs on means, finite elements",
                {"Cells (of the body, not whole numbers) and seconds to an error, found on straight lines between the "
                 "meshes in the logarithms of error, cells and time: static solves in double of HybMSS (A = 1) and "
                 "HybMSS-M (A = 0), one thread, CalculiX beside them. Where the coarsest mesh, 2 cells across, is "
                 "better already, it stands there; \"-\": the finest mesh does not reach the error."},
                {{"problem", "problem"},
                 {"quantity", "quantity"},
                 {"error", "error, %", -2},
                 {"hybmss_cells", "HybMSS, cells", -3},
                 {"hybmss_m_cells", "M, cells", -3},
                 {"hybmss_seconds", "HybMSS, s", -3},
                 {"hybmss_m_seconds", "M, s", -3},
                 {"hybmss_over_m", "HybMSS / M", -3},
                 {"c3d8i_seconds", "C3D8I, s", -3},
                 {"c3d20_seconds", "C3D20, s", -3},
                 {"c3d20_over_m", "C3D20 / M", -3}},
                {},
                {}};
    constexpr int kCompared = 8; // cells across
    for (std::size_t r = 0; r < solutions.references.size(); ++r) {
        const Reference& reference = solutions.references[r];
        const std::vector<Point>& points = solutions.points[r];
        const std::vector<std::string> names = error_names(reference.kind);
        const auto cells = [&](const Cost& cost) {
            const auto [nx, ny, nz] = paper::mesh(experiment(reference.kind, 1));
            return std::pow(cost.across, 3) * nx * ny * nz;
        };
        std::string compared;
        for (std::size_t q = 0; q + 1 < names.size(); ++q) { // but H1
            for (const double error : {0.1, 0.01, 0.001}) {
                if (error < kTrust * uncertainty(reference, q)) {
                    continue;
                }
                const Cost a = cost_at(points, nodes, q, error), b = cost_at(points, means, q, error);
                const double c3d8i = cost_at(points, {calculix::ElementType::c3d8i}, q, error).seconds,
                             c3d20 = cost_at(points, {calculix::ElementType::c3d20}, q, error).seconds;
                table.rows.push_back({std::string(paper::name(reference.kind)), names[q], 100 * error, cells(a),
                                      cells(b), a.seconds, b.seconds, a.seconds / b.seconds, c3d8i, c3d20,
                                      c3d20 / b.seconds});
            }
            const Point *of_nodes = point_on(points, nodes, kCompared), *of_means = point_on(points, means, kCompared);
            if (of_nodes != nullptr && of_means != nullptr) {
                compared += fmt::format("{}{} {:.2f}", compared.empty() ? "" : ", ", names[q],
                                        of_means->errors[q] / of_nodes->errors[q]);
            }
        }
        if (!compared.empty()) {
            table.remarks.push_back(fmt::format("{}, {} cells across: HybMSS-M's errors over HybMSS's: {}.",
                                                paper::name(reference.kind), kCompared, compared));
        }
    }
    return table;
}

/// Least, middle and greatest of what there is.
std::string range_text(std::vector<double> ratios) {
    if (ratios.empty()) {
        return "-";
    }
    std::sort(ratios.begin(), ratios.end());
    return fmt::format("{:.3g} times (from {:.3g} to {:.3g}, {} points)", ratios[ratios.size() / 2], ratios.front(),
                       ratios.back(), ratios.size());
}

/// A static solve that others stand beside at equal error.
struct Beside {
    const char *key, *heading;
    Way way;
};

/// Each point of a way beside the static solves at the same error: of CalculiX those of both forms, of settling those
/// of the form that settles.
Table equal_error_table(const Solutions& solutions, bool of_calculix) {
    std::vector<Beside> all = {{"double", "static double, s", static_in(Precision::float64)},
                               {"float", "static float, s", static_in(Precision::float32)}};
    if (of_calculix) {
        all.push_back({"m_double", "M, double, s", static_in(Precision::float64, paper::Model::hybmss_m)});
        all.push_back({"m_float", "M, float, s", static_in(Precision::float32, paper::Model::hybmss_m)});
    }
    Table table{of_calculix ? "calculix" : "settling",
                of_calculix ? "At equal error: CalculiX and the static solve"
                            : "At equal error: settling in time and the static solve",
                {std::string("Each point beside the static solve of HybMSS") +
                 (of_calculix ? ", and of HybMSS-M (M)," : "") +
                 " at the same error, found on straight lines between its meshes in the logarithms of error and time. "
                 "\"-\": its finest mesh does not reach that error." +
                 (of_calculix ? " Where M's coarsest mesh, 2 cells across, is better already, it stands there." : "")},
                {{"problem", "problem"},
                 {"quantity", "quantity"},
                 {"way", "way"},
                 {"precision", "type"},
                 {"mesh", "mesh"},
                 {"error", "error, %", -3},
                 {"seconds", "s", -3}},
                {},
                {}};
    for (const auto& [key, heading, way] : all) {
        table.columns.push_back({std::string("static_") + key, heading, -3});
        table.columns.push_back({std::string("ratio_") + key, "times", -3});
    }
    // By the way and what it stands beside, in the order met.
    std::vector<std::pair<std::string, std::vector<double>>> ratios;
    for (std::size_t r = 0; r < solutions.references.size(); ++r) {
        const Reference& reference = solutions.references[r];
        const std::vector<Point>& points = solutions.points[r];
        const std::vector<std::string> quantities = error_names(reference.kind);
        // Settling differs from the static solve in time alone: one quantity tells all.
        for (std::size_t q = 0; q < (of_calculix ? quantities.size() : 1); ++q) {
            for (const Point& point : points) {
                const bool wanted = of_calculix ? point.way.elements.has_value()
                                                : !point.way.elements && point.way.method != Method::static_solve &&
                                                      point.way.model == paper::Model::hybmss;
                if (!wanted || !is_trusted(reference, point, q)) {
                    continue;
                }
                const double error = point.errors[q];
                std::vector<Cell> row = {std::string(paper::name(reference.kind)),
                                         quantities[q],
                                         name(point.way),
                                         of_calculix ? Cell() : Cell(std::string(name(point.way.precision))),
                                         mesh_text(reference.kind, point.across),
                                         100 * error,
                                         point.seconds};
                for (const Beside& beside : all) {
                    const double seconds = cost_at(points, beside.way, q, error).seconds,
                                 times = point.seconds / seconds;
                    row.emplace_back(seconds);
                    row.emplace_back(times);
                    if (!std::isfinite(times) || point.way.precision != beside.way.precision) {
                        continue;
                    }
                    const std::string sentence =
                        of_calculix ? fmt::format("{} takes {{}} as long as the static solve of {} in double.",
                                                  name(point.way), paper::name(beside.way.model))
                                    : fmt::format("{} in {} takes {{}} as long as the static solve in the same type.",
                                                  name(point.way), name(point.way.precision));
                    auto at = std::find_if(ratios.begin(), ratios.end(),
                                           [&](const auto& known) { return known.first == sentence; });
                    if (at == ratios.end()) {
                        at = ratios.insert(ratios.end(), {sentence, {}});
                    }
                    at->second.push_back(times);
                }
                table.rows.push_back(std::move(row));
            }
        }
    }
    for (const auto& [sentence, times] : ratios) {
        table.remarks.push_back("At equal error " + fmt::format(fmt::runtime(sentence), range_text(times)));
    }
    return table;
}

} // namespace

Solutions measure_solutions(const Extent& extent, const std::function<void(const std::string&)>& progress) {
    Solutions solutions;
    for (const paper::Kind kind : problems()) {
        const int finest = kind == paper::Kind::beam ? extent.reference / 2 : extent.reference;
        solutions.references.push_back(make_reference(kind, finest, progress));
        solutions.points.push_back(measure_points(solutions.references.back(), extent, progress));
    }
    return solutions;
}

std::vector<Table> solution_tables(const Solutions& solutions) {
    std::vector<Table> tables = {reference_table(solutions), point_table(solutions), form_table(solutions)};
    tables.push_back(equal_error_table(solutions, true));
    if (tables.back().rows.empty()) {
        tables.pop_back();
    }
    tables.push_back(equal_error_table(solutions, false));
    return tables;
}

} // namespace hybmss::price
