#include "layouts/flat_rows.hpp"

#include <algorithm>

namespace hybmss {
namespace {

/// The stiffness scale of a cell; zero outside.
double scale_at(const Lattice& lattice, int i, int j, int k) {
    const auto& [nx, ny, nz] = lattice.cells();
    const bool inside = i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz;
    return inside ? static_cast<double>(lattice.cell_scale(i, j, k)) : 0.0;
}

} // namespace

template <class T>
FlatRows<T>::FlatRows(const Lattice& lattice, const Material& material) : cell_size(lattice.cell_size()) {
    const auto [nx, ny, nz] = lattice.cells();
    row = static_cast<std::size_t>(nx) + 1;
    const std::size_t rows = static_cast<std::size_t>(ny) + 1;
    planes = static_cast<std::size_t>(nz) + 1;
    lanes = padded(row * rows);
    plane = padded(lanes + row + 1);
    for (auto& array : stiffness) {
        array = AlignedArray<T>(size());
    }
    inverse_mass = AlignedArray<T>(size());

    const SpringConstants constants = spring_constants(material, cell_size);
    const double edge = constants.edge / 4 * cell_size;
    const double face = constants.face_diagonal / 2 * cell_size;
    const double cube = constants.cube_diagonal * cell_size;
    volume_ratio = static_cast<T>(volume_modulus(material) * cell_size * cell_size / (32 * cube));
    const double cell_mass = material.density * cell_size * cell_size * cell_size / 8;

    for (int k = 0; k <= nz; ++k) {
        plane_runs.push_back(runs.size());
        for (int j = 0; j <= ny; ++j) {
            for (int i = 0; i <= nx; ++i) {
                const std::size_t n = static_cast<std::size_t>(k) * plane + static_cast<std::size_t>(j) * row +
                                      static_cast<std::size_t>(i);
                // s[bits]: the cells around the node, bit set = on its low side.
                double s[8];
                int touching = 0;
                for (int bits = 0; bits < 8; ++bits) {
                    s[bits] = scale_at(lattice, i - (bits & 1), j - (bits >> 1 & 1), k - (bits >> 2));
                    touching += s[bits] > 0;
                }
                const double k7[7] = {edge * (s[0] + s[2] + s[4] + s[6]), // along x: cells that differ in y and z
                                      edge * (s[0] + s[1] + s[4] + s[5]),
                                      edge * (s[0] + s[1] + s[2] + s[3]),
                                      face * (s[0] + s[4]), // normal to z: cells below and above
                                      face * (s[0] + s[2]),
                                      face * (s[0] + s[1]),
                                      cube * s[0]};
                for (std::size_t kind = 0; kind < 7; ++kind) {
                    stiffness[kind][n] = static_cast<T>(k7[kind]);
                }
                if (touching == 0) {
                    continue;
                }
                const double mass = cell_mass * touching;
                masses.push_back(mass);
                inverse_mass[n] = static_cast<T>(1 / (mass * cell_size));
                const bool new_run = runs.size() == plane_runs.back() || runs.back().index + runs.back().length != n;
                if (new_run) {
                    runs.push_back({node_count, n, 0});
                }
                ++runs.back().length;
                ++node_count;
            }
        }
    }
    plane_runs.push_back(runs.size());
}

template <class T>
std::size_t FlatRows<T>::bytes() const {
    return 8 * size() * sizeof(T) + masses.size() * sizeof(double) + runs.size() * sizeof(NodeRun) +
           plane_runs.size() * sizeof(std::size_t);
}

template <class T>
std::size_t FlatRows<T>::index_of(std::size_t node) const {
    const auto after =
        std::upper_bound(runs.begin(), runs.end(), node, [](std::size_t n, const NodeRun& r) { return n < r.node; });
    const NodeRun& run = *(after - 1);
    return run.index + (node - run.node);
}

template struct FlatRows<float>;
template struct FlatRows<double>;

} // namespace hybmss
