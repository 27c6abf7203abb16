#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"

#include "layouts/messages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

void check_shape(const std::array<int, 3>& cells, double cell_size) {
    for (int n : cells) {
        if (n < 1) {
            throw std::invalid_argument("cells = [" + std::to_string(cells[0]) + ", " + std::to_string(cells[1]) +
                                        ", " + std::to_string(cells[2]) +
                                        "] is not allowed: each count must be at least 1");
        }
    }
    // Node numbers are 32 bits wide, and sums of their strides must fit too.
    const double nodes = (cells[0] + 1.0) * (cells[1] + 1.0) * (cells[2] + 1.0);
    if (nodes > Lattice::kMostNodes) {
        throw std::invalid_argument("cells make " + std::to_string(nodes) + " grid nodes: at most 1e9 are allowed");
    }
    // Its cube must leave masses and volumes finite in float.
    if (!(cell_size >= 1e-9 && cell_size <= 1e9)) {
        refuse_value("cell_size", cell_size, "at least 1e-9 and at most 1e9 m");
    }
}

void require_one_a_cell(const char* what, std::size_t given, std::size_t cells) {
    if (given != cells) {
        throw std::invalid_argument(std::string(what) + ": " + std::to_string(given) + " values given, " +
                                    std::to_string(cells) + " needed (nx * ny * nz)");
    }
}

void check_scale(float scale) {
    if (!(scale >= 0) || !std::isfinite(scale)) {
        throw std::invalid_argument("cell scale = " + std::to_string(scale) +
                                    " is not allowed: it must be finite and at least 0");
    }
}

void check_fill(float fill, std::size_t cell) {
    if (!(fill > 0) || !std::isfinite(fill)) {
        throw std::invalid_argument("fill = " + std::to_string(fill) + " of cell " + std::to_string(cell) +
                                    " is not allowed: where there is a cell it must be finite and above 0");
    }
}

} // namespace

Lattice::Lattice(std::array<int, 3> cells, double cell_size, std::vector<float> scales)
    : cells_(cells), cell_size_(cell_size), scales_(std::move(scales)) {}

Lattice Lattice::box(int nx, int ny, int nz, double cell_size) {
    check_shape({nx, ny, nz}, cell_size);
    const auto count = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
    return Lattice({nx, ny, nz}, cell_size, std::vector<float>(count, 1.0f));
}

Lattice Lattice::from_cells(int nx, int ny, int nz, double cell_size, std::vector<float> scales) {
    check_shape({nx, ny, nz}, cell_size);
    const auto count = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
    require_one_a_cell("cell scales", scales.size(), count);
    for (float scale : scales) {
        check_scale(scale);
    }
    return Lattice({nx, ny, nz}, cell_size, std::move(scales));
}

Lattice Lattice::from_materials(int nx, int ny, int nz, double cell_size, std::span<const std::uint8_t> labels,
                                std::span<const Material> materials, std::span<const float> fills) {
    const auto refuse = [](std::size_t number, const std::string& why) {
        throw std::invalid_argument("material " + std::to_string(number) + " of a lattice: " + why);
    };
    std::vector<float> scale_of = {0};
    std::vector<Tissue> tissues;
    std::vector<std::uint8_t> tissue_of = {0};
    for (std::size_t m = 0; m < materials.size(); ++m) {
        const Material &own = materials[m], &body = materials[0];
        validate(own);
        Material alike = body;
        alike.young_modulus = own.young_modulus;
        alike.poisson_ratio = own.poisson_ratio;
        alike.density = own.density;
        if (!(own == alike)) {
            refuse(m + 1, "only young_modulus, poisson_ratio and density may differ from those of the first");
        }
        // The ratio of the shear moduli; that of Young's moduli, bit for bit, where Poisson's ratio is the same.
        scale_of.push_back(static_cast<float>(own.young_modulus / body.young_modulus *
                                              ((1 + body.poisson_ratio) / (1 + own.poisson_ratio))));
        const Tissue tissue = {own.poisson_ratio, own.density};
        std::size_t number = 0;
        if (tissue != Tissue{body.poisson_ratio, body.density}) {
            const auto known = std::find(tissues.begin(), tissues.end(), tissue);
            number = 1 + static_cast<std::size_t>(known - tissues.begin());
            if (known == tissues.end()) {
                tissues.push_back(tissue);
            }
        }
        tissue_of.push_back(static_cast<std::uint8_t>(number));
    }
    if (!fills.empty()) {
        require_one_a_cell("fills", fills.size(), labels.size());
    }
    std::vector<float> scales;
    std::vector<std::uint8_t> numbers;
    scales.reserve(labels.size());
    numbers.reserve(labels.size());
    for (std::size_t cell = 0; cell < labels.size(); ++cell) {
        const std::uint8_t label = labels[cell];
        if (label > materials.size()) {
            refuse(label, "none given, but a cell has this label");
        }
        scales.push_back(fills.empty() ? scale_of[label] : scale_of[label] * fills[cell]);
        numbers.push_back(tissue_of[label]);
    }
    Lattice lattice = from_cells(nx, ny, nz, cell_size, std::move(scales));
    if (!tissues.empty()) {
        lattice.set_tissues(std::move(tissues), std::move(numbers));
    }
    lattice.set_fills({fills.begin(), fills.end()});
    return lattice;
}

void Lattice::set_tissues(std::vector<Tissue> tissues, std::vector<std::uint8_t> of_cells) {
    if (of_cells.size() != scales_.size() && !(of_cells.empty() && tissues.empty())) {
        throw std::invalid_argument("tissues: " + std::to_string(of_cells.size()) + " numbers given for " +
                                    std::to_string(scales_.size()) + " cells");
    }
    for (const Tissue& tissue : tissues) {
        validate(Material{.poisson_ratio = tissue.poisson_ratio, .density = tissue.density});
    }
    for (const std::uint8_t number : of_cells) {
        if (number > tissues.size()) {
            throw std::invalid_argument("tissue " + std::to_string(number) + " of a cell: only " +
                                        std::to_string(tissues.size()) + " given");
        }
    }
    tissues_ = std::move(tissues);
    tissue_of_ = std::move(of_cells);
}

void Lattice::set_fills(std::vector<float> fills) {
    if (!fills.empty()) {
        require_one_a_cell("fills", fills.size(), scales_.size());
    }
    for (std::size_t cell = 0; cell < fills.size(); ++cell) {
        if (scales_[cell] > 0) {
            check_fill(fills[cell], cell);
        }
    }
    fills_ = std::move(fills);
}

std::size_t Lattice::cell_index(int i, int j, int k) const {
    if (i < 0 || j < 0 || k < 0 || i >= cells_[0] || j >= cells_[1] || k >= cells_[2]) {
        throw std::invalid_argument("cell (" + std::to_string(i) + ", " + std::to_string(j) + ", " + std::to_string(k) +
                                    ") is outside the lattice");
    }
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(cells_[0]) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(cells_[1]) * static_cast<std::size_t>(k));
}

void Lattice::set_cell_scale(int i, int j, int k, float scale) {
    check_scale(scale);
    const std::size_t cell = cell_index(i, j, k);
    if (scale > 0) {
        check_fill(cell_fill(cell), cell);
    }
    scales_[cell] = scale;
}

void Lattice::remove_cells(std::span<const std::array<int, 3>> cells) {
    for (const auto& [i, j, k] : cells) {
        scales_[cell_index(i, j, k)] = 0.0f;
    }
}

std::size_t Lattice::grid_node_count() const {
    return (static_cast<std::size_t>(cells_[0]) + 1) * (static_cast<std::size_t>(cells_[1]) + 1) *
           (static_cast<std::size_t>(cells_[2]) + 1);
}

std::size_t Lattice::grid_node_index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           (static_cast<std::size_t>(cells_[0]) + 1) *
               (static_cast<std::size_t>(j) + (static_cast<std::size_t>(cells_[1]) + 1) * static_cast<std::size_t>(k));
}

std::vector<std::uint32_t> Lattice::nodes() const {
    std::vector<char> used(grid_node_count(), 0);
    std::size_t cell = 0;
    for (int k = 0; k < cells_[2]; ++k) {
        for (int j = 0; j < cells_[1]; ++j) {
            for (int i = 0; i < cells_[0]; ++i, ++cell) {
                if (scales_[cell] > 0) {
                    for (int corner = 0; corner < 8; ++corner) {
                        used[grid_node_index(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2))] = 1;
                    }
                }
            }
        }
    }
    std::vector<std::uint32_t> nodes;
    for (std::size_t n = 0; n < used.size(); ++n) {
        if (used[n]) {
            nodes.push_back(static_cast<std::uint32_t>(n));
        }
    }
    return nodes;
}

std::array<double, 3> Lattice::rest_position(std::size_t grid_node) const {
    const auto row = static_cast<std::size_t>(cells_[0]) + 1;
    const auto rows = static_cast<std::size_t>(cells_[1]) + 1;
    return {static_cast<double>(grid_node % row) * cell_size_, static_cast<double>(grid_node / row % rows) * cell_size_,
            static_cast<double>(grid_node / row / rows) * cell_size_};
}

std::size_t Lattice::cell_count() const {
    std::size_t count = 0;
    for (float scale : scales_) {
        count += scale > 0;
    }
    return count;
}

SpringCounts Lattice::merged_springs(bool face_diagonals) const {
    const auto filled = [&](int i, int j, int k) {
        return i >= 0 && j >= 0 && k >= 0 && i < cells_[0] && j < cells_[1] && k < cells_[2] &&
               scales_[cell_index(i, j, k)] > 0;
    };
    // An edge or a face has springs where one of the cells around it is filled.
    SpringCounts counts;
    for (int k = 0; k <= cells_[2]; ++k) {
        for (int j = 0; j <= cells_[1]; ++j) {
            for (int i = 0; i <= cells_[0]; ++i) {
                const bool c = filled(i, j, k), x = filled(i - 1, j, k), y = filled(i, j - 1, k),
                           z = filled(i, j, k - 1);
                counts.edges += c || y || z || filled(i, j - 1, k - 1);
                counts.edges += c || x || z || filled(i - 1, j, k - 1);
                counts.edges += c || x || y || filled(i - 1, j - 1, k);
                counts.face_diagonals +=
                    face_diagonals ? 2u * (static_cast<unsigned>(c || x) + (c || y) + (c || z)) : 0u;
                counts.cube_diagonals += c ? 4 : 0;
            }
        }
    }
    return counts;
}

SpringCounts Lattice::unmerged_springs(bool face_diagonals) const {
    SpringCounts counts = merged_springs(false);
    counts.face_diagonals = face_diagonals ? 12 * cell_count() : 0;
    return counts;
}

Material material_of(const Lattice& lattice, std::size_t tissue, const Material& material) {
    Material own = material;
    if (tissue > 0) {
        const Tissue& given = lattice.tissues()[tissue - 1];
        own.poisson_ratio = given.poisson_ratio;
        own.density = given.density;
        own.young_modulus = 2 * (1 + given.poisson_ratio) * shear_modulus(material);
    }
    return own;
}

namespace {

bool same_poisson_ratio(const Lattice& lattice, const Material& material) {
    return std::all_of(lattice.tissues().begin(), lattice.tissues().end(),
                       [&](const Tissue& tissue) { return tissue.poisson_ratio == material.poisson_ratio; });
}

} // namespace

bool has_own_volumes(const Lattice& lattice, const Material& material) {
    return material.volume_energy != VolumeEnergy::none && !same_poisson_ratio(lattice, material);
}

void validate(const Lattice& lattice, const Material& material) {
    validate(material);
    if (material.springs == SpringForm::means && !same_poisson_ratio(lattice, material)) {
        throw std::invalid_argument(
            "a tissue with a poisson_ratio of its own given for springs on means: these take one in all cells");
    }
}

SpringCounts springs_of(const Lattice& lattice, const Material& material) {
    const bool face_diagonals = material.face_diagonal_ratio > 0;
    if (material.springs == SpringForm::nodes) {
        return lattice.merged_springs(face_diagonals);
    }
    const std::size_t cells = lattice.cell_count();
    return {3 * cells, face_diagonals ? 6 * cells : 0, 4 * cells};
}

} // namespace hybmss
