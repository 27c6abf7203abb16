#include "simulation/accuracy/error_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss {
namespace {

constexpr double kLeastShare = 0.01;

double length(std::span<const double> v) {
    double sum = 0;
    for (const double x : v) {
        sum += x * x;
    }
    return std::sqrt(sum);
}

double difference(const ResultFigure& a, const ResultFigure& b) {
    std::vector<double> d = b.values;
    for (std::size_t i = 0; i < d.size(); ++i) {
        d[i] -= a.values[i];
    }
    return b.scale > 0 ? length(d) / b.scale : 0;
}

/// p in (h1^p - h2^p) / (h2^p - h3^p) = ratio, or nothing (NaN) outside [low, high]. The left side grows with p.
double order_from(double n1, double n2, double n3, double ratio, double low, double high) {
    const auto left = [=](double p) {
        return (std::pow(n1, -p) - std::pow(n2, -p)) / (std::pow(n2, -p) - std::pow(n3, -p));
    };
    if (!(ratio >= left(low) && ratio <= left(high))) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    for (int i = 0; i < 50; ++i) {
        const double middle = (low + high) / 2;
        (left(middle) < ratio ? low : high) = middle;
    }
    return low;
}

} // namespace

std::vector<ResultFigure> result_figures(const Simulation& simulation, const Summary& summary) {
    double displacement = 0, force = 0;
    for (const auto& u : simulation.displacements()) {
        displacement = std::max(displacement, length(u));
    }
    for (const ProbeReading& probe : summary.probes) {
        force = std::max(force, length(probe.force));
    }
    const auto& cells = simulation.lattice().cells();
    const double edge = simulation.lattice().cell_size() * *std::min_element(cells.begin(), cells.end());
    std::vector<ResultFigure> figures;
    const double energy = summary.energies.springs + summary.energies.volume;
    figures.push_back({"elastic energy", {energy}, std::abs(energy)});
    const double change = summary.volume.relative_volume_change;
    figures.push_back({"volume change", {change}, std::max(change, displacement / edge)});
    for (const ProbeReading& probe : summary.probes) {
        const auto add = [&](const char* what, const std::array<double, 3>& v, double least) {
            figures.push_back({"probe " + probe.name + ": " + what, {v.begin(), v.end()}, std::max(length(v), least)});
        };
        add("force", probe.force, kLeastShare * force);
        add("torque", probe.torque, length(probe.force) * edge);
        add("mean displacement", probe.mean_displacement, kLeastShare * displacement);
    }
    return figures;
}

double greatest_difference(std::span<const ResultFigure> a, std::span<const ResultFigure> b, std::string* name) {
    double greatest = 0;
    for (std::size_t f = 0; f < b.size(); ++f) {
        const double d = difference(a[f], b[f]);
        if (d > greatest) {
            greatest = d;
            if (name != nullptr) {
                *name = b[f].name;
            }
        }
    }
    return greatest;
}

ErrorEstimate estimate_error(std::span<const MeshFigures> meshes, double assumed_order, double wanted) {
    constexpr double kLow = 0.7, kHigh = 2.2;
    const MeshFigures &fine = meshes[meshes.size() - 1], &coarse = meshes[meshes.size() - 2];
    ErrorEstimate greatest;
    greatest.order = assumed_order;
    greatest.cells = fine.cells;
    for (std::size_t f = 0; f < fine.figures.size(); ++f) {
        const double change = difference(coarse.figures[f], fine.figures[f]);
        double order = assumed_order;
        if (meshes.size() > 2 && change > 0) {
            const MeshFigures& coarsest = meshes[meshes.size() - 3];
            // By the scale of the finest: that of a coarse mesh is another one.
            ResultFigure middle = coarse.figures[f];
            middle.scale = fine.figures[f].scale;
            const double observed = order_from(coarsest.cells, coarse.cells, fine.cells,
                                               difference(coarsest.figures[f], middle) / change, kLow, kHigh);
            order = std::isfinite(observed) ? observed : order;
        }
        const double error = change / (std::pow(fine.cells / coarse.cells, order) - 1);
        greatest.cells = std::max(greatest.cells, fine.cells * std::pow(error / wanted, 1 / order));
        if (error > greatest.error) {
            greatest.error = error;
            greatest.order = order;
            greatest.name = fine.figures[f].name;
        }
    }
    return greatest;
}

} // namespace hybmss
