#include "studies/price/reference.hpp"

#include "simulation/run/clamped_edge.hpp"

#include <cmath>
#include <stdexcept>

namespace hybmss::price {
namespace {

double order_of(double coarse_change, double fine_change, double expected) {
    const double order = std::log2(std::abs(coarse_change / fine_change));
    return coarse_change * fine_change > 0 && order > 0.5 && order < 4 ? order : expected;
}

double share(double order) {
    return 1 / (std::exp2(order) - 1);
}

double limit(double coarse, double middle, double fine, double expected, double& order) {
    order = order_of(middle - coarse, fine - middle, expected);
    return fine + share(order) * (fine - middle);
}

/// The finest field with what is still missing added; that is known on every other node, and smooth.
GridField limit(const GridField& coarse, const GridField& middle, const GridField& fine, double expected) {
    const auto size = [](const GridField& a, const GridField& b) { return field_error(a, b).l2; };
    const double order = order_of(size(coarse, middle.coarsened(2)), size(middle, fine.coarsened(2)), expected);
    const GridField missing = combined(share(order), fine.coarsened(2), -share(order), middle);
    return combined(1, fine, 1, missing.refined(2));
}

} // namespace

Extrapolation extrapolate(const std::vector<double>& q, double expected_order) {
    if (q.size() != 4) {
        throw std::invalid_argument("extrapolate: " + std::to_string(q.size()) + " values; four are needed");
    }
    Extrapolation result;
    double coarse_order = 0;
    const double before = limit(q[0], q[1], q[2], expected_order, coarse_order);
    result.value = limit(q[1], q[2], q[3], expected_order, result.order);
    result.uncertainty = std::abs(before / result.value - 1);
    return result;
}

Reference make_reference(paper::Kind kind, int finest, const std::function<void(const std::string&)>& progress) {
    Reference reference;
    reference.kind = kind;
    reference.finest = finest;
    reference.expected_order = 2 * clamped_edge_exponent(experiment(kind, finest).poisson_ratio);
    for (int across = finest / 8; across <= finest; across *= 2) {
        progress(paper::key(experiment(kind, across)) + " for the reference");
        Outcome outcome = solve_lattice(kind, across, paper::Model::hybmss, Method::static_solve, Precision::float64);
        if (!outcome.good()) {
            throw std::runtime_error(paper::key(experiment(kind, across)) + ": " + outcome.failure);
        }
        reference.solutions[across] = std::move(outcome);
    }
    for (std::size_t v = 0; v < quantities(kind).size(); ++v) {
        std::vector<double> values;
        for (const auto& [across, outcome] : reference.solutions) {
            values.push_back(outcome.values[v]);
        }
        reference.values.push_back(extrapolate(values, reference.expected_order));
    }
    const auto field = [&](int part) -> const GridField& { return reference.solutions.at(finest / part).field; };
    reference.field = limit(field(4), field(2), field(1), reference.expected_order);
    const GridField before = limit(field(8), field(4), field(2), reference.expected_order);
    reference.field_uncertainty = field_error(before, reference.field.coarsened(2)).l2;
    return reference;
}

} // namespace hybmss::price
