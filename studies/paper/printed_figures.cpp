#include "studies/paper/figures.hpp"

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

bool agree(const Experiment& experiment, double printed, double ours) {
    const double slack = is_volume(experiment) ? kLastDigit : 0;
    return std::abs(printed - ours) <= std::max(slack, kRelative * std::abs(printed));
}

const char* explanation(Reason reason) {
    switch (reason) {
    case Reason::unbounded:
        return "No equilibrium: at nu = 0 the volume modulus kappa is negative, and a lattice without face diagonals "
               "that has wrinkled, or on means is twisted far, gives energy away without end. The print's figure is a "
               "state of a motion.";
    case Reason::wrinkles:
        return "Without face diagonals the lattice wrinkles: it has several equilibria, and the way there decides "
               "which "
               "is found.";
    case Reason::other_energy:
        return "Below nu = 1/4 the print's energy kappa V0 (J - 1)^2 / 2 has no lower bound; ours is the mean-stretch "
               "energy, with the same moduli at small strain. The rows \"(J - 1)^2\" are the equilibria of the print's "
               "own energy; where they differ from its HybMSS rows too, those are no equilibria.";
    case Reason::incompressible:
        return "Near nu = 1/2 all of e is the small rest that kappa leaves. As printed, (5.16) lacks the factor 1/4, "
               "so that the volume force would be four times the gradient of its energy: the rows \"4 kappa\" are the "
               "equilibria under that force, with about a quarter of e.";
    case Reason::motion:
        return "The print's figure is what the plate feels after 10 s of motion in 10,000 steps, whose damping it does "
               "not give; ours is the force at rest.";
    case Reason::law:
        return "Finite elements: LS-DYNA's elastic law (print; elements not named) and that of St Venant and Kirchhoff "
               "(CalculiX) are different materials at large strain; neo-Hooke is a third, and for nu > 0 nearest to "
               "the print. "
               "The latter keeps the volume J as HybMSS "
               "does, while St Venant and Kirchhoff keep the trace of Green's strain.";
    }
    return "";
}

std::string letter(Reason reason) {
    return {static_cast<char>('a' + static_cast<int>(reason))};
}

} // namespace

double printed_quantity(const Experiment& experiment, const Figures& figures) {
    return is_volume(experiment) ? 100 * figures.volume_change : figures.response;
}

std::string Difference::text() const {
    if (reasons.empty()) {
        return compared ? "agrees" : "not printed";
    }
    std::string text;
    for (const Reason reason : reasons) {
        text += text.empty() ? "" : ", ";
        text += letter(reason);
    }
    return text;
}

Difference difference(const Experiment& experiment, Model model, std::optional<double> printed, const Figures& ours) {
    Difference found;
    if (!ours.good()) {
        found.reasons.push_back(Reason::unbounded);
        return found;
    }
    found.compared = printed.has_value();
    if (!printed || agree(experiment, *printed, printed_quantity(experiment, ours))) {
        return found;
    }
    if (model == Model::hybmss_fd) {
        found.reasons.push_back(Reason::wrinkles);
    }
    if (experiment.poisson_ratio < 0.25) {
        found.reasons.push_back(Reason::other_energy);
    } else if (experiment.poisson_ratio > 0.25) {
        found.reasons.push_back(Reason::incompressible);
    } else if (model == Model::hybmss) {
        found.reasons.push_back(Reason::motion);
    }
    return found;
}

void compare_finite_elements(const Experiment& experiment, std::optional<double> printed, const Figures& calculix,
                             Difference& difference) {
    if (printed && calculix.good() && !agree(experiment, *printed, printed_quantity(experiment, calculix))) {
        difference.reasons.push_back(Reason::law);
    }
}

std::vector<std::string> explanations(const std::set<Reason>& reasons) {
    std::vector<std::string> lines;
    for (const Reason reason : reasons) {
        lines.push_back(letter(reason) + ": " + explanation(reason));
    }
    return lines;
}

} // namespace hybmss::paper
