#include "hybmss/stress.hpp"

#include "layouts/node_numbers.hpp"
#include "plan/bodies/field_checks.hpp"
#include "plan/threads/workers.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace hybmss {
namespace {

/// So many cells are computed side by side.
constexpr int kCellsTogether = 8;
using Lanes = Eigen::Array<double, kCellsTogether, 1>;
using LaneVector = std::array<Lanes, 3>;
using LaneMatrix = std::array<LaneVector, 3>; ///< by rows

Lanes dot(const LaneVector& a, const LaneVector& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// -1 on a corner's low side of an axis, +1 on its high side.
double side(std::size_t corner, std::size_t axis) {
    return corner >> axis & 1 ? 1.0 : -1.0;
}

/// One of the 13 springs of a cell of edge 1, and the pairs of corners that it joins: 4, 2 or 1 of its parallels.
struct Direction {
    std::array<int, 3> rest;
    std::size_t axes; ///< 1: edge, 2: face diagonal, 3: cube diagonal
    std::vector<std::array<std::size_t, 2>> pairs;
};

std::vector<Direction> directions() {
    std::vector<Direction> all;
    for (int number = 14; number < 27; ++number) { // one of r and -r each
        const std::array<int, 3> rest = {number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1};
        Direction direction{rest, 0, {}};
        for (const int r : rest) {
            direction.axes += r != 0;
        }
        for (std::size_t from = 0; from < 8; ++from) {
            std::size_t to = from;
            bool inside = true;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const bool high = (from >> axis & 1) != 0;
                inside = inside && !(rest[axis] > 0 && high) && !(rest[axis] < 0 && !high);
                to ^= static_cast<std::size_t>(rest[axis] != 0) << axis;
            }
            if (inside) {
                direction.pairs.push_back({from, to});
            }
        }
        all.push_back(std::move(direction));
    }
    return all;
}

// phi(J) and phi'(J) at j = J - 1: see VolumeEnergy.
std::pair<double, double> volume_energy_at(VolumeEnergy energy, double j) {
    if (energy == VolumeEnergy::quadratic) {
        return {0.5 * j * j, j};
    }
    if (j < -7.0 / 8.0) {
        return {9.0 / 8.0 - 6.0 * (j + 7.0 / 8.0), -6};
    }
    const double stretch = std::expm1(std::log1p(j) / 3), c = 1 + stretch;
    return {4.5 * stretch * stretch, 3 * stretch / (c * c)};
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

/// Lengths are in cell sizes, moduli and energies in Pa.
struct StressMeter::Implementation {
    /// What cells of a tissue have for volume energy at the scale 1.
    struct Volume {
        VolumeEnergy energy;
        double kappa;
    };
    using CellVolumes = std::array<Volume, kCellsTogether>;

    Implementation(const Lattice& lattice, const Material& given,
                   std::span<const std::array<std::uint32_t, 8>> cells_of_body, std::size_t node_count,
                   const PlanOptions& options)
        : material(given), nodes(node_count), cell_size(lattice.cell_size()),
          cells(cells_of_body.begin(), cells_of_body.end()), springs(directions()),
          workers(useful_threads(options, node_count), options.task_runner) {
        validate(lattice, material);
        const SpringConstants k = spring_constants(material, cell_size);
        spring_moduli = {k.edge / cell_size, k.face_diagonal / cell_size, k.cube_diagonal / cell_size};
        pattern = pattern_constants(material, cell_size);
        for (double* const p : {&pattern.bending, &pattern.twist, &pattern.joint_twist, &pattern.fourth}) {
            *p /= cell_size;
        }
        crush = crush_modulus(material);
        for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
            const Material own = material_of(lattice, tissue, material);
            const VolumeEnergy energy = resolved_volume_energy(own);
            volumes.push_back({energy, energy == VolumeEnergy::none ? 0 : volume_modulus(own)});
            volumetric = volumetric || crush > 0 || volumes.back().kappa != 0;
        }
        for (std::size_t cell = 0; cell < lattice.cell_scales().size(); ++cell) {
            if (lattice.cell_scales()[cell] > 0) {
                scales.push_back(lattice.cell_scales()[cell] / lattice.cell_fill(cell)); // of what fills it
                tissues.push_back(static_cast<std::uint8_t>(lattice.cell_tissue(cell)));
            }
        }
        if (scales.size() != cells.size()) {
            throw std::invalid_argument("cells: " + std::to_string(cells.size()) + " given, the lattice has " +
                                        std::to_string(scales.size()));
        }
    }

    /// d (x) r of a spring, or of several that are parallel, with its energy.
    void add_spring(const Direction& spring, double modulus, const LaneVector& change, LaneMatrix& piola,
                    Lanes& density) const {
        const double length = std::sqrt(static_cast<double>(spring.axes));
        LaneVector d = change;
        Lanes q = dot(change, change);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            d[axis] += spring.rest[axis];
            q += 2.0 * spring.rest[axis] * change[axis];
        }
        const Lanes size = dot(d, d).sqrt().max(1e-12 * length);
        const Lanes elongation = q / (size + length), strain = elongation / length;
        const SpringStiffening& law = material.stiffening;
        const Lanes pull = modulus * (elongation + length * strain * strain * (law.quadratic + law.cubic * strain));
        density += modulus * elongation * elongation *
                   (0.5 + strain * (law.quadratic / 3) + strain * strain * (law.cubic / 4));
        for (std::size_t i = 0; i < 3; ++i) {
            const Lanes along = pull / size * d[i];
            for (std::size_t j = 0; j < 3; ++j) {
                if (spring.rest[j] != 0) {
                    piola[i][j] += spring.rest[j] * along;
                }
            }
        }
    }

    /// What holds the patterns that springs on means do not see.
    void add_patterns(const std::array<LaneVector, 8>& u, const LaneMatrix& f, LaneMatrix& piola,
                      Lanes& density) const {
        std::array<LaneVector, 3> g; // g_1, g_2, g_3
        LaneVector fourth;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            g[0][axis] = g[1][axis] = g[2][axis] = fourth[axis] = Lanes::Zero();
            for (std::size_t c = 0; c < 8; ++c) {
                const double x = side(c, 0) / 8, y = side(c, 1), z = side(c, 2);
                g[0][axis] += y * z / 8 * u[c][axis];
                g[1][axis] += x * z * u[c][axis];
                g[2][axis] += x * y * u[c][axis];
                fourth[axis] += x * y * z * u[c][axis];
            }
        }
        LaneMatrix p, q;
        Lanes trace = Lanes::Zero();
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                p[i][j] = dot(g[i], {f[0][j], f[1][j], f[2][j]});
            }
            trace += p[i][i];
        }
        density += 0.5 * pattern.fourth * dot(fourth, fourth);
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                q[i][j] = i == j ? Lanes(pattern.twist * p[i][i] + pattern.joint_twist * trace)
                                 : Lanes(pattern.bending * (p[i][j] + pattern.coupling * p[j][i]));
                density += 0.5 * p[i][j] * q[i][j];
            }
        }
        for (std::size_t row = 0; row < 3; ++row) {
            for (std::size_t j = 0; j < 3; ++j) {
                piola[row][j] += g[0][row] * q[0][j] + g[1][row] * q[1][j] + g[2][row] * q[2][j];
            }
        }
    }

    void add_volume(const CellVolumes& of_cells, const LaneMatrix& f, const Lanes& j, LaneMatrix& piola,
                    Lanes& density) const {
        Lanes slope;
        for (int n = 0; n < kCellsTogether; ++n) {
            const auto& [energy, kappa] = of_cells[static_cast<std::size_t>(n)];
            const auto [value, derivative] = kappa == 0 ? std::pair{0.0, 0.0} : volume_energy_at(energy, j[n]);
            const double depth = crush > 0 ? std::max(material.crush.ratio - 1 - j[n], 0.0) : 0;
            density[n] += kappa * value + crush * depth * depth * depth / 3;
            slope[n] = kappa * derivative - crush * depth * depth;
        }
        for (std::size_t row = 0; row < 3; ++row) {
            const std::size_t r1 = (row + 1) % 3, r2 = (row + 2) % 3;
            for (std::size_t column = 0; column < 3; ++column) {
                const std::size_t c1 = (column + 1) % 3, c2 = (column + 2) % 3;
                piola[row][column] += slope * (f[r1][c1] * f[r2][c2] - f[r1][c2] * f[r2][c1]); // of cof F
            }
        }
    }

    /// Of cells side by side, from the displacements of their corners.
    void compute(const std::array<LaneVector, 8>& u, const Lanes& scale, const CellVolumes& of_cells,
                 std::span<CellStress> out) const {
        LaneMatrix h, f, piola; // displacement and deformation gradient
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                h[i][j] = piola[i][j] = Lanes::Zero();
                for (std::size_t low = 0; low < 8; ++low) {
                    if ((low >> j & 1) == 0) {
                        h[i][j] += 0.25 * (u[low | std::size_t{1} << j][i] - u[low][i]);
                    }
                }
                f[i][j] = h[i][j] + (i == j ? 1.0 : 0.0);
            }
        }
        Lanes density = Lanes::Zero();
        const bool on_means = material.springs == SpringForm::means;
        for (const Direction& spring : springs) {
            const double modulus = spring_moduli[spring.axes - 1];
            if (modulus == 0) {
                continue;
            }
            if (on_means) {
                LaneVector change;
                for (std::size_t i = 0; i < 3; ++i) {
                    change[i] = spring.rest[0] * h[i][0] + spring.rest[1] * h[i][1] + spring.rest[2] * h[i][2];
                }
                add_spring(spring, modulus, change, piola, density);
                continue;
            }
            for (const auto& [from, to] : spring.pairs) {
                const LaneVector change = {u[to][0] - u[from][0], u[to][1] - u[from][1], u[to][2] - u[from][2]};
                add_spring(spring, modulus / static_cast<double>(spring.pairs.size()), change, piola, density);
            }
        }
        if (on_means) {
            add_patterns(u, f, piola, density);
        }
        const auto minor = [&h](std::size_t i, std::size_t j) { return h[i][i] * h[j][j] - h[i][j] * h[j][i]; };
        const Lanes determinant = h[0][0] * minor(1, 2) - h[0][1] * (h[1][0] * h[2][2] - h[1][2] * h[2][0]) +
                                  h[0][2] * (h[1][0] * h[2][1] - h[1][1] * h[2][0]);
        const Lanes j = h[0][0] + h[1][1] + h[2][2] + minor(0, 1) + minor(1, 2) + minor(0, 2) + determinant;
        if (volumetric) {
            add_volume(of_cells, f, j, piola, density);
        }
        constexpr std::array<std::array<std::size_t, 2>, 6> kSymmetric = {
            {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
        for (std::size_t n = 0; n < out.size(); ++n) {
            const auto lane = static_cast<Eigen::Index>(n);
            CellStress& stress = out[n];
            stress.volume_ratio = 1 + j[lane];
            stress.energy_density = scale[lane] * density[lane];
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t column = 0; column < 3; ++column) {
                    stress.first_piola[3 * i + column] = scale[lane] * piola[i][column][lane];
                }
            }
            const double volume = std::copysign(std::max(std::abs(stress.volume_ratio), 1e-9), stress.volume_ratio);
            for (std::size_t s = 0; s < 6; ++s) {
                const auto [a, b] = kSymmetric[s];
                double kirchhoff = 0, product = 0;
                for (std::size_t m = 0; m < 3; ++m) {
                    kirchhoff += stress.first_piola[3 * a + m] * f[b][m][lane];
                    kirchhoff += stress.first_piola[3 * b + m] * f[a][m][lane];
                    product += h[m][a][lane] * h[m][b][lane];
                }
                stress.cauchy[s] = kirchhoff / (2 * volume);
                stress.green_strain[s] = 0.5 * (h[a][b][lane] + h[b][a][lane] + product);
            }
        }
    }

    template <class T>
    void read(const VectorField<const T>& displacement, std::span<CellStress> stresses) const {
        const std::array<const T*, 3> from = {displacement.x, displacement.y, displacement.z};
        constexpr std::size_t kPiece = 512;
        static_assert(kPiece % kCellsTogether == 0); // so that what is computed side by side is the same for any piece
        workers.run((cells.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
            const std::size_t end = std::min((piece + 1) * kPiece, cells.size());
            for (std::size_t first = piece * kPiece; first < end; first += kCellsTogether) {
                const std::size_t count = std::min<std::size_t>(kCellsTogether, end - first);
                std::array<LaneVector, 8> u;
                Lanes scale;
                CellVolumes own;
                for (std::size_t n = 0; n < kCellsTogether; ++n) {
                    const std::size_t cell = first + std::min(n, count - 1);
                    const auto lane = static_cast<Eigen::Index>(n);
                    scale[lane] = static_cast<double>(scales[cell]);
                    own[n] = volumes[tissues[cell]];
                    for (std::size_t c = 0; c < 8; ++c) {
                        const auto at = static_cast<std::ptrdiff_t>(cells[cell][c]) * displacement.stride;
                        for (std::size_t axis = 0; axis < 3; ++axis) {
                            u[c][axis][lane] = static_cast<double>(from[axis][at]) / cell_size;
                        }
                    }
                }
                compute(u, scale, own, stresses.subspan(first, count));
            }
        });
    }

    Material material;
    std::size_t nodes;
    double cell_size;
    std::vector<std::array<std::uint32_t, 8>> cells;
    std::vector<float> scales;         ///< one a cell
    std::vector<std::uint8_t> tissues; ///< likewise
    std::vector<Direction> springs;
    std::array<double, 3> spring_moduli{}; ///< k/h of edges, face and cube diagonals
    PatternConstants pattern{};            ///< over h
    double crush = 0;
    std::vector<Volume> volumes; ///< by tissue
    bool volumetric = false;     ///< some have an energy, or resist being crushed
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
    return implementation_->cells.size();
}
std::size_t StressMeter::node_count() const {
    return implementation_->nodes;
}

template <class T>
void StressMeter::read(VectorField<const T> displacement, std::span<CellStress> stresses) const {
    const Implementation& i = *implementation_;
    check_field(displacement, i.nodes, "nodes", "the body");
    if (stresses.size() != i.cells.size()) {
        throw std::invalid_argument("stresses: room for " + std::to_string(stresses.size()) + ", the body has " +
                                    std::to_string(i.cells.size()) + " cells");
    }
    i.read(displacement, stresses);
}

template void StressMeter::read(VectorField<const float>, std::span<CellStress>) const;
template void StressMeter::read(VectorField<const double>, std::span<CellStress>) const;

} // namespace hybmss
