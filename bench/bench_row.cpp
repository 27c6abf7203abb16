#include "bench/bench_row.hpp"

#include "bench/standard_bodies.hpp"
#include "layouts/messages.hpp"
#include "plan/bodies/layout_table.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace hybmss::bench {
namespace {

// One mesh that lives in the first cache and one that does not.
constexpr std::array<std::array<int, 3>, 2> kQuick = {{{10, 10, 10}, {30, 30, 30}}};

} // namespace

std::string name(Model model) {
    switch (model) {
    case Model::without_face_diagonals:
        return "HybMSS-FD";
    case Model::without_correction_forces:
        return "HybMSS-CF";
    case Model::on_means:
        return "HybMSS-M";
    default:
        return "HybMSS";
    }
}

std::string mesh_name(const BenchRow& row) {
    if (row.wall > 0) {
        return "hollow-ball-" + std::to_string(row.mesh[0]);
    }
    return std::to_string(row.mesh[0]) + "x" + std::to_string(row.mesh[1]) + "x" + std::to_string(row.mesh[2]);
}

std::string name(const BenchRow& row, const std::string& operation) {
    const std::string level = row.accuracy == Accuracy::accurate ? "" : std::string(name(row.accuracy)) + "/";
    return operation + "/" + mesh_name(row) + "/" + name(row.model) + "/" + row.layout + "/" +
           std::string(name(row.instruction_set)) + "/" + std::string(name(row.precision)) + "/" + level +
           "threads:" + std::to_string(row.threads);
}

Lattice row_lattice(const BenchRow& row) {
    constexpr double kCellSize = 0.5;
    return row.wall > 0 ? hollow_ball(row.mesh[0], row.wall, kCellSize)
                        : Lattice::box(row.mesh[0], row.mesh[1], row.mesh[2], kCellSize);
}

Material row_material(const BenchRow& row) {
    Material material;
    material.poisson_ratio = 0.499;
    const bool on_means = row.model == Model::on_means;
    material.springs = on_means ? SpringForm::means : SpringForm::nodes;
    material.face_diagonal_ratio = on_means || row.model == Model::without_face_diagonals ? 0.0 : 1.0;
    material.volume_energy =
        row.model == Model::without_correction_forces ? VolumeEnergy::none : VolumeEnergy::quadratic;
    return material;
}

PlanOptions row_options(const BenchRow& row) {
    PlanOptions options;
    options.instruction_set = row.instruction_set;
    options.layout = row.layout == "lattice" || row.layout == "network" ? "" : row.layout;
    options.threads = row.threads;
    options.accuracy = row.accuracy;
    return options;
}

bool is_network(const BenchRow& row) {
    const std::vector<std::string> layouts = network_layouts();
    return row.layout == "network" || std::find(layouts.begin(), layouts.end(), row.layout) != layouts.end();
}

std::vector<std::string> row_layouts() {
    std::vector<std::string> all = {"lattice"};
    for (const std::vector<std::string>& layouts : {lattice_layouts(), network_layouts()}) {
        all.insert(all.end(), layouts.begin(), layouts.end());
    }
    return all;
}

void check_layout(const std::string& layout) {
    const std::vector<std::string> known = row_layouts();
    if (std::find(known.begin(), known.end(), layout) == known.end() && !is_layout(layout, false)) {
        throw std::invalid_argument("--layout " + layout + ": it must be all or one of " + joined(known, ", "));
    }
}

RowChoices RowChoices::with_layouts(std::vector<std::string> otherwise) const {
    RowChoices whole = *this;
    if (whole.layouts.empty()) {
        whole.layouts = std::move(otherwise);
    }
    if (whole.threads.empty()) {
        whole.threads = quick ? std::vector<int>{1} : std::vector<int>{1, 2};
    }
    return whole;
}

std::vector<BenchRow> step_rows(const RowChoices& choices) {
    std::vector<std::array<int, 3>> meshes(kTable6.begin(), kTable6.end());
    std::vector<Model> models = {Model::hybmss, Model::without_face_diagonals, Model::without_correction_forces,
                                 Model::on_means};
    if (choices.quick) {
        meshes.assign(kQuick.begin(), kQuick.end());
        models = {Model::hybmss};
    }
    std::vector<BenchRow> rows;
    const auto append = [&](const BenchRow& row) { rows.push_back(row); };
    for (const auto& mesh : meshes) {
        for (Model model : models) {
            for_rows(choices, mesh, model, 0, append);
        }
    }
    if (!choices.quick) {
        for_rows(choices, {64, 64, 64}, Model::hybmss, 4, append);
    }
    return rows;
}

} // namespace hybmss::bench
