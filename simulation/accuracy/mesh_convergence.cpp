#include "simulation/accuracy/mesh_convergence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace hybmss {

std::array<std::int64_t, 3> whole_ratio(const std::array<double, 3>& size) {
    constexpr std::int64_t kMost = 1000;
    constexpr double kRounding = 1e-9;
    const double shortest = *std::min_element(size.begin(), size.end());
    for (std::int64_t across = 1; across <= kMost; ++across) {
        std::array<std::int64_t, 3> whole = {0, 0, 0};
        bool fits = true;
        for (std::size_t a = 0; a < 3; ++a) {
            const double cells = size[a] / shortest * static_cast<double>(across);
            fits = fits && cells < 0.5 + kMost && std::abs(cells - std::round(cells)) <= kRounding * cells;
            whole[a] = fits ? std::llround(cells) : 0;
        }
        if (fits) {
            return whole;
        }
    }
    return {0, 0, 0};
}

MeshFamily::MeshFamily(const Scene& scene) : body_(scene.body) {
    const auto& size = body_.size;
    free_ = size[0] > 0 && body_.cell_size == 0;
    if (free_) {
        unit_ = whole_ratio(size);
        if (unit_[0] == 0) {
            throw scene_error(scene, "body.size",
                              "no cubes of one size fill it: its edges must be in a ratio of whole numbers up to 1000");
        }
        unit_edge_ = size[0] / static_cast<double>(unit_[0]);
        return;
    }
    unit_ = body_.cells;
    unit_edge_ = body_.cell_size;
    if (body_.labels.empty()) {
        own_ = std::gcd(std::gcd(unit_[0], unit_[1]), unit_[2]);
        for (std::int64_t& n : unit_) {
            n /= own_;
        }
        unit_edge_ *= static_cast<double>(own_);
    }
}

std::int64_t MeshFamily::multiple_of(std::int64_t cells_across) const {
    const std::int64_t across = *std::min_element(unit_.begin(), unit_.end());
    return std::max<std::int64_t>(1, (cells_across + across - 1) / across);
}

std::array<std::int64_t, 3> MeshFamily::cells(std::int64_t multiple) const {
    return {unit_[0] * multiple, unit_[1] * multiple, unit_[2] * multiple};
}

SceneBody MeshFamily::body(std::int64_t multiple) const {
    SceneBody body = body_;
    body.cells = cells(multiple);
    body.cell_size = cell_size(multiple);
    if (!body_.labels.empty() && multiple != 1) {
        const auto [nx, ny, nz] = body.cells;
        body.labels.clear();
        body.labels.reserve(static_cast<std::size_t>(nx * ny * nz));
        for (std::int64_t k = 0; k < nz; ++k) {
            for (std::int64_t j = 0; j < ny; ++j) {
                for (std::int64_t i = 0; i < nx; ++i) {
                    const std::int64_t own = i / multiple + unit_[0] * (j / multiple + unit_[1] * (k / multiple));
                    body.labels.push_back(body_.labels[static_cast<std::size_t>(own)]);
                }
            }
        }
    }
    return body;
}

namespace {

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
    const auto& cells = simulation.lattice().cells();
    const double h = simulation.lattice().cell_size(), edge = h * *std::min_element(cells.begin(), cells.end());
    double displacement = 0;
    for (const auto& u : simulation.displacements()) {
        displacement = std::max(displacement, length(u));
    }
    // What is zero by symmetry is rounding on every mesh, and no measure of itself: it is measured by the whole
    // problem's force, the greatest that a probe reads, also by its torque, or that would do the elastic energy's work.
    // Turning a body as it is strains it by about an epsilon of the angle.
    const double epsilon = summary.plan.precision == name(Precision::float32) ? 0x1p-23 : 0x1p-52;
    const double rounding = 4 * epsilon * displacement / edge; // a strain
    const double modulus = simulation.scene().material.young_modulus;
    const double energy = summary.energies.springs + summary.energies.volume;
    double force = modulus * rounding * edge * edge;
    if (displacement > 0) {
        force = std::max(force, 2 * energy / displacement);
    }
    for (const ProbeReading& probe : summary.probes) {
        force = std::max({force, length(probe.force), length(probe.torque) / edge});
    }
    std::vector<ResultFigure> figures;
    const double volume = h * h * h * static_cast<double>(simulation.lattice().cell_count());
    const auto add = [&](std::string name, std::span<const double> v, double least, double whole) {
        const double scale = std::max(length(v), least);
        figures.push_back({std::move(name), {v.begin(), v.end()}, scale, std::max(scale, whole)});
    };
    add("elastic energy", {&energy, 1}, modulus * rounding * rounding * volume, 0);
    add("volume change", {&summary.volume.relative_volume_change, 1}, displacement / edge, 0);
    for (const ProbeReading& probe : summary.probes) {
        const std::string name = "probe " + probe.name + ": ";
        add(name + "force", probe.force, kLeastShare * force, force);
        add(name + "torque", probe.torque, edge * std::max(length(probe.force), kLeastShare * force), edge * force);
        add(name + "mean displacement", probe.mean_displacement, kLeastShare * displacement, displacement);
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

ErrorEstimate estimate_error(std::span<const MeshFigures> meshes, double assumed_order, double wanted, double noise) {
    constexpr double kLow = 0.7, kHigh = 2.2;
    const MeshFigures &fine = meshes[meshes.size() - 1], &coarse = meshes[meshes.size() - 2];
    ErrorEstimate greatest;
    greatest.order = assumed_order;
    greatest.cells = fine.cells;
    for (std::size_t f = 0; f < fine.figures.size(); ++f) {
        const double change = difference(coarse.figures[f], fine.figures[f]);
        if (change * fine.figures[f].scale <= noise * fine.figures[f].whole) {
            continue;
        }
        double order = assumed_order;
        if (meshes.size() > 2) {
            const MeshFigures& coarsest = meshes[meshes.size() - 3];
            // By the scale of the finest: that of a coarse mesh is another one.
            ResultFigure middle = coarse.figures[f];
            middle.scale = fine.figures[f].scale;
            const double observed = order_from(coarsest.cells, coarse.cells, fine.cells,
                                               difference(coarsest.figures[f], middle) / change, kLow, kHigh);
            order = std::isfinite(observed) ? observed : order;
        }
        const double error = change / (std::pow(fine.cells / coarse.cells, order) - 1);
        if (const double cells = fine.cells * std::pow(error / wanted, 1 / order); cells > greatest.cells) {
            greatest.cells = cells;
            greatest.finest = fine.figures[f].name;
        }
        if (error > greatest.error) {
            greatest.error = error;
            greatest.order = order;
            greatest.name = fine.figures[f].name;
        }
    }
    return greatest;
}

double clamped_edge_exponent(double nu) {
    const auto excess = [nu](double lambda) {
        const double s = std::sin(lambda * std::numbers::pi / 2);
        return (3 - 4 * nu) * s * s - 4 * (1 - nu) * (1 - nu) + lambda * lambda;
    };
    double low = 0.3, high = 1; // negative at 0.3; at 1 it is nu's 4 nu - 4 nu^2 >= 0, or there is no singularity
    if (excess(high) <= 0) {
        return 1;
    }
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (excess(middle) < 0 ? low : high) = middle;
    }
    return low;
}

} // namespace hybmss
