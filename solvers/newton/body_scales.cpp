#include "solvers/newton/body_scales.hpp"

#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss {

BodyScales BodyScales::of(const Lattice& lattice, const Material& material) {
    const SpringConstants k = spring_constants(material, lattice.cell_size());
    const auto scales = lattice.cell_scales();
    const double stiffest = std::max({k.edge, std::sqrt(2.0) * k.face_diagonal, std::sqrt(3.0) * k.cube_diagonal});
    double square = 0;
    for (const int n : lattice.cells()) {
        square += static_cast<double>(n) * n;
    }
    return {static_cast<double>(*std::max_element(scales.begin(), scales.end())) * stiffest * lattice.cell_size(),
            lattice.cell_size(), std::sqrt(square) * lattice.cell_size()};
}

BodyScales BodyScales::of(const Network& network) {
    BodyScales scales;
    double sum = 0, square = 0;
    for (const Network::Spring& s : network.springs) {
        const double length = std::sqrt(rest_length2(s));
        sum += length;
        scales.spring_force = std::max(scales.spring_force, s.stiffness * length);
    }
    if (!network.springs.empty()) {
        scales.spring_length = sum / static_cast<double>(network.springs.size());
    }
    for (std::size_t c = 0; c < 3; ++c) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (const auto& x : network.rest_positions) {
            low = std::min(low, x[c]);
            high = std::max(high, x[c]);
        }
        square += high > low ? (high - low) * (high - low) : 0;
    }
    scales.extent = std::max(std::sqrt(square), scales.spring_length);
    return scales;
}

} // namespace hybmss
