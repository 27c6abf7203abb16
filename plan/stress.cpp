#include "hybmss/stress.hpp"

#include "kernels/kernel_table.hpp"
#include "layouts/node_numbers.hpp"
#include "plan/bodies/field_checks.hpp"
#include "plan/threads/workers.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {
namespace {

/// So many cells are computed at a time: what they are made of is put down once, and stays in the caches.
constexpr std::size_t kCellsAPiece = 256;
static_assert(kCellsAPiece % kernels::kMaxWidth == 0); // so that pieces end where vectors do

template <class T>
void point(kernels::StressCells<T>& cells, const StressArrays<T>& into, std::size_t first) {
    const auto set = [&](int value, T* array) { cells.values[value] = array ? array + first : nullptr; };
    for (int i = 0; i < 9; ++i) {
        set(kernels::kStressPiola + i, into.first_piola[static_cast<std::size_t>(i)]);
    }
    for (int s = 0; s < 6; ++s) {
        set(kernels::kStressCauchy + s, into.cauchy[static_cast<std::size_t>(s)]);
        set(kernels::kStressGreen + s, into.green_strain[static_cast<std::size_t>(s)]);
    }
    set(kernels::kStressVolumeRatio, into.volume_ratio);
    set(kernels::kStressEnergy, into.energy_density);
    set(kernels::kStressVonMises, into.von_mises);
    set(kernels::kStressPressure, into.pressure);
}

} // namespace

double CellStress::pressure() const {
    return -(cauchy[0] + cauchy[1] + cauchy[2]) / 3;
}

double CellStress::von_mises() const {
    const auto& [xx, yy, zz, xy, yz, xz] = cauchy;
    const double p = xx - yy, q = yy - zz, r = zz - xx;
    return std::sqrt(0.5 * (p * p + q * q + r * r) + 3 * (xy * xy + yz * yz + xz * xz));
}

struct StressMeter::Implementation {
    Implementation(const Lattice& lattice, const Material& material,
                   std::span<const std::array<std::uint32_t, 8>> cells_of_body, std::size_t node_count,
                   const PlanOptions& options)
        : nodes(node_count), cells(cells_of_body.size()), cell_size(lattice.cell_size()),
          set(resolve(options.instruction_set)), accuracy(options.accuracy),
          workers(useful_threads(options, node_count), options.task_runner) {
        validate(lattice, material);
        const SpringConstants k = spring_constants(material, cell_size);
        springs = {k.edge / cell_size, k.face_diagonal / cell_size, k.cube_diagonal / cell_size};
        pattern = pattern_constants(material, cell_size);
        on_means = material.springs == SpringForm::means;
        stiffening = material.stiffening;
        crush = crush_modulus(material);
        crush_bound = crush > 0 ? material.crush.ratio - 1 : -1e30;
        for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
            const Material own = material_of(lattice, tissue, material);
            const VolumeEnergy energy = resolved_volume_energy(own);
            const double kappa = energy == VolumeEnergy::none ? 0 : volume_modulus(own);
            volumes.push_back(energy == VolumeEnergy::quadratic ? std::array{kappa, 0.0} : std::array{0.0, kappa});
        }
        for (std::size_t cell = 0; cell < lattice.cell_scales().size(); ++cell) {
            if (lattice.cell_scales()[cell] > 0) {
                scales.push_back(static_cast<double>(lattice.cell_scales()[cell]) /
                                 static_cast<double>(lattice.cell_fill(cell))); // of what fills it
                tissues.push_back(static_cast<std::uint8_t>(lattice.cell_tissue(cell)));
            }
        }
        if (scales.size() != cells) {
            throw std::invalid_argument("cells: " + std::to_string(cells) + " given, the lattice has " +
                                        std::to_string(scales.size()));
        }
        for (std::size_t c = 0; c < 8; ++c) {
            corners[c].resize(cells + kernels::kMaxWidth, 0); // the last ones are read with others beside
            for (std::size_t n = 0; n < cells; ++n) {
                corners[c][n] = static_cast<std::int32_t>(cells_of_body[n][c]);
            }
        }
        in_a_row.assign(cells, 1);
        for (std::size_t n = cells; n-- > 1;) {
            const auto next = [n](const auto& of) { return of[n] == of[n - 1] + 1; };
            if (std::all_of(std::begin(corners), std::end(corners), next)) {
                in_a_row[n - 1] = static_cast<std::uint8_t>(std::min(in_a_row[n] + 1, 255));
            }
        }
    }

    /// take(piece's first cell, how many, the cells with their kernel) of all cells, side by side: it says where values
    /// go and calls the kernel.
    template <class T, class Take>
    void read(const VectorField<const T>& displacement, const Take& take) const {
        const kernels::KernelTable<T>& table = kernels::kernel_table<T>(set, accuracy);
        // By the cell size, in arrays of their own.
        const std::unique_ptr<T[]> memory(new T[3 * nodes]); // not set to zero first
        const std::array<T*, 3> u = {memory.get(), memory.get() + nodes, memory.get() + 2 * nodes};
        constexpr std::size_t kNodes = 4096;
        workers.run((nodes + kNodes - 1) / kNodes, [&](std::size_t piece, std::size_t) {
            const std::size_t first = piece * kNodes, count = std::min(kNodes, nodes - first);
            const auto factor = static_cast<T>(1 / cell_size);
            const std::ptrdiff_t stride = displacement.stride, at = static_cast<std::ptrdiff_t>(first) * stride;
            if (stride == 3 && displacement.y == displacement.x + 1 && displacement.z == displacement.x + 2) {
                table.from_interleaved()(displacement.x + at, factor, u[0] + first, u[1] + first, u[2] + first,
                                         static_cast<kernels::Range>(count));
                return;
            }
            const std::array<const T*, 3> from = {displacement.x, displacement.y, displacement.z};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::size_t n = 0; n < count; ++n) {
                    u[axis][first + n] = factor * from[axis][at + static_cast<std::ptrdiff_t>(n) * stride];
                }
            }
        });
        const auto kernel = table.cell_stress(on_means, stiffening.any(), accuracy);
        kernels::StressCells<T> common{};
        std::copy(u.begin(), u.end(), common.displacement);
        std::transform(springs.begin(), springs.end(), common.springs, [](double k) { return static_cast<T>(k); });
        common.stiffening = {static_cast<T>(stiffening.quadratic), static_cast<T>(stiffening.cubic)};
        common.crush = static_cast<T>(crush);
        common.crush_bound = static_cast<T>(crush_bound);
        common.bending = static_cast<T>(pattern.bending / cell_size);
        common.coupling = static_cast<T>(pattern.coupling);
        common.twist = static_cast<T>(pattern.twist / cell_size);
        common.joint_twist = static_cast<T>(pattern.joint_twist / cell_size);
        common.fourth = static_cast<T>(pattern.fourth / cell_size);
        workers.run((cells + kCellsAPiece - 1) / kCellsAPiece, [&](std::size_t piece, std::size_t) {
            const std::size_t first = piece * kCellsAPiece, count = std::min(kCellsAPiece, cells - first);
            kernels::StressCells<T> own = common;
            std::array<std::array<T, kCellsAPiece>, 3> of_cells; // scale, volume moduli
            for (std::size_t n = 0; n < kCellsAPiece; ++n) {
                of_cells[0][n] = static_cast<T>(n < count ? scales[first + n] : 0);
            }
            for (std::size_t energy = 0; energy < 2; ++energy) {
                of_cells[1 + energy].fill(static_cast<T>(volumes[0][energy]));
                for (std::size_t n = 0; n < count && volumes.size() > 1; ++n) {
                    of_cells[1 + energy][n] = static_cast<T>(volumes[tissues[first + n]][energy]);
                }
            }
            own.scale = of_cells[0].data();
            own.quadratic = of_cells[1].data();
            own.mean_stretch = of_cells[2].data();
            for (std::size_t c = 0; c < 8; ++c) {
                own.corners[c] = corners[c].data() + first;
            }
            own.in_a_row = in_a_row.data() + first;
            take(first, count, own, kernel);
        });
    }

    template <class T>
    void read_into(const VectorField<const T>& displacement, const StressArrays<T>& into) const {
        read(displacement, [&](std::size_t first, std::size_t count, kernels::StressCells<T>& own, auto kernel) {
            point(own, into, first);
            kernel(own, static_cast<kernels::Range>(count));
        });
    }

    template <class T>
    void read_into(const VectorField<const T>& displacement, std::span<CellStress> stresses) const {
        read(displacement, [&](std::size_t first, std::size_t count, kernels::StressCells<T>& own, auto kernel) {
            std::array<std::array<T, kCellsAPiece>, kernels::kStressVonMises> values;
            for (std::size_t i = 0; i < values.size(); ++i) {
                own.values[i] = values[i].data();
            }
            kernel(own, static_cast<kernels::Range>(count));
            for (std::size_t n = 0; n < count; ++n) {
                const auto value = [&](int i) { return static_cast<double>(values[static_cast<std::size_t>(i)][n]); };
                CellStress& stress = stresses[first + n];
                for (int i = 0; i < 9; ++i) {
                    stress.first_piola[static_cast<std::size_t>(i)] = value(kernels::kStressPiola + i);
                }
                for (int s = 0; s < 6; ++s) {
                    stress.cauchy[static_cast<std::size_t>(s)] = value(kernels::kStressCauchy + s);
                    stress.green_strain[static_cast<std::size_t>(s)] = value(kernels::kStressGreen + s);
                }
                stress.volume_ratio = value(kernels::kStressVolumeRatio);
                stress.energy_density = value(kernels::kStressEnergy);
            }
        });
    }

    std::size_t nodes, cells;
    double cell_size;
    InstructionSet set;
    Accuracy accuracy;
    std::array<std::vector<std::int32_t>, 8> corners;
    std::vector<std::uint8_t> in_a_row; ///< so many cells from each on have nodes one after the other
    std::vector<double> scales;         ///< one a cell
    std::vector<std::uint8_t> tissues;  ///< likewise
    std::array<double, 3> springs{};    ///< k/h of edges, face and cube diagonals
    bool on_means = false;
    SpringStiffening stiffening;
    PatternConstants pattern{};
    double crush = 0, crush_bound = 0;          ///< modulus; J - 1 below which it acts
    std::vector<std::array<double, 2>> volumes; ///< by tissue: moduli of the quadratic energy and of mean stretch
    Workers workers;
};

StressMeter::StressMeter(const Lattice& lattice, const Material& material,
                         std::span<const std::array<std::uint32_t, 8>> cells, std::size_t node_count,
                         const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(lattice, material, cells, node_count, options)) {
    for (const auto& cell : cells) {
        for (const std::uint32_t node : cell) {
            if (node >= node_count) {
                throw std::invalid_argument("cells: node " + std::to_string(node) + " does not exist: there are " +
                                            std::to_string(node_count));
            }
        }
    }
}
StressMeter::StressMeter(const Lattice& lattice, const Material& material, const PlanOptions& options) {
    const std::size_t nodes = lattice.nodes().size();
    implementation_ = std::make_unique<Implementation>(lattice, material, cell_corners(lattice), nodes, options);
}
StressMeter::StressMeter(StressMeter&&) noexcept = default;
StressMeter& StressMeter::operator=(StressMeter&&) noexcept = default;
StressMeter::~StressMeter() = default;

std::size_t StressMeter::cell_count() const {
    return implementation_->cells;
}
std::size_t StressMeter::node_count() const {
    return implementation_->nodes;
}

template <class T>
void StressMeter::read(VectorField<const T> displacement, std::span<CellStress> stresses) const {
    check_field(displacement, implementation_->nodes, "nodes", "the body");
    if (stresses.size() != implementation_->cells) {
        throw std::invalid_argument("stresses: room for " + std::to_string(stresses.size()) + ", the body has " +
                                    std::to_string(implementation_->cells) + " cells");
    }
    implementation_->read_into(displacement, stresses);
}

template <class T>
void StressMeter::read(VectorField<const T> displacement, const StressArrays<T>& arrays) const {
    check_field(displacement, implementation_->nodes, "nodes", "the body");
    implementation_->read_into(displacement, arrays);
}

template void StressMeter::read(VectorField<const float>, std::span<CellStress>) const;
template void StressMeter::read(VectorField<const double>, std::span<CellStress>) const;
template void StressMeter::read(VectorField<const float>, const StressArrays<float>&) const;
template void StressMeter::read(VectorField<const double>, const StressArrays<double>&) const;

} // namespace hybmss
