#include "layouts/lattice/cell_shares.hpp"

namespace hybmss {

CellShares::CellShares(const Lattice& lattice, const Material& material, const LatticeAxes& axes)
    : lattice_(lattice), axes_(axes) {
    const double h = lattice.cell_size();
    const SpringConstants constants = spring_constants(material, h);
    edge_ = constants.edge / 4 * h;
    face_ = constants.face_diagonal / 2 * h;
    cube_ = constants.cube_diagonal * h;
    cell_mass_ = material.density * h * h * h / 8;
    volume_ratio_ = volume_modulus(material) * h * h / (32 * cube_);
}

/// The stiffness scale of a cell; zero outside.
double CellShares::scale_at(const std::array<int, 3>& place) const {
    std::array<int, 3> cell{};
    for (std::size_t c = 0; c < 3; ++c) {
        if (place[c] < 0 || place[c] >= lattice_.cells()[axes_[c]]) {
            return 0;
        }
        cell[axes_[c]] = place[c];
    }
    return static_cast<double>(lattice_.cell_scale(cell[0], cell[1], cell[2]));
}

CellShares::Node CellShares::at(const std::array<std::size_t, 3>& place) const {
    const int i = static_cast<int>(place[0]), j = static_cast<int>(place[1]), k = static_cast<int>(place[2]);
    Node node{{}, 0};
    // s[bits]: the cells around the node, bit set = on its low side.
    double s[8];
    for (int bits = 0; bits < 8; ++bits) {
        s[bits] = scale_at({i - (bits & 1), j - (bits >> 1 & 1), k - (bits >> 2)});
        node.cells += s[bits] > 0;
    }
    node.stiffness = {edge_ * (s[0] + s[2] + s[4] + s[6]), // along a row: cells that differ across it
                      edge_ * (s[0] + s[1] + s[4] + s[5]),
                      edge_ * (s[0] + s[1] + s[2] + s[3]),
                      face_ * (s[0] + s[4]), // in a plane: cells below and above
                      face_ * (s[0] + s[2]),
                      face_ * (s[0] + s[1]),
                      cube_ * s[0]};
    return node;
}

} // namespace hybmss
