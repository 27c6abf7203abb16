#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "plan/bodies/body.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace hybmss {

/// The sizes of a body at rest, by which a minimiser tells small from large.
struct BodyScales {
    double spring_force = 0;  ///< the largest k l, N
    double spring_length = 1; ///< a typical rest length, m
    double extent = 1;        ///< the diagonal of the bounding box, m

    static BodyScales of(const Lattice& lattice, const Material& material);
    static BodyScales of(const Network& network);
};

/// The hexahedra of a body, with or without a volume energy: what may be turned inside out.
struct SolidCells {
    struct Cell {
        std::array<std::uint32_t, 8> nodes; ///< of the body, by corner
        std::array<double, 9> rest_edges;   ///< a0, b0, c0, m
    };
    std::vector<Cell> cells;

    static SolidCells of(const Lattice& lattice);
    /// The cells that the network lists.
    static SolidCells of(const Network& network);
};

/// Smallest and largest V'/V0.
struct VolumeRatios {
    double min = 1, max = 1;
};

/// Volume ratios of a body's cells at its states.
template <class T>
class CellVolumes {
public:
    CellVolumes(const Body<T>& body, const SolidCells& solid);

    /// 1 and 1 where there is no cell.
    VolumeRatios ratios(const State<T>& state) const;

private:
    struct Cell {
        std::array<std::uint32_t, 8> places; ///< in the layout
        std::uint32_t shape;
    };
    /// Of the matrix with the columns a0, b0, c0, times the body's unit, by rows; cells of a lattice share one.
    std::vector<std::array<double, 9>> inverse_edges_;
    std::vector<Cell> cells_;
};

extern template class CellVolumes<float>;
extern template class CellVolumes<double>;

} // namespace hybmss
