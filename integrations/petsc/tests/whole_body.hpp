#pragma once

/// \file
/// Bodies that every rank also has as a whole, and how far a rank's vectors are from what the whole body gives.
/// Differences are those of all ranks: each expectation holds on all of them, or fails on all.

#include "integrations/petsc/block.hpp"

#include "hybmss/material.hpp"
#include "hybmss/plan_options.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace hybmss::distributed {

struct Body {
    Grid grid;
    Lattice lattice;
    Material material;
};

inline Body box(Material material) {
    return {Grid{{7, 6, 9}, 0.1, {}}, Lattice::box(7, 6, 9, 0.1), material};
}

/// One cell of four missing, the others of several stiffnesses: no rank's block is full, and nodes are missing too.
inline Body sparse(Material material) {
    const auto scale = [](PetscInt i, PetscInt j, PetscInt k) {
        const auto mixed = static_cast<unsigned>(i * 7 + j * 13 + k * 29 + i * j * 3 + j * k * 5) * 2654435761u >> 28;
        return mixed < 4 || i + j + k < 4 ? 0.0f : static_cast<float>(mixed) / 8;
    };
    std::vector<float> scales;
    for (int k = 0; k < 6; ++k) {
        for (int j = 0; j < 8; ++j) {
            for (int i = 0; i < 7; ++i) {
                scales.push_back(scale(i, j, k));
            }
        }
    }
    return {Grid{{7, 8, 6}, 0.1, scale}, Lattice::from_cells(7, 8, 6, 0.1, scales), material};
}

inline std::vector<Body> bodies() {
    const Material plain{1e5, 0.3, 1000, 1, VolumeEnergy::automatic}, no_faces{1e5, 0, 900, 0, VolumeEnergy::automatic};
    // Springs on means reach no farther than their cell, nor does what keeps it from being crushed.
    Material on_means = no_faces;
    on_means.springs = SpringForm::means;
    on_means.crush = {20, 0.95};
    return {box(plain), box(no_faces), sparse(plain), sparse(no_faces), box(on_means), sparse(on_means)};
}

inline PlanOptions one_thread() {
    PlanOptions options;
    options.threads = 1;
    return options;
}

/// Visits every owned node that the body has: its number in the body, and its index in the rank's vectors.
template <class Visit>
void for_each_node(const Block& block, const Lattice& lattice, const Visit& visit) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto [nx, ny, nz] = lattice.cells();
        const NodeBox grid{{0, 0, 0}, {nx + 1, ny + 1, nz + 1}};
        const auto [i, j, k] = grid.place(nodes[n]);
        if (block.owned().holds(i, j, k)) {
            visit(n, block.owned().index(i, j, k));
        }
    }
}

inline double greatest_of_ranks(double own) {
    double all = 0;
    MPI_Allreduce(&own, &all, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    return all;
}

inline std::vector<double> values_of(Vec vector) {
    PetscInt size = 0;
    const PetscScalar* values = nullptr;
    check(VecGetLocalSize(vector, &size));
    check(VecGetArrayRead(vector, &values));
    std::vector<double> copy(values, values + size);
    check(VecRestoreArrayRead(vector, &values));
    return copy;
}

/// |distributed - whole| / scale[node], the greatest over nodes and ranks. NaN counts as infinite.
template <class Whole, class Scale>
double difference(const Block& block, const Lattice& lattice, Vec vector, const Whole& whole, const Scale& scale) {
    const std::vector<double> ours = values_of(vector);
    double greatest = 0;
    for_each_node(block, lattice, [&](std::size_t n, std::size_t owned) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double error = std::abs(ours[3 * owned + c] - static_cast<double>(whole(n, c))) / scale(n);
            greatest = std::isnan(error) ? std::numeric_limits<double>::infinity() : std::max(greatest, error);
        }
    });
    return greatest_of_ranks(greatest);
}

} // namespace hybmss::distributed
