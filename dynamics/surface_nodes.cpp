#include "hybmss/contact.hpp"

namespace hybmss {

std::vector<SurfaceNode> surface_nodes(const Lattice& lattice, const std::array<double, 3>& origin) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    const auto [nx, ny, nz] = lattice.cells();
    const auto filled = [&, nx = nx, ny = ny, nz = nz](int i, int j, int k) {
        return i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz && lattice.cell_scale(i, j, k) > 0;
    };
    std::vector<SurfaceNode> surface;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto row = static_cast<std::size_t>(nx) + 1, layer = row * (static_cast<std::size_t>(ny) + 1);
        const int i = static_cast<int>(nodes[n] % row), j = static_cast<int>(nodes[n] % layer / row),
                  k = static_cast<int>(nodes[n] / layer);
        int around = 0;
        for (int corner = 0; corner < 8; ++corner) {
            around += filled(i - (corner & 1), j - (corner >> 1 & 1), k - (corner >> 2));
        }
        if (around < 8) {
            std::array<double, 3> position = lattice.rest_position(nodes[n]);
            for (std::size_t a = 0; a < 3; ++a) {
                position[a] += origin[a];
            }
            surface.push_back({static_cast<std::uint32_t>(n), position});
        }
    }
    return surface;
}

std::vector<SurfaceNode> surface_nodes(const Network& network) {
    std::vector<int> cells(network.rest_positions.size(), 0);
    for (const Network::Cell& cell : network.cells) {
        for (const auto node : cell.nodes) {
            ++cells[static_cast<std::size_t>(node)];
        }
    }
    std::vector<SurfaceNode> surface;
    for (std::size_t n = 0; n < cells.size(); ++n) {
        if (cells[n] < 8) {
            surface.push_back({static_cast<std::uint32_t>(n), network.rest_positions[n]});
        }
    }
    return surface;
}

} // namespace hybmss
