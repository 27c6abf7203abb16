#include "studies/price/points.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::price {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kRounds = 3;
constexpr double kQuick = 1; // s

struct WayOnMeshes {
    Way way;
    int largest; ///< cells across, at most; a beam's half as many
};

/// Unless all are asked for, those meshes that take some seconds each.
std::vector<WayOnMeshes> ways(const Extent& extent) {
    std::vector<WayOnMeshes> all;
    const auto add = [&](const Way& way, int usual) {
        all.push_back({way, extent.all ? extent.finest : std::min(usual, extent.finest)});
    };
    for (const paper::Model model :
         {paper::Model::hybmss, paper::Model::hybmss_m, paper::Model::hybmss_fd, paper::Model::hybmss_cf}) {
        const bool whole = model == paper::Model::hybmss;
        for (const Precision precision : {Precision::float64, Precision::float32}) {
            add({{}, Method::static_solve, model, precision}, whole || model == paper::Model::hybmss_m ? 64 : 16);
            add({{}, Method::settling, model, precision}, whole ? 32 : 16);
            if (whole) {
                add({{}, Method::paper_settling, model, precision}, 8);
                add({{}, Method::implicit_settling, model, precision}, 16);
            }
        }
    }
    // Its direct solver takes memory with the fourth power of the cells across: the next mesh needs tens of GB.
    constexpr int kLargestC3D8I = 32, kLargestC3D20 = 16;
    if (extent.calculix) {
        for (const auto& [type, largest] : {std::pair(calculix::ElementType::c3d8i, kLargestC3D8I),
                                            std::pair(calculix::ElementType::c3d20, kLargestC3D20)}) {
            all.push_back({{type}, std::min(extent.all ? largest : largest / 2, extent.finest)});
        }
    }
    return all;
}

Outcome solve(const Way& way, paper::Kind kind, int across) {
    return way.elements ? solve_calculix(kind, across, *way.elements)
                        : solve_lattice(kind, across, way.model, way.method, way.precision);
}

std::vector<double> errors_of(const Outcome& outcome, const Reference& reference, int across) {
    std::vector<double> errors;
    for (std::size_t v = 0; v < outcome.values.size(); ++v) {
        errors.push_back(std::abs(outcome.values[v] / reference.values[v].value - 1));
    }
    FieldError field{kNone, kNone};
    if (across < reference.finest) { // on the reference's own mesh there is nothing between the nodes to compare
        field = field_error(outcome.refined(reference.finest / across), reference.field);
    }
    errors.push_back(field.l2);
    errors.push_back(field.h1);
    return errors;
}

} // namespace

std::string name(const Way& way) {
    return way.elements ? "CalculiX " + std::string(calculix::name(*way.elements)) : std::string(name(way.method));
}

std::vector<std::string> error_names(paper::Kind kind) {
    std::vector<std::string> names;
    for (const Quantity quantity : quantities(kind)) {
        names.emplace_back(name(quantity));
    }
    names.emplace_back("L2");
    names.emplace_back("H1");
    return names;
}

std::vector<Point> measure_points(const Reference& reference, const Extent& extent,
                                  const std::function<void(const std::string&)>& progress) {
    const int share = extent.reference / reference.finest;
    std::vector<Point> points;
    for (int across = 2; across * share <= extent.finest; across *= 2) {
        const std::size_t first = points.size();
        for (const auto& [way, largest] : ways(extent)) {
            if (across * share <= largest) {
                points.push_back({way, reference.kind, across, {}, 0, 0, {}, {}});
            }
        }
        for (int round = 0; round < kRounds; ++round) {
            for (std::size_t p = first; p < points.size(); ++p) {
                Point& point = points[p];
                if (round > 0 && (point.seconds > kQuick || !point.failure.empty())) {
                    continue;
                }
                progress(paper::key(experiment(reference.kind, across)) + ", " + name(point.way));
                const Outcome outcome = solve(point.way, reference.kind, across);
                point.failure = outcome.failure;
                point.steps = outcome.steps;
                point.seconds = round == 0 ? outcome.seconds : std::min(point.seconds, outcome.seconds);
                if (round == 0 && outcome.good()) {
                    point.values = outcome.values;
                    point.errors = errors_of(outcome, reference, across);
                }
            }
        }
    }
    return points;
}

Cost cost_at(const std::vector<Point>& points, const Way& way, std::size_t index, double error) {
    const Point* before = nullptr;
    for (const Point& point : points) {
        if (!(point.way == way) || !point.failure.empty() || !std::isfinite(point.errors[index])) {
            continue;
        }
        if (point.errors[index] <= error) {
            if (before == nullptr) {
                return {static_cast<double>(point.across), point.seconds};
            }
            const double part =
                std::log(before->errors[index] / error) / std::log(before->errors[index] / point.errors[index]);
            return {before->across * std::pow(static_cast<double>(point.across) / before->across, part),
                    before->seconds * std::pow(point.seconds / before->seconds, part)};
        }
        before = &point;
    }
    return {};
}

} // namespace hybmss::price
