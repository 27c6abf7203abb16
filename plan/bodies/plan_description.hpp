#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"
#include "hybmss/plan_options.hpp"
#include "kernels/arguments.hpp"

#include <string>
#include <type_traits>

namespace hybmss {

/// That of a body's cells; none where tissues have volume forces of their own, which are a pass by themselves.
kernels::Volume kernel_volume(const Lattice& lattice, const Material& material);
kernels::Volume kernel_volume(const Network& network);

/// Of cells with springs on means that have these constants, by that of the cube diagonals.
template <class T>
kernels::MeanConstants<T> mean_constants(const SpringConstants& springs, const PatternConstants& patterns);

/// Of a network, the cells with springs on means.
struct NetworkMeans {
    explicit NetworkMeans(const Network& network);
    std::size_t springs() const { return cells * (face_diagonals ? 13 : 7); }

    std::size_t cells;
    bool face_diagonals;
    bool alone; ///< there is nothing else
};

/// "<face_diagonals, quadratic, fast>"
std::string lattice_variant(bool face_diagonals, kernels::Volume volume, Accuracy accuracy);
/// "packed_springs<fast> + packed_cells<quadratic>", "network_means<no face diagonals, quadratic, fast>", or both.
std::string network_kernels(const std::string& kind, const NetworkMeans& means, kernels::Volume volume,
                            Accuracy accuracy);

template <class T>
std::string precision_name() {
    return std::is_same_v<T, float> ? "float" : "double";
}

} // namespace hybmss
