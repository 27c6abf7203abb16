#include "studies/paper/figures.hpp"

#include <algorithm>
#include <cmath>

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

namespace {

constexpr double kRelative = 0.02, kLastDigit = 0.01;

bool is_volume(const Experiment& experiment) {
    return experiment.kind == Kind::compression || experiment.kind == Kind::tension;
}

} // namespace

double printed_quantity(const Experiment& experiment, const Figures& figures) {
    return is_volume(experiment) ? 100 * figures.volume_change : figures.response;
}

bool agree(const Experiment& experiment, double printed, double ours) {
    const double slack = is_volume(experiment) ? kLastDigit : 0;
    return std::abs(printed - ours) <= std::max(slack, kRelative * std::abs(printed));
}

std::optional<Reason> explain(const Experiment& experiment, double printed, const Figures& rest,
                              const std::function<Figures()>& with_e_form,
                              const std::function<std::vector<Motion>()>& motions) {
    const auto is = [&](const Figures& figures, double quantity) {
        return figures.good() && agree(experiment, printed, quantity);
    };
    if (is(rest, printed_quantity(experiment, rest))) {
        return std::nullopt;
    }
    if (!is_volume(experiment) && is(rest, rest.size)) {
        return Reason::size;
    }
    const Figures with_other_springs = with_e_form();
    if (is(with_other_springs, printed_quantity(experiment, with_other_springs))) {
        return Reason::e_form;
    }
    const std::vector<Motion> all = motions();
    const bool swings = std::ranges::any_of(all, [&](const Motion& motion) {
        return motion.failure.empty() && (printed >= motion.least || agree(experiment, printed, motion.least)) &&
               (printed <= motion.greatest || agree(experiment, printed, motion.greatest));
    });
    return swings ? Reason::motion : Reason::unexplained;
}

std::string letter(Reason reason) {
    return {static_cast<char>('a' + static_cast<int>(reason))};
}

std::string explanation(Reason reason) {
    constexpr const char* kTexts[] = {
        "It is the equilibrium of the paper's own energy with springs by the right-hand forms of (5.12), which have G "
        "= 2E/5 for every nu (row \"E-form\"): other moduli than those asked for, unless nu = 1/4.",
        "It is the size of what the plate exerts: of the whole force, its part along the normal too, or of arms times "
        "forces across the axis, node by node. Ours is the part along the motion.",
        "It lies within what the paper's motion swings through in its last two seconds, for one of the dampings and "
        "times of leading tried (table \"motions\"). A wide swing holds many figures: this shows that the print may be "
        "a state of a motion, not that it is.",
        "Unexplained: no equilibrium of either form of the springs, and no motion tried, gives it.",
        "Finite elements: LS-DYNA's elastic law (print; elements not named) and that of St Venant and Kirchhoff "
        "(CalculiX) are different materials at large strain; neo-Hooke is a third, and for nu > 0 nearest to the "
        "print. The latter keeps the volume J as HybMSS does, while St Venant and Kirchhoff keep the trace of Green's "
        "strain."};
    return letter(reason) + ": " + kTexts[static_cast<std::size_t>(reason)];
}

} // namespace hybmss::paper
