#include "studies/paper/printed_figures.hpp"

namespace hybmss::paper {
namespace {

struct Row {
    Kind kind;
    double amount, poisson_ratio;
    PrintedFigures figures;
};

constexpr Row kRows[] = {
    // Table 2
    {Kind::compression, 5, 0, {5.37, 5.61, 5.00}},
    {Kind::compression, 5, 0.25, {3.25, 3.17, 3.10}},
    {Kind::compression, 5, 0.499, {0.00, 0.01, 0.02}},
    {Kind::compression, 20, 0, {23.62, 19.88, 20.00}},
    {Kind::compression, 20, 0.25, {15.99, 13.52, 12.70}},
    {Kind::compression, 20, 0.499, {0.01, 0.00, 0.10}},
    // Table 3
    {Kind::tension, 5, 0, {7.46, 4.40, 5.00}},
    {Kind::tension, 5, 0.25, {0.85, 2.54, 2.61}},
    {Kind::tension, 5, 0.499, {0.00, 0.00, 0.00}},
    {Kind::tension, 20, 0, {24.92, 20.00, 19.99}},
    {Kind::tension, 20, 0.25, {3.15, 8.90, 10.11}},
    {Kind::tension, 20, 0.499, {0.00, 0.00, 0.00}},
    // Table 4
    {Kind::shear, 5, 0.25, {3390, 3396, 3317}},
    {Kind::shear, 20, 0.25, {14662, 14600, 13234}},
    // Table 5: "5 %" and "20 %" without an angle
    {Kind::torsion, 1, 0.25, {1277, 1306, 1279}},
    {Kind::torsion, 45, 0.25, {60005, 60565, 57981}},
};

struct Distance {
    Kind kind;
    double poisson_ratio, meters;
};

constexpr Distance kDistances[] = {{Kind::shear, 0, 0.042},      {Kind::shear, 0.25, 0.013},
                                   {Kind::shear, 0.499, 0.019},  {Kind::torsion, 0, 0.064},
                                   {Kind::torsion, 0.25, 0.030}, {Kind::torsion, 0.499, 0.008}};

} // namespace

std::optional<double> PrintedFigures::of(Model model) const {
    return model == Model::hybmss_fd ? hybmss_fd : model == Model::hybmss ? hybmss : std::nullopt;
}

PrintedFigures printed_figures(const Experiment& experiment) {
    for (const Row& row : kRows) {
        if (row.kind == experiment.kind && row.amount == experiment.amount &&
            row.poisson_ratio == experiment.poisson_ratio) {
            return row.figures;
        }
    }
    return {};
}

std::optional<double> printed_distance(const Experiment& experiment) {
    for (const Distance& distance : kDistances) {
        if (distance.kind == experiment.kind && distance.poisson_ratio == experiment.poisson_ratio) {
            return distance.meters;
        }
    }
    return std::nullopt;
}

} // namespace hybmss::paper
