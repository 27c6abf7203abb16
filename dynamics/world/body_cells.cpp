#include "dynamics/world/body_cells.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

/// The corners of a face, ascending by their bits.
std::array<std::uint32_t, 4> face_corners(const std::array<std::uint32_t, 8>& cell, std::size_t face) {
    std::array<std::uint32_t, 4> corners{};
    std::size_t count = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        if ((corner >> (face / 2) & 1) == (face & 1)) {
            corners[count++] = cell[corner];
        }
    }
    return corners;
}

/// One side of a face: whose it is.
struct Side {
    std::array<std::uint32_t, 4> nodes; ///< ascending
    std::uint32_t cell;
    std::uint32_t face;
};

constexpr std::uint32_t kNobody = 0xffffffff;

} // namespace

BodyCells::BodyCells(std::vector<std::array<std::uint32_t, 8>> cells, const std::vector<Point>& rest)
    : corners(std::move(cells)), layers(corners.size()) {
    std::vector<Side> sides;
    sides.reserve(6 * corners.size());
    first_cell_of.assign(rest.size() + 1, 0);
    for (std::uint32_t cell = 0; cell < corners.size(); ++cell) {
        for (std::uint32_t face = 0; face < 6; ++face) {
            Side side{face_corners(corners[cell], face), cell, face};
            std::sort(side.nodes.begin(), side.nodes.end());
            sides.push_back(side);
        }
        for (std::size_t corner = 0; corner < 8; ++corner) {
            ++first_cell_of[corners[cell][corner] + 1];
            for (std::size_t bit = 1; bit < 8; bit *= 2) {
                const Point along = plus(rest[corners[cell][corner | bit]], -1, rest[corners[cell][corner & ~bit]]);
                edge = std::max(edge, length(along));
            }
        }
    }
    for (std::size_t n = 0; n < rest.size(); ++n) {
        first_cell_of[n + 1] += first_cell_of[n];
    }
    cells_of.resize(8 * corners.size());
    std::vector<std::uint32_t> next(first_cell_of.begin(), first_cell_of.end() - 1);
    for (std::uint32_t cell = 0; cell < corners.size(); ++cell) {
        for (const std::uint32_t node : corners[cell]) {
            cells_of[next[node]++] = cell;
        }
    }
    // Two sides of the same nodes are neighbours.
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.nodes < b.nodes; });
    std::vector<std::array<std::uint32_t, 6>> beyond(corners.size()), face_there(corners.size());
    for (std::size_t i = 0; i < sides.size();) {
        const Side& side = sides[i];
        if (i + 1 < sides.size() && sides[i + 1].nodes == side.nodes) {
            const Side& other = sides[i + 1];
            beyond[side.cell][side.face] = other.cell;
            beyond[other.cell][other.face] = side.cell;
            face_there[side.cell][side.face] = other.face;
            face_there[other.cell][other.face] = side.face;
            i += 2;
        } else {
            beyond[side.cell][side.face] = kNobody;
            surface.insert(surface.end(), side.nodes.begin(), side.nodes.end());
            ++i;
        }
    }
    // From every free face straight on to the next.
    for (std::uint32_t cell = 0; cell < corners.size(); ++cell) {
        layers[cell].fill(kDeep);
    }
    for (std::uint32_t cell = 0; cell < corners.size(); ++cell) {
        for (std::uint32_t face = 0; face < 6; ++face) {
            std::uint32_t at = beyond[cell][face] == kNobody ? cell : kNobody, back = face;
            for (std::uint8_t count = 0; at != kNobody && count < kDeep; ++count) {
                layers[at][back] = count;
                const std::uint32_t here = at, onward = back ^ 1;
                at = beyond[here][onward];
                back = face_there[here][onward];
            }
        }
    }
    for (std::uint32_t cell = 0; cell < corners.size(); ++cell) {
        if (*std::min_element(layers[cell].begin(), layers[cell].end()) < 2) {
            outer.push_back(cell);
        }
    }
    if (corners.empty()) {
        surface.resize(rest.size());
        for (std::uint32_t n = 0; n < rest.size(); ++n) {
            surface[n] = n;
        }
    }
    std::sort(surface.begin(), surface.end());
    surface.erase(std::unique(surface.begin(), surface.end()), surface.end());
}

std::optional<PlaceInCell> place_in_cell(const std::array<Point, 8>& corners, const Point& x) {
    // x = sum over the axes' subsets s of c[s] prod xi_a, a in s
    std::array<Point, 8> c = corners;
    for (std::size_t bit = 1; bit < 8; bit *= 2) {
        for (std::size_t s = 0; s < 8; ++s) {
            if (s & bit) {
                c[s] = plus(c[s], -1, c[s ^ bit]);
            }
        }
    }
    constexpr int kIterations = 12;
    constexpr double kFar = 2, kExact = 1e-10;
    PlaceInCell place{{0.5, 0.5, 0.5}, {}};
    Point& xi = place.xi;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
        Point at;
        std::array<Point, 3> j; // d x / d xi_a
        for (std::size_t a = 0; a < 3; ++a) {
            const double yz = c[6][a] + c[7][a] * xi[0];
            at[a] = c[0][a] + xi[0] * (c[1][a] + xi[1] * c[3][a] + xi[2] * c[5][a]) + xi[1] * c[2][a] +
                    xi[2] * c[4][a] + xi[1] * xi[2] * yz;
            j[0][a] = c[1][a] + xi[1] * c[3][a] + xi[2] * c[5][a] + xi[1] * xi[2] * c[7][a];
            j[1][a] = c[2][a] + xi[0] * c[3][a] + xi[2] * yz;
            j[2][a] = c[4][a] + xi[0] * c[5][a] + xi[1] * yz;
        }
        const Point xy = cross(j[0], j[1]), yz = cross(j[1], j[2]), zx = cross(j[2], j[0]);
        const double volume = dot(j[0], yz);
        if (!(volume > 0)) {
            return {};
        }
        const Point missing = plus(x, -1, at);
        const Point change = {dot(yz, missing) / volume, dot(zx, missing) / volume, dot(xy, missing) / volume};
        xi = plus(xi, 1, change);
        if (!(std::max({std::abs(xi[0] - 0.5), std::abs(xi[1] - 0.5), std::abs(xi[2] - 0.5)}) < kFar)) {
            return {};
        }
        if (dot(change, change) < kExact * kExact || iteration + 1 == kIterations) {
            for (std::size_t a = 0; a < 3; ++a) {
                place.gradient[a] = yz[a] / volume;
                place.gradient[3 + a] = zx[a] / volume;
                place.gradient[6 + a] = xy[a] / volume;
            }
            return dot(change, change) < 1e-8 ? std::optional(place) : std::nullopt;
        }
    }
    return {};
}

} // namespace hybmss
