#include "app/verify/verify.hpp"

#include "hybmss/plan_options.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss::verify {
namespace {

// Each is two to three times the worst that several seeds showed on SSE2, AVX2 and AVX-512, at all levels.
struct Tolerance {
    const char* check;
    double epsilons;
    const char* reason;
    double of_forces = 0; ///< how many times the error of forces adds to it
};

constexpr double kProducts = 5;
constexpr double kForces = 5, kCrushedForces = 25, kPositionForces = 25;
constexpr double kStepsOfForces = 4;
constexpr double kFloatEnergy = 10, kDoubleEnergy = 32;

constexpr Tolerance kProperties[] = {
    {"instruction set", 0, "the plan says that the forced set runs, in the layout and precision asked for"},
    {"adds to what is there", 6,
     "as for forces, but onto values of up to twice the force scale, whose own last bit the sum loses", 1},
    {"leaves padding alone", 0, "the fourth component of a stride of 4 is neither read nor written"},
    {"coincident nodes", 0, "two ends at one point, then the whole body at one point: forces and energy are finite"},
    {"total force", 1.5, "of a free body, over the sum of all nodes' force scales: errors of random sign average out"},
    {"total torque", 1.5, "likewise, about the origin"},
    {"skin", 6,
     "vertices in cells at a strain of 0.1: their distance over that from the grid's corner, or the normal's error"},
    {"actuation", 40,
     "all cells grown by 0.75, against a lattice of such cells at a strain of 0.1: over the sums of magnitudes of the\n"
     "    body as it was made, which cancel; displacements of many cells have fewer digits",
     1},
    {"relaxation", 15,
     "forces of cells that remember, at a strain of 0.1 and a step later, against their mean gradients one by one: "
     "over\n"
     "    the sums of magnitudes of a node's stresses"},
    {"stress", 40,
     "at strains of 0.001 and 0.1: volume times stress of all cells less the forces times the nodes' places, over the\n"
     "    sum of its magnitudes; and the cells' energies over the body's"},
    {"rigid motion", 3,
     "translation by 128 to 1024 cells, a quarter turn, a slanted turn: against the force scale of the slanted turn"},
    {"hessian diagonal", 5,
     "max norm of a node's block less the reference's over the greatest norm of any block, at strains of 0.001 and "
     "0.1"},
    {"spring damping", 3,
     "at a strain of 0.1, velocities of up to a cell a second: over the greatest of any node's sums of magnitudes"},
    {"critical time step", 8, "excess over 2 / sqrt(largest eigenvalue of M^-1 K), found by power iteration"},
    {"one-tile steps", 50, "as the last, with the body in one tile", kStepsOfForces},
    {"side by side", 50, "likewise, of bodies in the lanes of vectors", kStepsOfForces},
    {"damped steps", 50, "likewise, with damping along the springs", kStepsOfForces},
    {"50 free steps", 50, "likewise, without gravity, damping and prescribed nodes", kStepsOfForces},
    {"50 driven steps", 50,
     "displacements, velocities and kinetic energy over the greatest of the run: roundings of 50\n    steps add up, "
     "and oscillations that started a little apart drift apart",
     kStepsOfForces},
};

/// Variants of hand-made networks say so.
bool is_network_of_lattice(const RowKey& key) {
    const std::vector<std::string> networks = network_layouts();
    return std::find(networks.begin(), networks.end(), key.layout) != networks.end() &&
           !key.variant.starts_with("network");
}

/// What the estimates of the level `fast` add to the error of forces.
double estimates(const RowKey& key) {
    const auto bound = [&](Accuracy accuracy) { return force_error_bound(accuracy, parse_precision(key.precision)); };
    return (bound(key.accuracy) - bound(Accuracy::accurate)) / epsilon(key.precision);
}

double forces_tolerance(const RowKey& key) {
    if (key.strain >= 0.5) {
        return kCrushedForces;
    }
    return key.precision == "double" && is_network_of_lattice(key) ? kPositionForces : kForces;
}

} // namespace

double tolerance(const RowKey& key) {
    if (key.check == "forces") {
        return forces_tolerance(key) + estimates(key);
    }
    if (key.check == "hessian product" || key.check == "hessian diagonal") {
        return key.precision == "double" && is_network_of_lattice(key) ? kPositionForces : kProducts;
    }
    if (key.check == "energy") {
        return key.precision == "float" ? kFloatEnergy : kDoubleEnergy;
    }
    for (const Tolerance& property : kProperties) {
        if (key.check == property.check) {
            return property.epsilons + property.of_forces * estimates(key);
        }
    }
    return 0; // an unknown check has no excuse for any error
}

std::vector<std::string> tolerance_legend() {
    std::vector<std::string> legend = {
        "Limits are two to three times the worst error seen with several seeds.",
        "forces: max norm of f - f_ref over the greatest force scale of any node: the sum of the magnitudes of the "
        "forces\n"
        "    that meet there, with what cancels inside each taken by absolute value. That is what rounding is relative "
        "to, at\n"
        "    any strain, since 1 - l/|d| and J - 1 are computed without cancellation. So one small multiple of epsilon "
        "(5)\n"
        "    holds from a strain of 1e-7 on: it pays for the rounded constants and about 30 additions a node.",
        "forces, level fast: what the processor's estimates may be wrong by comes on top, 2^-10 in float and 2^-13 in "
        "double\n"
        "    (force_error_bound() in hybmss/accuracy.hpp); in 50 steps four times as much. The other properties and "
        "second\n"
        "    derivatives have no such excuse.",
        "forces at strain 0.5 (25): springs are crushed nearly to points. An error of one epsilon in |d|^2/l^2 turns "
        "into\n"
        "    (l/|d|)^2 of it in the force, while the scale grows by l/|d| alone; the shortest of 10^5 springs has "
        "l/|d| of 50.",
        "forces, double, a lattice in a network's layout (25): a network takes its cells' rest edges as differences of "
        "rest positions, "
        "which\n"
        "    are rounded: near the far end of 96 cells that alone is some ten epsilons of an edge. Float takes no "
        "harm.",
        "hessian product (5): max norm of K p - (K p)_ref for a random p, over the greatest scale of any node: what "
        "rounding\n"
        "    u and d once changes K p by, added up in magnitude. It knows how ill-conditioned a crushed spring is, so "
        "one "
        "limit\n"
        "    holds at any strain; double on the layout network (25) as for forces.",
        "energy: |error of the springs' energy| + |error of the volume energy| over the sum of both magnitudes. Float "
        "(10):\n"
        "    roundings of one term, since all terms are summed in double; double (32): the summing itself, a random "
        "walk of\n"
        "    thousands of additions."};
    for (const Tolerance& property : kProperties) {
        legend.push_back(std::string(property.check) + ": " + property.reason + ".");
    }
    return legend;
}

Row& RowTable::row_of(const RowKey& key) {
    const auto [place, is_new] = places_.emplace(key, rows_.size());
    return is_new ? rows_.emplace_back(Row{key, 0, 0, tolerance(key), ""}) : rows_[place->second];
}

void RowTable::record(const RowKey& key, double error, const std::string& body) {
    Row& row = row_of(key);
    const double bounded = std::isnan(error) ? std::numeric_limits<double>::infinity() : error / epsilon(key.precision);
    if (row.cases == 0 || bounded > row.error) {
        row.error = bounded;
        row.worst_body = body;
    }
    ++row.cases;
}

void RowTable::append(const RowTable& later) {
    for (const Row& other : later.rows_) {
        Row& row = row_of(other.key);
        if (row.cases == 0 || other.error > row.error) {
            row.error = other.error;
            row.worst_body = other.worst_body;
        }
        row.cases += other.cases;
    }
}

double epsilon(const std::string& precision) {
    return precision == "float" ? static_cast<double>(std::numeric_limits<float>::epsilon())
                                : std::numeric_limits<double>::epsilon();
}

} // namespace hybmss::verify
