#include "app/tune_rows.hpp"

#include "bench/standard_bodies.hpp"

#include <cmath>

namespace hybmss {
namespace {

struct Variant {
    const char* name;
    double face_diagonal_ratio;
    VolumeEnergy volume_energy;
    bool for_networks; ///< networks know neither face diagonals nor, where they have no cells, a volume energy
};

constexpr Variant kVariants[] = {{"HybMSS", 1, VolumeEnergy::quadratic, true},
                                 {"HybMSS mean-stretch", 1, VolumeEnergy::mean_stretch, false},
                                 {"HybMSS-FD", 0, VolumeEnergy::quadratic, false},
                                 {"HybMSS-CF", 1, VolumeEnergy::none, true}};

std::string row_name(const std::string& body, bool network, Precision precision, bool forces) {
    return std::string(forces ? "forces " : "step ") + body + (network ? " as network " : " ") +
           std::string(name(precision));
}

} // namespace

TuneRow tune_row(const std::string& scene_name, const Lattice& lattice, const Material& material, Precision precision,
                 bool forces) {
    return {row_name(scene_name, false, precision, forces), lattice, material, false, precision, forces};
}

std::vector<TuneRow> tune_matrix(const std::vector<Precision>& precisions, bool forces) {
    std::vector<TuneRow> rows;
    for (int half_steps = 18; half_steps <= 36; ++half_steps) {
        const int edge = static_cast<int>(std::lround(std::exp2(half_steps / 6.0))) - 1;
        const std::string cube = std::to_string(edge) + "^3";
        for (const Variant& variant : kVariants) {
            Material material;
            material.poisson_ratio = 0.4;
            material.face_diagonal_ratio = variant.face_diagonal_ratio;
            material.volume_energy = variant.volume_energy;
            for (const bool network : {false, true}) {
                if (network && (!variant.for_networks || half_steps > 32)) {
                    continue;
                }
                for (const Precision precision : precisions) {
                    rows.push_back({row_name(cube + " " + variant.name, network, precision, forces),
                                    Lattice::box(edge, edge, edge, 0.1), material, network, precision, forces});
                }
            }
        }
    }
    return rows;
}

std::vector<TuneRow> check_rows(const std::vector<Precision>& precisions, bool forces) {
    constexpr double kCellSize = 0.1;
    std::vector<std::pair<std::string, Lattice>> bodies;
    for (const auto& [nx, ny, nz] : kTable6) {
        bodies.emplace_back(std::to_string(nx) + "x" + std::to_string(ny) + "x" + std::to_string(nz),
                            Lattice::box(nx, ny, nz, kCellSize));
    }
    bodies.emplace_back("hollow-ball-64", hollow_ball(64, 4, kCellSize));
    Material material;
    material.poisson_ratio = 0.4;
    std::vector<TuneRow> rows;
    for (const auto& [name, lattice] : bodies) {
        for (const Precision precision : precisions) {
            rows.push_back(tune_row(name, lattice, material, precision, forces));
        }
    }
    return rows;
}

} // namespace hybmss
